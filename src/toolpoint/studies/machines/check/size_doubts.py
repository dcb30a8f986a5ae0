"""Doubts about places and sizes: points off the machine, screws thicker than long, carriages in machine coordinates, angles
typed in the other unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joints.law import LawDescription
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND
from toolpoint.machine.description.extent import body_span

LIGHTEST, DENSEST = 100.0, 2.3e4  # kg/m^3 of a shape of one density: hollow castings of robots have some hundreds
THICKEST, LONGEST = 0.2, 15.0  # m, of a ball screw
SLENDER = 0.34  # of a screw's length, that its diameter may be
SOFTEST, STIFFEST = 1e7, 1e11  # N/m of a carriage, nut or bearing of a catalogue
OFF_THE_MACHINE = 1.0  # times the machine's size, from a point to its own body
OFF_THE_JOINT = 2.0  # times the distance of the outer carriages from their middle
ALIKE = 1e-4  # rad, between an angle and what a quarter turn reads as in the other unit


def question_sizes(machine: Machine) -> list[Doubt]:
    """Return doubts about densities, points and bodies off the machine, catalogue parts, and angles in the other unit."""
    return [*_densities(machine), *_places(machine), *_parts(machine), *_angles(machine)]


def _densities(machine: Machine) -> Iterator[Doubt]:
    for name, body in machine.description.bodies.items():
        if body.density is not None and not LIGHTEST <= body.density <= DENSEST:
            word = "lighter than foam" if body.density < LIGHTEST else "denser than any metal"
            yield Doubt(f"bodies.{name}.density", f"{body.density:.4g} kg/m^3, {word}",
                        "check its unit (a number without one is in kg/m^3; iron has 7200, written 7.2 g/cm^3)",
                        figure=body.density)


def _places(machine: Machine) -> Iterator[Doubt]:
    """Doubt points far off their body, bodies far off all others, and bodies larger than the others together."""
    spans = {name: body_span(machine.description.bodies[name], machine.body_frames[i], machine.bodies[i].mass)
             for i, name in enumerate(machine.body_names) if machine.bodies[i].mass[0, 0] > 0}
    if len(spans) < 2:
        return
    corners = np.array([[centre - half, centre + half] for centre, half in spans.values()])
    sizes = np.array([float(2 * half.max()) for _, half in spans.values()])
    # The size of the machine by the middle half of its bodies: one body in a wrong place must not widen it.
    low, high = np.quantile(corners[:, 0], 0.25, axis=0), np.quantile(corners[:, 1], 0.75, axis=0)
    size = max(float(np.max(high - low)), float(np.median(sizes)))
    for k, (name, (centre, half)) in enumerate(spans.items()):
        rest = np.delete(corners, k, axis=0)
        apart = np.maximum(rest[:, 0] - centre - half, centre - half - rest[:, 1])
        gap = float(np.linalg.norm(np.maximum(0, apart), axis=1).min())
        if gap > size:
            yield Doubt(f"bodies.{name}", f"{gap:.3g} m from the nearest other body, the machine is about {size:.3g} m",
                        "check its centre and its unit", figure=gap / size)
        if sizes[k] > 8 * size:
            yield Doubt(f"bodies.{name}", f"{sizes[k]:.3g} m long, the machine is about {size:.3g} m",
                        "check its size and its unit (numbers without one are m)", figure=sizes[k] / size)
    for name, point in machine.description.points.items():
        if point.body == GROUND or point.body not in spans or point.interface is not None:
            continue
        centre, half = spans[point.body]
        frame = machine.body_frames[machine.link(point.body)]
        place = frame[:3, :3] @ np.array(point.at) + frame[:3, 3]
        away = float(np.linalg.norm(np.maximum(0.0, np.abs(place - centre) - half)))
        if away > OFF_THE_MACHINE * size:
            yield Doubt(f"points.{name}", f"{away:.3g} m off its body {point.body}, the machine is about {size:.3g} m",
                        "check the place and its unit (numbers without one are m)", figure=away / size)


def _parts(machine: Machine) -> Iterator[Doubt]:
    for name, joint in machine.description.joints.items():
        if joint.law is not None:
            links = [machine.link(body) for body in (joint.parent, joint.child) if body != GROUND]
            halves = [body_span(machine.description.bodies[machine.body_names[i]], machine.body_frames[i],
                                machine.bodies[i].mass)[1] for i in links]
            longest = 2 * float(np.max(halves))
            yield from _law(f"joints.{name}.law", joint.law, longest)


def _law(path: str, law: LawDescription, longest: float) -> Iterator[Doubt]:
    values = list[tuple[str, float | None]]()
    if (screw := law.ball_screw) is not None:
        values += [("ball_screw.nut", screw.nut), ("ball_screw.bearing", screw.bearing), ("ball_screw.bracket", screw.bracket)]
        if screw.diameter > min(THICKEST, SLENDER * screw.length) or screw.length > LONGEST:
            yield Doubt(f"{path}.ball_screw", f"{screw.diameter:.3g} m thick and {screw.length:.3g} m long, no ball screw of a "
                        "machine tool", "check the units of diameter and length (numbers without one are m)",
                        figure=screw.diameter)
        if screw.nut_at < screw.diameter / 2:
            yield Doubt(f"{path}.ball_screw.nut_at", f"{screw.nut_at:.3g} m from the thrust bearing beside a diameter of "
                        f"{screw.diameter:.3g} m: the nut is in the bearing", "check its unit (numbers without one are m)",
                        figure=screw.nut_at)
        if screw.lead is not None and screw.lead > 5 * screw.diameter:
            yield Doubt(f"{path}.ball_screw.lead", f"{screw.lead:.3g} m a turn beside a diameter of {screw.diameter:.3g} m",
                        "check its unit (numbers without one are m)", figure=screw.lead / screw.diameter)
    if (guide := law.guideway) is not None:
        values += [("guideway.radial", guide.radial), ("guideway.lateral", guide.lateral)]
        places = np.array(guide.at, float).reshape(-1, 3)
        middle = places.mean(axis=0)
        reach = float(np.linalg.norm(places - middle, axis=1).max())
        if len(places) > 1 and (away := float(np.linalg.norm(middle))) > OFF_THE_JOINT * reach:
            yield Doubt(f"{path}.guideway.at", f"the carriages' middle is {away:.3g} m from their joint, they are {reach:.3g} "
                        "m about it", "give their places from the joint's place, not from the machine's origin",
                        figure=away / max(reach, 1e-9))
        if reach > 2 * longest:
            yield Doubt(f"{path}.guideway.at", f"carriages {reach:.3g} m from their middle on bodies of {longest:.3g} m",
                        "check the unit of their places (numbers without one are m)", figure=reach / longest)
    for key, value in values:
        if value is not None and not SOFTEST <= value <= STIFFEST:
            word = "softer" if value < SOFTEST else "stiffer"
            yield Doubt(f"{path}.{key}", f"{value:.3g} N/m, {word} than any of a catalogue",
                        "check its unit (N/um is 1e6 N/m)", figure=value)


def _angles(machine: Machine) -> Iterator[Doubt]:
    """Doubt angles between axes that follow each other, and turns of joints, that are quarter turns in the other unit."""
    for name, joint in machine.description.joints.items():
        turns = [float(np.linalg.norm(joint.frame.rotation)), *(abs(float(v)) for v in joint.frame.rotation)]
        if (turn := next((t for t in turns if angle_slip(t)), None)) is not None:
            yield Doubt(f"joints.{name}.rotation", f"{turn:.5g} rad, {angle_slip(turn)}", "check the unit of its angles",
                        figure=turn)
    before: tuple[str, FloatArray] | None = None
    for i, name in enumerate(machine.joint_names):
        ways = [drive.direction.lstrip("-") for axis in machine.description.axes.values() for drive in axis.moved
                if drive.joint == name and "r" in drive.direction]
        if not ways:
            continue
        frame = machine.chain.frames[i]
        across = frame[:3, :3][:, "xyz".index(ways[0][-1])]
        if machine.chain.parents[i] >= 0 and before is not None:
            cosine = np.clip(float(across @ before[1]), -1, 1)
            angle = float(np.arctan2(np.linalg.norm(np.cross(across, before[1])), cosine))
            if (words := angle_slip(angle)):
                yield Doubt(f"joints.{name}", f"its axis is {np.degrees(angle):.5g} degrees from that of {before[0]}, {words}",
                            "check the unit of the angles (alpha, theta)", figure=angle)
        before = (name, across)


def angle_slip(angle: float) -> str:
    """Return what an angle (rad, >= 0) would be in the other unit where that is a quarter or half turn, else an empty text."""
    for quarter in (90, 180):
        if abs(angle - np.radians(np.radians(quarter))) < ALIKE:
            return f"which is {quarter} degrees in rad, read as degrees"
        folded = abs((quarter + np.pi) % (2 * np.pi) - np.pi)
        if abs(angle - quarter) < ALIKE or abs(angle - folded) < ALIKE:
            return f"which is {quarter} read as rad"
    return ""
