"""Doubts about units: masses that no material has in their size, springs of no machine, levers of no joint.

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

MAX_BOX_DENSITY, MIN_BOX_DENSITY = 2e4, 20.0  # kg/m^3 of a body's whole box: above tungsten, below hollow sheet metal
MAX_SHAPE_DENSITY = 9e3  # kg/m^3 of a body's drawn shape: above steel and bronze
MAX_JOINT_STIFFNESS, MIN_JOINT_STIFFNESS = 1e12, 1e4  # N/m of a joint of a machine tool
MAX_LEVER, MIN_LEVER = 30.0, 1e-3  # m, root of turning over translational stiffness
MIN_FIRST_FREQUENCY, MAX_FIRST_FREQUENCY = 2.0, 5e3  # Hz of the first elastic mode
MAX_TRAVEL, MIN_TRAVEL = 50.0, 2e-3  # m of travel
MIN_TRAVEL_FRACTION = 0.02  # of the longest travel of the machine
MIN_GRAVITY, MAX_GRAVITY = 9.7, 9.9  # m/s^2, equator at height to pole
MAX_ROTARY_TURNS, MIN_ROTARY_TRAVEL = 20, 5.0  # full turns, degrees of a rotary axis


def question_units(machine: Machine) -> list[Doubt]:
    """Return doubts about masses against sizes, stiffness, travel, gravity and the lowest natural frequency."""
    return [*_question_densities(machine), *_question_joint_springs(machine), *_question_travels(machine),
            *_question_gravity(machine), *_question_first_frequency(machine)]


def _question_densities(machine: Machine) -> list[Doubt]:
    lines: list[Doubt] = []
    for name, body in zip(machine.body_names, machine.bodies, strict=True):
        described, mass = machine.description.bodies[name], float(body.mass[0, 0])
        if described.is_elastic or described.mesh is not None or described.density is not None or mass < 1e-6:
            continue
        size = _box_size(described, body.mass)
        density = mass / float(np.prod(size))
        words = f"{mass:.4g} kg in {' x '.join(f'{v:.3g}' for v in size)} m is {density:.3g} kg/m^3, "
        if density > MAX_BOX_DENSITY:
            lines.append(Doubt(f"bodies.{name}", f"{words}more than any metal", "check the units of mass, of size "
                               "(numbers without a unit are m) and of inertia", figure=density))
        elif (shape_density := _shape_density(described, density)) > MAX_SHAPE_DENSITY:
            lines.append(Doubt(f"bodies.{name}",
                               f"{mass:.4g} kg in its shape is {shape_density:.4g} kg/m^3, more than solid steel",
                               "check the units of mass (lb as kg?) and of size", figure=shape_density))
        elif density < MIN_BOX_DENSITY and max(size) > 0.05:
            lines.append(Doubt(f"bodies.{name}", f"{words}less than a hollow box of sheet", "check the units of mass (t "
                               "as kg?), of size and of inertia", figure=density))
    return lines


def _shape_density(body: BodyDescription, density: float) -> float:
    """Return the density of a body's own shape from that of the box around it, kg/m^3; 0 without a shape."""
    if body.shape is None or body.inertia is not None:
        return 0.0
    return density * (4 / np.pi if body.shape.kind == "cylinder" else 1.0)


def _box_size(body: BodyDescription, mass: np.ndarray) -> np.ndarray:
    """Return the size of the box of a body's mass: its own shape, else the uniform box with its moments of inertia."""
    return equal_box(mass) if body.shape is None or body.inertia is not None else shape_size(body.shape)


def _question_joint_springs(machine: Machine) -> list[Doubt]:
    lines = list[Doubt]()
    for name, joint in machine.description.joints.items():
        along = {way: value for way, value in joint.stiffness.items() if "r" not in way}
        about = {way: value for way, value in joint.stiffness.items() if "r" in way}
        lines += [Doubt(f"joints.{name}.stiffness.{way}", f"{value:.3g} N/m, {word}", "check its unit (N/µm is 1e6 N/m)",
                        figure=value)
                  for way, value in along.items()
                  for word in ("stiffer than any joint of a machine tool",) * (value > MAX_JOINT_STIFFNESS)
                  + ("softer than a mounting of rubber",) * (value < MIN_JOINT_STIFFNESS)]
        if along and about:
            stiffness_max = max(along.values())
            levers = {way: float(np.sqrt(value / stiffness_max)) for way, value in about.items()}
            lines += [Doubt(f"joints.{name}.stiffness.{way}",
                            f"{about[way]:.3g} N m/rad beside {stiffness_max:.3g} N/m is a lever "
                            f"of {lever:.2g} m", "check its unit (GN*mm/rad is 1e6 N*m/rad, N*m/deg is 57.3)", figure=lever)
                      for way, lever in levers.items() if not MIN_LEVER < lever < MAX_LEVER]
    return lines


def _question_travels(machine: Machine) -> list[Doubt]:
    spans = {axis: axis.upper - axis.lower for axis in machine.chain.axes if np.isfinite([axis.lower, axis.upper]).all()}
    longest = max((span for axis, span in spans.items() if not axis.is_rotary), default=0.0)
    lines = list[Doubt]()
    for axis, span in spans.items():
        if axis.is_rotary:
            odd = not np.radians(MIN_ROTARY_TRAVEL) <= span <= MAX_ROTARY_TURNS * 2 * np.pi
            words = f"{np.degrees(span):.4g} degrees"
        else:
            odd, words = not max(MIN_TRAVEL, MIN_TRAVEL_FRACTION * longest) <= span <= MAX_TRAVEL, f"{span:.4g} m"
        if odd:
            lines.append(Doubt(f"axes.{axis.name}", f"travels {words}", "check the unit of its limits", figure=span))
    return lines


def _question_gravity(machine: Machine) -> list[Doubt]:
    gravity, up = machine.description.gravity, np.asarray(machine.description.up)
    if gravity is None or not np.any(gravity):
        return []
    size = float(np.linalg.norm(gravity))
    lines = [Doubt("gravity", f"{size:.4g} m/s^2, {MIN_GRAVITY:g} to {MAX_GRAVITY:g} is that of the earth", "check its unit",
                   figure=size)] if not MIN_GRAVITY <= size <= MAX_GRAVITY else []
    if float(up @ gravity) > 0.1 * size:
        lines.append(Doubt("gravity", f"acts along {direction_words(np.asarray(gravity) / size)}, and up is "
                           f"{direction_words(up)}", "turn the sign of its numbers, or write its size alone", figure=size))
    return lines


def _question_first_frequency(machine: Machine) -> list[Doubt]:
    try:
        frequency = np.asarray(eigen.solve_undamped(assemble(machine), None).frequency)
    except ValueError:  # a machine that cannot be solved here says so where it is solved
        return []
    elastic = frequency[frequency > 1e-3]
    if not elastic.size or MIN_FIRST_FREQUENCY <= elastic[0] <= MAX_FIRST_FREQUENCY:
        return []
    like = "that of a tower" if elastic[0] < MIN_FIRST_FREQUENCY else "too high"
    return [Doubt("lowest natural frequency", f"{elastic[0]:.3g} Hz, {like} for a machine tool",
                  "check the units of mass and stiffness", figure=float(elastic[0]))]
