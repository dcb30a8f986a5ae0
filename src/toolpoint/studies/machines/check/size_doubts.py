"""Doubts about places and sizes: points off the machine, odd screws, carriages in machine coordinates, angles in degrees."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joints.law import LawDescription
from toolpoint.machine import Machine
from toolpoint.machine.description import GROUND
from toolpoint.machine.description.extent import body_span

# kg/m^3 of a shape of one density: hollow castings of robots have some hundreds
MIN_SHAPE_DENSITY, MAX_UNIFORM_DENSITY = 100.0, 2.3e4
MAX_SCREW_DIAMETER, MAX_SCREW_LENGTH = 0.2, 15.0  # m, of a ball screw
MAX_SCREW_DIAMETER_RATIO = 0.34  # diameter of a screw over its length
MIN_CATALOGUE_STIFFNESS, MAX_CATALOGUE_STIFFNESS = 1e7, 1e11  # N/m of a carriage, nut or bearing of a catalogue
MAX_POINT_DISTANCE_RATIO = 1.0  # distance of a point from its own body over the machine's size
MAX_CARRIAGE_OFFSET_RATIO = 2.0  # distance of the carriages' middle from the joint over that of the outer carriages from it
ANGLE_SLIP_TOLERANCE = 1e-4  # rad, between an angle and what a quarter turn reads as in the other unit


def question_sizes(machine: Machine) -> list[Doubt]:
    """Return doubts about densities, points and bodies off the machine, catalogue parts, and angles in the other unit."""
    return [*_question_densities(machine), *_question_places(machine), *_question_parts(machine), *_question_angles(machine)]


def _question_densities(machine: Machine) -> Iterator[Doubt]:
    for name, body in machine.description.bodies.items():
        if body.density is not None and not MIN_SHAPE_DENSITY <= body.density <= MAX_UNIFORM_DENSITY:
            word = "lighter than foam" if body.density < MIN_SHAPE_DENSITY else "denser than any metal"
            yield Doubt(f"bodies.{name}.density", f"{body.density:.4g} kg/m^3, {word}",
                        "check its unit (a number without one is in kg/m^3; iron has 7200, written 7.2 g/cm^3)",
                        figure=body.density)


def _question_places(machine: Machine) -> Iterator[Doubt]:
    """Doubt points far off their body, bodies far off all others, and bodies larger than the others together."""
    spans = {name: body_span(machine.description.bodies[name], machine.body_frames[i], machine.bodies[i].mass)
             for i, name in enumerate(machine.body_names) if machine.bodies[i].mass[0, 0] > 0}
    if len(spans) < 2:
        return
    corners = np.array([[centre - half, centre + half] for centre, half in spans.values()])
    sizes = np.array([float(2 * half.max()) for _, half in spans.values()])
    # The size of the machine by the middle half of its bodies: one body in a wrong place must not widen it.
    lower_corner, upper_corner = np.quantile(corners[:, 0], 0.25, axis=0), np.quantile(corners[:, 1], 0.75, axis=0)
    size = max(float(np.max(upper_corner - lower_corner)), float(np.median(sizes)))
    for k, (name, (centre, half)) in enumerate(spans.items()):
        other_corners = np.delete(corners, k, axis=0)
        gaps = np.maximum(other_corners[:, 0] - centre - half, centre - half - other_corners[:, 1])
        gap = float(np.linalg.norm(np.maximum(0, gaps), axis=1).min())
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
        distance = float(np.linalg.norm(np.maximum(0.0, np.abs(place - centre) - half)))
        if distance > MAX_POINT_DISTANCE_RATIO * size:
            yield Doubt(f"points.{name}", f"{distance:.3g} m off its body {point.body}, the machine is about {size:.3g} m",
                        "check the place and its unit (numbers without one are m)", figure=distance / size)


def _question_parts(machine: Machine) -> Iterator[Doubt]:
    for name, joint in machine.description.joints.items():
        if joint.law is not None:
            links = [machine.link(body) for body in (joint.parent, joint.child) if body != GROUND]
            halves = [body_span(machine.description.bodies[machine.body_names[i]], machine.body_frames[i],
                                machine.bodies[i].mass)[1] for i in links]
            longest = 2 * float(np.max(halves))
            yield from _question_law(f"joints.{name}.law", joint.law, longest)


def _question_law(path: str, law: LawDescription, longest: float) -> Iterator[Doubt]:
    values = list[tuple[str, float | None]]()
    if (screw := law.ball_screw) is not None:
        values += [("ball_screw.nut", screw.nut), ("ball_screw.bearing", screw.bearing), ("ball_screw.bracket", screw.bracket)]
        if screw.diameter > min(MAX_SCREW_DIAMETER, MAX_SCREW_DIAMETER_RATIO * screw.length) or screw.length > MAX_SCREW_LENGTH:
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
        if len(places) > 1 and (offset := float(np.linalg.norm(middle))) > MAX_CARRIAGE_OFFSET_RATIO * reach:
            yield Doubt(f"{path}.guideway.at",
                        f"the carriages' middle is {offset:.3g} m from their joint, they are {reach:.3g} "
                        "m about it", "give their places from the joint's place, not from the machine's origin",
                        figure=offset / max(reach, 1e-9))
        if reach > 2 * longest:
            yield Doubt(f"{path}.guideway.at", f"carriages {reach:.3g} m from their middle on bodies of {longest:.3g} m",
                        "check the unit of their places (numbers without one are m)", figure=reach / longest)
    for key, value in values:
        if value is not None and not MIN_CATALOGUE_STIFFNESS <= value <= MAX_CATALOGUE_STIFFNESS:
            word = "softer" if value < MIN_CATALOGUE_STIFFNESS else "stiffer"
            yield Doubt(f"{path}.{key}", f"{value:.3g} N/m, {word} than any of a catalogue",
                        "check its unit (N/um is 1e6 N/m)", figure=value)


def _question_angles(machine: Machine) -> Iterator[Doubt]:
    """Doubt angles between axes that follow each other, and turns of joints, that are quarter turns in the other unit."""
    for name, joint in machine.description.joints.items():
        turns = [float(np.linalg.norm(joint.frame.rotation)), *(abs(float(v)) for v in joint.frame.rotation)]
        if (turn := next((t for t in turns if angle_slip(t)), None)) is not None:
            yield Doubt(f"joints.{name}.rotation", f"{turn:.5g} rad, {angle_slip(turn)}", "check the unit of its angles",
                        figure=turn)
    previous: tuple[str, FloatArray] | None = None
    for i, name in enumerate(machine.joint_names):
        ways = [drive.direction.lstrip("-") for axis in machine.description.axes.values() for drive in axis.moved
                if drive.joint == name and "r" in drive.direction]
        if not ways:
            continue
        frame = machine.chain.frames[i]
        direction = frame[:3, :3][:, "xyz".index(ways[0][-1])]
        if machine.chain.parents[i] >= 0 and previous is not None:
            cosine = np.clip(float(direction @ previous[1]), -1, 1)
            angle = float(np.arctan2(np.linalg.norm(np.cross(direction, previous[1])), cosine))
            if (words := angle_slip(angle)):
                yield Doubt(f"joints.{name}",
                            f"its axis is {np.degrees(angle):.5g} degrees from that of {previous[0]}, {words}",
                            "check the unit of the angles (alpha, theta)", figure=angle)
        previous = (name, direction)


def angle_slip(angle: float) -> str:
    """Return what an angle (rad, >= 0) would be in the other unit where that is a quarter or half turn, else an empty text."""
    for quarter in (90, 180):
        if abs(angle - np.radians(np.radians(quarter))) < ANGLE_SLIP_TOLERANCE:
            return f"which is {quarter} degrees in rad, read as degrees"
        folded = abs((quarter + np.pi) % (2 * np.pi) - np.pi)
        if abs(angle - quarter) < ANGLE_SLIP_TOLERANCE or abs(angle - folded) < ANGLE_SLIP_TOLERANCE:
            return f"which is {quarter} read as rad"
    return ""
