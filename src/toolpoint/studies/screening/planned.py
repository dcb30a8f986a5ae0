"""Screening by a plan of a machine file: design, metrics and path from plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import fail, one_of
from toolpoint._doubt import with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine.description.screening_plan import MilledSquare, ScreeningPlan
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.accuracy.accuracy_metric import AccuracyMetric
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup
from toolpoint.studies.accuracy.moving_structure import ToolStance
from toolpoint.studies.accuracy.tool_paths import square
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.screening import designs
from toolpoint.studies.screening.answers import Answer, DepthLimit, PeriodicError, ResponsePeak
from toolpoint.studies.screening.designs import ScreeningDesign
from toolpoint.studies.screening.effects import Ranking, rank_changes
from toolpoint.studies.screening.improve import Improvement, improve
from toolpoint.studies.screening.metrics import NamedMetrics
from toolpoint.studies.screening.screen import Screening, screen

_MAX_RANKED_METRICS = 2  # metrics whose ranking is printed
ANSWERS = ("response peak", "static compliance", "depth limit", "position error")


@dataclass(frozen=True)
class JoinedMetrics:
    """Named metrics and the accuracy of milling a path, as one."""

    named: NamedMetrics | None
    accuracy: AccuracyMetric | None

    @property
    def identity(self) -> str:
        """Key of these metrics among others."""
        return repr((self.named, None if self.accuracy is None else self.accuracy.identity))

    @property
    def loads(self) -> str:
        """Loads for which the metrics hold, in words."""
        words = [] if self.named is None else ["named metrics: no load but the cut's own"]
        return "; ".join([*words, *([] if self.accuracy is None else ["errors: " + self.accuracy.loads])])

    def on_branch(self, branch: str) -> JoinedMetrics:
        """Return the metrics with the arm on another branch."""
        return JoinedMetrics(self.named, None if self.accuracy is None else self.accuracy.on_branch(branch))

    def kept_in(self, folder: Path) -> JoinedMetrics:
        """Return the metrics with the blocks of runs along the path kept in a folder."""
        return JoinedMetrics(self.named, None if self.accuracy is None else self.accuracy.kept_in(folder))

    def __call__(self, machine: Machine) -> Mapping[str, float]:
        """Return all answers of a machine."""
        return {**({} if self.named is None else self.named(machine)),
                **({} if self.accuracy is None else self.accuracy(machine))}


@dataclass(frozen=True, eq=False)
class PlannedScreening(NotebookText):
    """Screening with the rankings of its first metrics; remarks : doubts about the milled cut."""

    plan: ScreeningPlan
    screening: Screening
    rankings: tuple[Ranking, ...]
    remarks: tuple[str, ...] = ()

    def table(self) -> str:
        """Return the screening and its rankings as text."""
        return "\n".join(with_notes([self.screening.table(), *(ranking.table() for ranking in self.rankings)], self.remarks))

    def to_dict(self) -> dict[str, Any]:
        """Return the screening and its rankings as plain data."""
        return {"screening": self.screening.to_dict(), "rankings": [ranking.to_dict() for ranking in self.rankings],
                "remarks": list(self.remarks)}


def accuracy_of(part: MilledSquare) -> AccuracyMetric:
    """Return the accuracy of milling a square as a metric."""
    sides = square(part.side, centre=part.centre, first=part.first, second=part.second, feed=part.feed, law=part.law)
    # Not halved: a screening compares variants, whose errors of step and spacing are alike.
    setup = MillingSetup(part.speed, part.depth, tuple(part.loads), part.regenerative, part.spacing, part.steps,
                         window=part.window, halved=False, stance=ToolStance(branch=part.branch))
    return AccuracyMetric(tuple(sides[number - 1] for number in part.sides), setup)


def design_of(plan: ScreeningPlan) -> ScreeningDesign:
    """Return the design of a plan; samples with its seed."""
    rng = np.random.default_rng(plan.seed)
    if plan.design == "one at a time":
        return designs.one_at_a_time(plan.changes)
    if plan.design == "full factorial":
        return designs.full_factorial(plan.changes, plan.levels)
    if plan.design == "fractional factorial":
        return designs.fractional_factorial(plan.changes)
    sample = {"latin hypercube": designs.latin_hypercube, "sobol sequence": designs.sobol_sequence,
              "sobol indices": designs.sobol_pairs}[plan.design]
    return sample(plan.changes, plan.points, rng)


def run_plan(plan: ScreeningPlan, machine: Machine, *, engine: Engine | None = None, folder: str | Path | None = None,
             progress: Progress | None = None) -> PlannedScreening:
    """Return the screening of a plan on its machine, with rankings; arguments as for `screen`.

    Examples
    --------
    Runs in ``examples/screen_a_plan_of_changes.py``.
    """
    metric = JoinedMetrics(NamedMetrics(plan.metrics, (dict(plan.pose),)) if plan.metrics else None,
                           None if plan.square is None else accuracy_of(plan.square))
    result = screen(machine, design_of(plan), metric, doubts=plan.doubts, draws=plan.draws,
                    # Another seed than the design's, whose points the draws would repeat.
                    rng=np.random.default_rng(plan.seed + 1) if plan.draws else None, engine=engine, folder=folder,
                    progress=progress)
    remarks = () if metric.accuracy is None else metric.accuracy.judge(machine)
    return PlannedScreening(plan, result, tuple(rank_changes(result, name) for name in result.metrics[:_MAX_RANKED_METRICS]),
                            remarks)


def improve_by_plan(plan: ScreeningPlan, machine: Machine, answer: str, *, goal: float) -> Improvement:
    """Return the cheapest changes, of the factors of a plan, that bring an answer at the plan's pose to a goal.

    Parameters
    ----------
    plan : ScreeningPlan
        Of factors alone: swaps have no slope.
    machine : Machine
        The one that the plan names; with a cut for a depth limit or a position error.
    answer : str
        One of `ANSWERS`; ``position error`` takes speed and depth of the plan's square.
    goal : float
        m/N, for a depth limit or a position error m.

    Raises
    ------
    ToolpointError
        For a plan with swaps, and an answer for which plan or machine say too little.

    Examples
    --------
    Runs in ``examples/screen_a_plan_of_changes.py``.
    """
    if plan.swaps:
        fail("improve", "the plan holds swaps, which have no slope", "give factors, or screen them")
    return improve(machine, plan.factors, _answer_of(plan, machine, answer), goal=goal, poses=(dict(plan.pose),),
                   doubts=plan.doubts, draws=plan.draws, rng=np.random.default_rng(plan.seed))


def _answer_of(plan: ScreeningPlan, machine: Machine, answer: str) -> Answer:
    # The first two need no cut.
    if one_of("`answer`", answer, ANSWERS) in ANSWERS[:2]:
        return ResponsePeak(static=answer == "static compliance")
    cut = machine.description.cutting
    if cut is None:
        fail("`answer`", answer, "the machine file has no 'cutting'")
    if answer == "depth limit":
        return DepthLimit(cut)
    if plan.square is None:
        fail("`answer`", answer, "the plan needs a square, for its speed and depth")
    return PeriodicError(cut, plan.square.speed, plan.square.depth)
