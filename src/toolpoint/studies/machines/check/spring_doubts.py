"""Doubts about springs and dampers that only their neighbours give away: directions of one joint, joints with each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine

FROM_DIRECTIONS = 50.0  # times softer or stiffer than the other directions of a joint
FROM_JOINTS = {"x": 30.0, "rx": 100.0}  # times below the softest or above the stiffest of all other joints, along and about
FROM_DAMPERS = 100.0  # times outside those of other joints, damper over spring
SOFT, SLOW = 3e6, 6.0  # N/m; Hz of what stands on a spring, were it alone
LOST = 2.0  # damper's force over the spring's at the frequency of what it holds
WAYS_ALONG, WAYS_ABOUT = ("x", "y", "z"), ("rx", "ry", "rz")
KINDS = ((WAYS_ALONG, "N/m"), (WAYS_ABOUT, "N m/rad"))


def question_springs(machine: Machine) -> list[Doubt]:
    """Return doubts about stiffness and damping far from those beside them; the odd one of two is that farther from all."""
    joints = machine.description.joints
    lines = list[Doubt]()
    for ways, unit in KINDS:
        stiffness = {name: _of(joint.stiffness, ways) for name, joint in joints.items()}
        damping = {name: _of(joint.damping, ways) for name, joint in joints.items()}
        lines += _far("stiffness", stiffness, unit, FROM_JOINTS[ways[0]])
        shares = {name: {way: value / stiffness[name][way] for way, value in row.items() if way in stiffness[name]}
                  for name, row in damping.items()}
        lines += _far("damping", shares, "s of damping over stiffness", FROM_DAMPERS)
        lines += _overdamped(stiffness, damping)
    named = {line.what for line in lines}
    return [*lines, *(line for line in _soft(machine) if line.what not in named), *_shares(machine)]


def _of(values: Mapping[str, float], ways: tuple[str, ...]) -> dict[str, float]:
    return {way: float(value) for way, value in values.items() if way in ways and value > 0}


def _far(kind: str, values: Mapping[str, Mapping[str, float]], unit: str, far: float) -> Iterator[Doubt]:
    """Doubt values far from the other directions of their joint, or outside the range of all other joints."""
    for name, here in values.items():
        others = [value for other, row in values.items() if other != name for value in row.values()]
        doubted = set[str]()
        if len(others) > 1:
            low, high = min(others), max(others)
            for way, value in here.items():
                away = max(low / value, value / high)
                if away > far:
                    doubted.add(way)
                    word = "below the least" if value < low else "above the largest"
                    yield Doubt(f"joints.{name}.{kind}.{way}", f"{value:.3g} {unit}, {away:.2g} times {word} of the other "
                                f"joints ({low if value < low else high:.3g})", "check its unit", figure=away)
        if not doubted and len(here) > 1:
            yield from _odd_direction(f"joints.{name}.{kind}", here, others, unit)


def _odd_direction(path: str, here: Mapping[str, float], others: list[float], unit: str) -> Iterator[Doubt]:
    low, high = min(here, key=here.__getitem__), max(here, key=here.__getitem__)
    ratio = here[high] / here[low]
    if ratio < FROM_DIRECTIONS:
        return
    middle = float(np.median(np.log([*others, *here.values()])))
    odd = max((low, high), key=lambda way: abs(np.log(here[way]) - middle))
    beside = high if odd == low else low
    yield Doubt(f"{path}.{odd}", f"{here[odd]:.3g} {unit} beside {here[beside]:.3g} along {beside} of the same joint, "
                f"{ratio:.2g} times apart", "check the unit of both", figure=ratio)


def _overdamped(stiffness: Mapping[str, Mapping[str, float]], damping: Mapping[str, Mapping[str, float]]) -> Iterator[Doubt]:
    """Doubt dampers that outweigh their springs at a frequency where machines of this kind have modes (10 Hz)."""
    for name, row in damping.items():
        for way, value in row.items():
            spring = stiffness[name].get(way)
            if spring is not None and (share := 2 * np.pi * 10.0 * value / spring) > LOST:
                yield Doubt(f"joints.{name}.damping.{way}", f"{value:.3g} beside a stiffness of {spring:.3g}: at 10 Hz the "
                            f"damper takes {share:.2g} times the force of the spring", "check the units of both", figure=share)


def _soft(machine: Machine) -> Iterator[Doubt]:
    """Doubt springs on which what they hold would swing slower than any part of a machine tool."""
    carried = _carried(machine)
    for i, name in enumerate(machine.joint_names):
        joint = machine.description.joints[name]
        for way, value in _of(joint.stiffness, WAYS_ALONG).items():
            alone = float(np.sqrt(value / max(carried[i], 1e-9))) / (2 * np.pi)
            if value < SOFT and carried[i] > 1.0 and alone < SLOW:
                yield Doubt(f"joints.{name}.stiffness.{way}", f"{value:.3g} N/m under {carried[i]:.4g} kg is {alone:.2g} Hz",
                            "check its unit (N/um is 1e6 N/m)", figure=alone)


def _carried(machine: Machine) -> list[float]:
    """Mass that hangs on every tree joint, kg: its child and all that this carries."""
    masses = [float(body.mass[0, 0]) for body in machine.bodies]
    for i in reversed(range(len(masses))):
        if (parent := machine.chain.parents[i]) >= 0:
            masses[parent] += masses[i]
    return masses


def _shares(machine: Machine) -> Iterator[Doubt]:
    """Doubt damping ratios and loss factors that no machine has."""
    ratio = machine.description.damping_ratio
    if ratio is not None and not 5e-4 <= ratio <= 0.2:
        yield Doubt("damping_ratio", f"{100 * ratio:.3g} % for every mode, {'more' if ratio > 0.2 else 'less'} than machine "
                    "tools have (0.05-20 %)", "write it with its unit: 3 %", figure=ratio)
    for name, joint in machine.description.joints.items():
        factors = joint.loss_factor if isinstance(joint.loss_factor, Mapping) else {"": joint.loss_factor}
        for way, value in factors.items():
            if value > 0.7:
                yield Doubt(f"joints.{name}.loss_factor" + (f".{way}" if way else ""), f"{value:.3g}, more than rubber",
                            "a loss factor is twice the damping ratio, a share of 1", figure=float(value))
