"""Doubts about springs and dampers that only their neighbours reveal: directions of one joint, joints with each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine

MAX_DIRECTION_RATIO = 50.0  # stiffness of a direction beside the other directions of a joint
# stiffness below the smallest or above the largest of all other joints, along and about
MAX_JOINT_RATIOS = {"x": 30.0, "rx": 100.0}
MAX_DAMPER_TIME_RATIO = 100.0  # damping over stiffness, outside the values of other joints
MIN_DAMPER_TIME = 1e-7  # s, damping over stiffness, a loss factor of 6e-4 at 1 kHz: what a fit leaves of a damper that is none
MIN_SPRING_STIFFNESS, MIN_CARRIED_FREQUENCY = 3e6, 6.0  # N/m; Hz of the carried mass on its spring alone
MAX_DAMPER_TO_SPRING_FORCE = 2.0  # at 10 Hz
WAYS_ALONG, WAYS_ABOUT = ("x", "y", "z"), ("rx", "ry", "rz")
KINDS = ((WAYS_ALONG, "N/m"), (WAYS_ABOUT, "N m/rad"))


def question_springs(machine: Machine) -> list[Doubt]:
    """Return doubts about stiffness and damping far from their neighbours.

    Of two values, the one farther from all others is doubted.
    """
    joints = machine.description.joints
    lines = list[Doubt]()
    for ways, unit in KINDS:
        stiffness = {name: _positive_values(joint.stiffness, ways) for name, joint in joints.items()}
        damping = {name: _positive_values(joint.damping, ways) for name, joint in joints.items()}
        lines += _question_kind("stiffness", stiffness, unit, MAX_JOINT_RATIOS[ways[0]])
        shares = {name: {way: share for way, value in row.items()
                         if way in stiffness[name] and (share := value / stiffness[name][way]) >= MIN_DAMPER_TIME}
                  for name, row in damping.items()}
        lines += _question_kind("damping", shares, "s of damping over stiffness", MAX_DAMPER_TIME_RATIO)
        lines += _question_dampers(stiffness, damping)
    named = {line.what for line in lines}
    return [*lines, *(line for line in _question_soft_springs(machine) if line.what not in named), *_question_ratios(machine)]


def _positive_values(values: Mapping[str, float], ways: tuple[str, ...]) -> dict[str, float]:
    return {way: float(value) for way, value in values.items() if way in ways and value > 0}


def _question_kind(kind: str, values: Mapping[str, Mapping[str, float]], unit: str, max_factor: float) -> Iterator[Doubt]:
    """Doubt values far from the other directions of their joint, or outside the range of all other joints."""
    for name, joint_values in values.items():
        others = [value for other, row in values.items() if other != name for value in row.values()]
        doubted = set[str]()
        if len(others) > 1:
            value_min, value_max = min(others), max(others)
            for way, value in joint_values.items():
                factor = max(value_min / value, value / value_max)
                if factor > max_factor:
                    doubted.add(way)
                    word = "below the least" if value < value_min else "above the largest"
                    yield Doubt(f"joints.{name}.{kind}.{way}", f"{value:.3g} {unit}, {factor:.2g} times {word} of the other "
                                f"joints ({value_min if value < value_min else value_max:.3g})", "check its unit",
                                figure=factor)
        if not doubted and len(joint_values) > 1:
            yield from _question_direction(f"joints.{name}.{kind}", joint_values, others, unit)


def _question_direction(path: str, joint_values: Mapping[str, float], others: list[float], unit: str) -> Iterator[Doubt]:
    softest_way, stiffest_way = min(joint_values, key=joint_values.__getitem__), max(joint_values, key=joint_values.__getitem__)
    ratio = joint_values[stiffest_way] / joint_values[softest_way]
    if ratio < MAX_DIRECTION_RATIO:
        return
    middle = float(np.median(np.log([*others, *joint_values.values()])))
    odd = max((softest_way, stiffest_way), key=lambda way: abs(np.log(joint_values[way]) - middle))
    other_way = stiffest_way if odd == softest_way else softest_way
    yield Doubt(f"{path}.{odd}",
                f"{joint_values[odd]:.3g} {unit} beside {joint_values[other_way]:.3g} along {other_way} of the same joint, "
                f"{ratio:.2g} times apart", "check the unit of both", figure=ratio)


def _question_dampers(stiffness: Mapping[str, Mapping[str, float]],
                      damping: Mapping[str, Mapping[str, float]]) -> Iterator[Doubt]:
    """Doubt dampers that outweigh their springs at a frequency where machines of this kind have modes (10 Hz)."""
    for name, row in damping.items():
        for way, value in row.items():
            spring = stiffness[name].get(way)
            # At 10 Hz, below the modes of machines: there a joint is a spring, and a damper that pushes harder has another
            # unit.
            if spring is not None and (share := 2 * np.pi * 10.0 * value / spring) > MAX_DAMPER_TO_SPRING_FORCE:
                yield Doubt(f"joints.{name}.damping.{way}", f"{value:.3g} beside a stiffness of {spring:.3g}: at 10 Hz the "
                            f"damper takes {share:.2g} times the force of the spring", "check the units of both", figure=share)


def _question_soft_springs(machine: Machine) -> Iterator[Doubt]:
    """Doubt springs on which what they hold would swing slower than any part of a machine tool."""
    carried = _carried_masses(machine)
    for i, name in enumerate(machine.joint_names):
        joint = machine.description.joints[name]
        for way, value in _positive_values(joint.stiffness, WAYS_ALONG).items():
            carried_frequency = float(np.sqrt(value / max(carried[i], 1e-9))) / (2 * np.pi)
            if value < MIN_SPRING_STIFFNESS and carried[i] > 1.0 and carried_frequency < MIN_CARRIED_FREQUENCY:
                yield Doubt(f"joints.{name}.stiffness.{way}",
                            f"{value:.3g} N/m under {carried[i]:.4g} kg is {carried_frequency:.2g} Hz",
                            "check its unit (N/um is 1e6 N/m)", figure=carried_frequency)


def _carried_masses(machine: Machine) -> list[float]:
    """Return the mass on every tree joint, kg: its child and all that the child carries."""
    masses = [float(body.mass[0, 0]) for body in machine.bodies]
    for i in reversed(range(len(masses))):
        if (parent := machine.chain.parents[i]) >= 0:
            masses[parent] += masses[i]
    return masses


def _question_ratios(machine: Machine) -> Iterator[Doubt]:
    """Doubt damping ratios and loss factors that no machine has."""
    ratio = machine.description.damping_ratio
    # Machines are measured at half a per cent to ten: less is a part alone, more is a percentage written as a ratio.
    if ratio is not None and not 5e-4 <= ratio <= 0.2:
        yield Doubt("damping_ratio", f"{100 * ratio:.3g} % for every mode, {'more' if ratio > 0.2 else 'less'} than machine "
                    "tools have (0.05-20 %)", "write it with its unit: 3 %", figure=ratio)
    for name, joint in machine.description.joints.items():
        factors = joint.loss_factor if isinstance(joint.loss_factor, Mapping) else {"": joint.loss_factor}
        for way, value in factors.items():
            if value > 0.7:
                yield Doubt(f"joints.{name}.loss_factor" + (f".{way}" if way else ""), f"{value:.3g}, more than rubber",
                            "a loss factor is twice the damping ratio, a share of 1", figure=float(value))
