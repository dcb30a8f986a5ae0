"""Advice on a cut with uncertain dynamics and coefficients: probability chart, best cut, next test cut."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning, fail
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint._rounding import probability_text, text_below
from toolpoint.cutting import MillingProblem, StabilityChart
from toolpoint.cutting.advice.best_speed import Advice, from_chart, from_chatter_frequency, from_cuts, most_informative
from toolpoint.cutting.advice.probability import (
    ProbabilityChart,
    Uncertain,
    coefficient_parameters,
    deviations_of,
    is_slow,
    modal_parameters,
    probability,
)
from toolpoint.cutting.cut.problem import MISSING_BAND_WORDS
from toolpoint.cutting.stability.drawn_response import response_alone
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.studies.cuts.tip_doubts import withheld_words
from toolpoint.studies.execute import Progress
from toolpoint.studies.remark_kinds import first_of_each_kind
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes

# depths and speeds of a chart; least probability of stability of a certain cut
PROBABILITY_DEPTHS, MAX_PROBABILITY_SPEEDS, CERTAIN_CUT_PROBABILITY = 60, 60, 0.95
MIN_OUTCOME_LIKELIHOOD = 0.03  # of a tried cut's outcome, below which it contradicts the model
MAX_USEFUL_LOBE = 10  # lobe number above which stable pockets are too narrow
CONTRADICTED = "a tried cut contradicts the model"


@dataclass(frozen=True)
class Uncertainty:
    """Uncertainty of a cut: samples, relative standard deviations (None: measured or usual), and cuts with known outcome.

    `cuts`: (rev/min, m, stable) of each.

    Examples
    --------
    >>> Uncertainty(samples=200, cuts=((4000.0, 1e-3, True),)).coefficients
    0.1
    """

    samples: int = 0
    frequency: float | None = None
    damping: float | None = None
    stiffness: float = 0.05
    coefficients: float = 0.1
    cuts: tuple[tuple[float, float, bool], ...] = ()
    seed: int = 0


def sample_charts(problem: MillingProblem, chart: StabilityChart, uncertainty: Uncertainty,
                   *, method: StabilityMethod | None = None, progress: Progress | None = None
                   ) -> tuple[ProbabilityChart, list[str]]:
    """Return the probability chart around a chart, after the tried cuts, and the assumptions."""
    parameters, notes = _parameters(problem, uncertainty)
    finite = chart.limit[np.isfinite(chart.limit)]
    # Room above the usual limit for the scatter of the samples, but no further than the chart, and beyond every tried cut.
    depth_max = 2.5 * float(np.median(finite)) if finite.size else chart.depth_max
    depth_max = max([min(depth_max, chart.depth_max), *(1.2 * depth for _, depth, _ in uncertainty.cuts)])
    # Every sample needs a chart of its own: fewer speeds than that of the cut itself.
    speed_indices = np.unique(np.linspace(0, chart.speeds.size - 1, min(chart.speeds.size, MAX_PROBABILITY_SPEEDS)).astype(int))
    _check_cuts(uncertainty.cuts, chart.speeds)
    draws = None if chart.limit_draws is None else chart.limit_draws[:, speed_indices]
    with _remarks_of_samples() as remarks:
        sampled = probability(response_alone(problem), parameters, chart.speeds[speed_indices],
                              depths=np.linspace(depth_max / PROBABILITY_DEPTHS, depth_max, PROBABILITY_DEPTHS),
                              rng=np.random.default_rng(uncertainty.seed), samples=uncertainty.samples, method=method,
                              limit_draws=draws, progress=progress)
    if is_slow(problem):
        notes.append("P(stable): all samples share the chart of the cut itself, moved as single-frequency limits are, "
                     "which is within about 5 % of a limit")
    return sampled, [*notes, *remarks, *contradictions(sampled, uncertainty.cuts)]


@contextmanager
def _remarks_of_samples() -> Iterator[list[str]]:
    """Collect the warnings of the charts of all samples: each kind once, with the range of its numbers."""
    lines: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ToolpointWarning)
        yield lines
    lines += first_of_each_kind(f"in the sampled charts: {w.message}" for w in caught
                                if issubclass(w.category, ToolpointWarning))
    for w in caught:
        # Warnings of other libraries go on their way.
        if not issubclass(w.category, ToolpointWarning):
            warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)


def contradictions(sampled: ProbabilityChart | None, cuts: Sequence[tuple[float, float, bool]]) -> tuple[str, ...]:
    """Return a line on every cut whose outcome the sampled charts hardly allow, alone or beside the other cuts."""
    if sampled is None:
        return ()
    return tuple(
        f"The cut at {speed:g} rev/min and {1e3 * depth:g} mm contradicts the model: its outcome "
        f"({'stable' if stable else 'chatter'}) has a likelihood of {probability_text(share, 1e-3)}, by itself or beside the "
        "other cuts; check dynamics, coefficients and the outcome."
        for (speed, depth, stable), share in zip(cuts, sampled.likelihoods(cuts),
                                                 strict=True) if share < MIN_OUTCOME_LIKELIHOOD)


def _parameters(problem: MillingProblem, uncertainty: Uncertainty) -> tuple[list[Uncertain], list[str]]:
    parameters = coefficient_parameters(uncertainty.coefficients)
    notes = [f"Standard deviation of the cutting coefficients: {100 * uncertainty.coefficients:g} %."]
    if problem.plane.draws is not None:
        return parameters, [*notes, f"The response is uncertain by its {len(problem.plane.draws)} draws, all lines together."]
    if not isinstance(problem.dynamics, Modes):
        return parameters, [*notes, Doubt(
            "probability", "the dynamics are measured lines and are taken as exact: what noise and the scatter of hits do to "
            "limits is not in it", "identify modes and give those (toolpoint identify FILE -m modes.h5), or use toolpoint tap")]
    deviations = deviations_of(problem.dynamics)
    source = "assumed" if problem.dynamics.covariance is None else "measured"
    for name, stated, column in (("frequencies", uncertainty.frequency, 0), ("damping ratios", uncertainty.damping, 1)):
        value, origin = (float(np.median(deviations[:, column])), source) if stated is None else (stated, "given")
        notes.append(f"Standard deviation of the {name}: {100 * value:.3g} % ({origin}).")
    notes.append(f"Standard deviation of the modal stiffnesses: {100 * uncertainty.stiffness:g} %.")
    return parameters + modal_parameters(problem, uncertainty.frequency, uncertainty.damping,
                                         stiffness=uncertainty.stiffness), notes


def _check_cuts(cuts: Sequence[tuple[float, float, bool]], speeds: np.ndarray) -> None:
    for speed, depth, _ in cuts:
        if not speeds[0] <= speed <= speeds[-1] or not 0 < depth <= 1:
            raise ToolpointError(f"`tried` {speed:g}:{1e3 * depth:g}: must lie within the chart, {speeds[0]:g} .. "
                                 f"{speeds[-1]:g} rev/min, with a depth above zero; widen `speeds`")


def advice_rows(chart: StabilityChart, sampled: ProbabilityChart | None, uncertainty: Uncertainty, *,
                withheld: Sequence[Doubt] = ()) -> list[list[str]]:
    """Return rows (what, rev/min, depth mm, reason) of the cuts to make; none is given where grave doubts withhold it.

    They are marked doubtful where the FRF lacks part of the band; while a tried cut contradicts the model no cut is certain,
    and the others are marked.
    """
    if withheld:
        names = ["best cut of the chart"] + ["best cut with 95 % certainty", "next test cut"] * (sampled is not None)
        return [[name, "-", "-", withheld_words(withheld)] for name in names]
    remark = "doubtful, as the FRF lacks part of the chatter band: " if any(MISSING_BAND_WORDS in note
                                                                            for note in chart.notes) else ""
    contradicted = bool(contradictions(sampled, uncertainty.cuts))
    if contradicted:
        remark = f"doubtful, as {CONTRADICTED}: {remark}"
    rows = [_row("best cut of the chart", from_chart(chart), remark)]
    if sampled is None:
        return rows
    name = "best cut with 95 % certainty"
    certain = [name, "-", "-", f"none: {CONTRADICTED}; no depth is certain until model and cuts agree"]
    if not contradicted:
        certain = _row(name, from_cuts(sampled, list(uncertainty.cuts), CERTAIN_CUT_PROBABILITY), remark)
    return [*rows, certain, _row("next test cut", most_informative(sampled.after_cuts(uncertainty.cuts)), remark)]


def _row(name: str, cut: Advice, remark: str) -> list[str]:
    return [name, f"{cut.speed:.0f}", text_below(1e3 * cut.depth), remark + cut.reason]


@dataclass(frozen=True)
class SpeedProposal(NotebookText):
    """Spindle speeds to try against chatter at a frequency (Hz) with a number of teeth, fastest first."""

    frequency: float
    teeth: int
    speeds: tuple[Advice, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Weaknesses of the proposal."""
        first = round(60 * self.frequency / (self.teeth * self.speeds[0].speed))
        return () if first <= MAX_USEFUL_LOBE else (
            f"the fastest of them is lobe {first}; beyond lobe {MAX_USEFUL_LOBE} or so the stable pockets are too narrow to be "
            f"of "
            "use: a higher `highest`, fewer teeth, or unequal pitch help more",)

    def table(self) -> str:
        """Return the speeds as text."""
        return text_table(f"Speeds to try against chatter at {self.frequency:g} Hz", ["rev/min", "why"],
                          [[f"{cut.speed:.0f}", cut.reason] for cut in self.speeds])

    def to_dict(self) -> list[dict[str, Any]]:
        """Return the speeds as plain data."""
        return [{"speed_rpm": cut.speed, "reason": cut.reason} for cut in self.speeds]


def propose_speeds(chatter: float, teeth: int, *, highest: float, lowest: float = 0.0) -> SpeedProposal:
    """Return the spindle speeds to try against chatter, from its frequency and the number of teeth alone.

    Parameters
    ----------
    chatter : float
        Hz, from a microphone or a spectrum.
    teeth : int
    highest, lowest : float
        Ends of the spindle speeds that the machine has, rev/min.

    Raises ToolpointError where no speed of the range is one. Source: see `from_chatter_frequency`.

    Examples
    --------
    >>> [round(advice.speed) for advice in propose_speeds(800.0, 4, highest=18000.0, lowest=3000.0).speeds]
    [12000, 6000, 4000, 3000]
    """
    if not 0 <= lowest < highest:
        fail("`lowest` and `highest`", f"{lowest:g} and {highest:g} rev/min", "must be 0 <= lowest < highest")
    return SpeedProposal(chatter, teeth, from_chatter_frequency(chatter, teeth, highest, speed_min=lowest))
