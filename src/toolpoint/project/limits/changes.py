"""Changes of joints by what they do to the limits of the goals: gain with its interval over the draws, per cost.

Judged by the least limit over the speeds of the cut (single-frequency solution): the limit at one speed may rise or fall with a
change only because a lobe moves by.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointWarning, fail, suggestion
from toolpoint.cutting import ZeroOrder, stability
from toolpoint.machine import Machine
from toolpoint.machine.description import parameters
from toolpoint.project.limits.drawn_limits import CutQuestion
from toolpoint.project.limits.systems import MachineDraws, coefficient_factors, problem_of
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics
from toolpoint.studies.machines.tool_point import depth_limit

USUAL_STIFFENING = 0.1  # share by which every joint is stiffened where the project names no change
CHANGE_DRAWS = 12  # machines over which the gain of a change is taken
CHANGE_SPEEDS = 150  # over the range of the cut, close enough that no lobe falls between
CHANGE_DEPTH_RATIO = 3.0  # depth of the charts over the estimate of the lowest limit
_STIFFNESSES = ("stiffness", "stiffness_matrix")


@dataclass(frozen=True)
class RankedChange:
    """Change of a joint's springs by a share: gain of the least limit over the speeds of the cut (relative, worst goal), its
    interval over the draws, cost, and the gain per cost by which it is ranked."""

    name: str
    joint: str
    share: float
    gain: float
    interval: tuple[float, float]
    cost: float

    @property
    def worth(self) -> float:
        """Gain per cost."""
        return self.gain / max(self.cost, 1e-9)

    def words(self) -> str:
        """Return the change and its gain in words."""
        lower, upper = self.interval
        return (f"{self.name} (joint {self.joint}, springs {100 * self.share:+.3g} %): least limit {100 * self.gain:+.2g} %, "
                f"95 % {100 * lower:+.2g} .. {100 * upper:+.2g} %" + (", worse than today" if upper < 0 else ""))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"name": self.name, "joint": self.joint, "stiffness_share": self.share, "gain": self.gain,
                "gain_interval": list(self.interval), "cost": self.cost, "gain_per_cost": self.worth, "words": self.words()}


def lead_of(changes: Sequence[Mapping[str, Any]]) -> str:
    """Return which of ranked changes (`RankedChange.to_dict`) comes first, in words; none where no gain is sure."""
    if not changes:
        return "no joint can be changed"
    is_sure = changes[0]["gain_interval"][0] > 0
    return f"{'first' if is_sure else 'none of these is sure to raise the least limit; the best'}: {changes[0]['words']}"


def rank_joints(systems: MachineDraws, questions: Mapping[str, CutQuestion], changes: Mapping[str, Mapping[str, Any]]
                ) -> list[RankedChange]:
    """Return the changes by their gain per cost, best first; every joint by 10 % where none is named."""
    joints = systems.machine.description.joints
    elastic = [name for name in joints if _paths(systems.machine, name)]
    listed = changes or {f"stiffen {name}": {"joint": name, "stiffness": USUAL_STIFFENING, "cost": 1.0} for name in elastic}
    for name, change in listed.items():
        if change["joint"] not in elastic:
            fail(f"changes.{name}.joint", repr(change["joint"]), "must be a joint with springs",
                 remedy=suggestion(change["joint"], elastic) or f"known: {', '.join(elastic)}")
    samples = [systems.machine, *(systems.samples[:CHANGE_DRAWS] if systems.count else ())]
    today_limits = np.array([_least_limits(sample, questions, systems, number) for number, sample in enumerate(samples)])
    ranked = []
    for name, change in listed.items():
        changed = [_stiffen(sample, change["joint"], change["stiffness"]) for sample in samples]
        changed_limits = np.array([_least_limits(sample, questions, systems, number) for number, sample in enumerate(changed)])
        gains = (changed_limits / today_limits - 1).min(axis=1)
        half_width = 2.2 * float(gains[1:].std(ddof=1)) if len(samples) > 2 else 0.0
        gain = float(gains[0])
        ranked.append(RankedChange(name, change["joint"], change["stiffness"], gain, (gain - half_width, gain + half_width),
                                   change["cost"]))
    return sorted(ranked, key=lambda change: -change.worth)


def _paths(machine: Machine, joint: str) -> list[str]:
    """Return the paths of a joint's springs."""
    return [path for path in parameters(machine.description)
            if path.split(".")[:2] == ["joints", joint] and path.split(".")[2] in _STIFFNESSES]


def _stiffen(machine: Machine, joint: str, share: float) -> Machine:
    """Return the machine with all springs of a joint stiffer by a share."""
    return machine.with_values({path: (1 + share) * machine.value(path) for path in _paths(machine, joint)})


def _least_limits(machine: Machine, questions: Mapping[str, CutQuestion], systems: MachineDraws, number: int) -> FloatArray:
    """Return the least limit over the speeds of every goal's cut, m; draw 0 is the likeliest machine."""
    limits = []
    for question in questions.values():
        drawn = replace(question, speeds=tuple(np.linspace(*question.cut.speeds, CHANGE_SPEEDS)))
        factors = None if number == 0 else coefficient_factors(drawn.name, drawn.deviation, systems)[number - 1]
        problem = problem_of(machine_dynamics(machine, drawn.pose), drawn.cut, factors)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ToolpointWarning)  # of the single-frequency solution: ratios are compared
            chart = stability.chart(problem, np.asarray(drawn.speeds), ZeroOrder(),
                                    depth_max=CHANGE_DEPTH_RATIO * depth_limit(problem))
        limits.append(float(np.minimum(chart.limit, chart.depth_max).min()))
    return np.array(limits)
