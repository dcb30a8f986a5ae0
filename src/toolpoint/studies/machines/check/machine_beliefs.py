"""Doubts that a unit gives away: masses that no material has in their size, springs of no machine, levers of no joint.

Nothing here is refused: a doubt names the number, what it would mean, and the likely slip.
"""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine, assemble
from toolpoint.machine.description import BodyDescription
from toolpoint.machine.description.extent import equal_box, shape_size
from toolpoint.studies.machines.pose_words import direction_words
from toolpoint.vibration import eigen

DENSEST, LIGHTEST = 2e4, 20.0  # kg/m^3 of a body's whole box: above tungsten, below hollow sheet metal
STEEL = 9e3  # kg/m^3 of a body's drawn shape: above steel and bronze
STIFFEST, SOFTEST = 1e12, 1e4  # N/m of a joint of a machine tool
LONGEST_LEVER, SHORTEST_LEVER = 30.0, 1e-3  # m, root of turning over translational stiffness
SLOWEST, FASTEST = 2.0, 5e3  # Hz of the first elastic mode
FURTHEST, SHORTEST = 50.0, 2e-3  # m of travel
LEAST_SHARE = 0.02  # of the longest travel of the machine
LEAST_GRAVITY, MOST_GRAVITY = 9.7, 9.9  # m/s^2, equator at height to pole
MOST_TURNS, LEAST_TURN = 20, 5.0  # full turns, degrees of a rotary axis


def question_units(machine: Machine) -> list[Doubt]:
    """Return doubts about masses against sizes, stiffness, travel, gravity and the lowest natural frequency."""
    return [*_densities(machine), *_springs(machine), *_travels(machine), *_gravity(machine), *_frequencies(machine)]


def _densities(machine: Machine) -> list[Doubt]:
    lines: list[Doubt] = []
    for name, body in zip(machine.body_names, machine.bodies, strict=True):
        described, mass = machine.description.bodies[name], float(body.mass[0, 0])
        if described.is_elastic or described.mesh is not None or described.density is not None or mass < 1e-6:
            continue
        size = _size(described, body.mass)
        density = mass / float(np.prod(size))
        words = f"{mass:.4g} kg in {' x '.join(f'{v:.3g}' for v in size)} m is {density:.3g} kg/m^3, "
        if density > DENSEST:
            lines.append(Doubt(f"bodies.{name}", f"{words}more than any metal", "check the units of mass, of size "
                               "(numbers without a unit are m) and of inertia", figure=density))
        elif (filled := _filled(described, density)) > STEEL:
            lines.append(Doubt(f"bodies.{name}", f"{mass:.4g} kg in its shape is {filled:.4g} kg/m^3, more than solid steel",
                               "check the units of mass (lb as kg?) and of size", figure=filled))
        elif density < LIGHTEST and max(size) > 0.05:
            lines.append(Doubt(f"bodies.{name}", f"{words}less than a hollow box of sheet", "check the units of mass (t "
                               "as kg?), of size and of inertia", figure=density))
    return lines


def _filled(body: BodyDescription, density: float) -> float:
    """Return the density of a body's own shape from that of the box around it, kg/m^3; 0 without a shape."""
    if body.shape is None or body.inertia is not None:
        return 0.0
    return density * (4 / np.pi if body.shape.kind == "cylinder" else 1.0)


def _size(body: BodyDescription, mass: np.ndarray) -> np.ndarray:
    """Size of the box that the body's mass is in: its own shape, else the uniform box with its moments of inertia."""
    return equal_box(mass) if body.shape is None or body.inertia is not None else shape_size(body.shape)


def _springs(machine: Machine) -> list[Doubt]:
    lines = list[Doubt]()
    for name, joint in machine.description.joints.items():
        along = {way: value for way, value in joint.stiffness.items() if "r" not in way}
        about = {way: value for way, value in joint.stiffness.items() if "r" in way}
        lines += [Doubt(f"joints.{name}.stiffness.{way}", f"{value:.3g} N/m, {word}", "check its unit (N/µm is 1e6 N/m)",
                        figure=value)
                  for way, value in along.items()
                  for word in ("stiffer than any joint of a machine tool",) * (value > STIFFEST)
                  + ("softer than a mounting of rubber",) * (value < SOFTEST)]
        if along and about:
            most = max(along.values())
            levers = {way: float(np.sqrt(value / most)) for way, value in about.items()}
            lines += [Doubt(f"joints.{name}.stiffness.{way}", f"{about[way]:.3g} N m/rad beside {most:.3g} N/m is a lever "
                            f"of {lever:.2g} m", "check its unit (GN*mm/rad is 1e6 N*m/rad, N*m/deg is 57.3)", figure=lever)
                      for way, lever in levers.items() if not SHORTEST_LEVER < lever < LONGEST_LEVER]
    return lines


def _travels(machine: Machine) -> list[Doubt]:
    spans = {axis: axis.upper - axis.lower for axis in machine.chain.axes if np.isfinite([axis.lower, axis.upper]).all()}
    longest = max((span for axis, span in spans.items() if not axis.is_rotary), default=0.0)
    lines = list[Doubt]()
    for axis, span in spans.items():
        if axis.is_rotary:
            odd = not np.radians(LEAST_TURN) <= span <= MOST_TURNS * 2 * np.pi
            words = f"{np.degrees(span):.4g} degrees"
        else:
            odd, words = not max(SHORTEST, LEAST_SHARE * longest) <= span <= FURTHEST, f"{span:.4g} m"
        if odd:
            lines.append(Doubt(f"axes.{axis.name}", f"travels {words}", "check the unit of its limits", figure=span))
    return lines


def _gravity(machine: Machine) -> list[Doubt]:
    gravity, up = machine.description.gravity, np.asarray(machine.description.up)
    if gravity is None or not np.any(gravity):
        return []
    size = float(np.linalg.norm(gravity))
    lines = [Doubt("gravity", f"{size:.4g} m/s^2, {LEAST_GRAVITY:g} to {MOST_GRAVITY:g} is that of the earth", "check its unit",
                   figure=size)] if not LEAST_GRAVITY <= size <= MOST_GRAVITY else []
    if float(up @ gravity) > 0.1 * size:
        lines.append(Doubt("gravity", f"acts along {direction_words(np.asarray(gravity) / size)}, and up is "
                           f"{direction_words(up)}", "turn the sign of its numbers, or write its size alone", figure=size))
    return lines


def _frequencies(machine: Machine) -> list[Doubt]:
    try:
        frequency = np.asarray(eigen.solve_undamped(assemble(machine), None).frequency)
    except ValueError:  # a machine that cannot be solved here says so where it is asked
        return []
    elastic = frequency[frequency > 1e-3]
    if not elastic.size or SLOWEST <= elastic[0] <= FASTEST:
        return []
    like = "that of a tower" if elastic[0] < SLOWEST else "too high"
    return [Doubt("lowest natural frequency", f"{elastic[0]:.3g} Hz, {like} for a machine tool",
                  "check the units of mass and stiffness", figure=float(elastic[0]))]
