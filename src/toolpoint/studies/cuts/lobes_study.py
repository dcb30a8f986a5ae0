"""Stability lobes of a described cut: the chart, doubts about it, cuts to make, simulated cuts, probability."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, doubts_among, grave_among
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text, text_below
from toolpoint.cutting import MillingProblem, StabilityChart, stability
from toolpoint.cutting.advice.best_speed import from_chart
from toolpoint.cutting.advice.probability import ProbabilityChart
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, run_until_decided
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.cutting.stability.automatic import Automatic
from toolpoint.cutting.stability.catalogue import method_words
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.panels.method import PanelArnoldi
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.limit_spread import LimitSpread, spread_of_limits
from toolpoint.studies.cuts.limit_table import MAX_QUICK_MODES, LimitTable, tabulate_limits
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.cuts.uncertain_cut import Uncertainty, advice_rows, contradictions, sample_charts
from toolpoint.studies.machines.reduced_limits import question_reduction
from toolpoint.studies.machines.tool_point import deep_chart
from toolpoint.studies.text_table import text_table

MIN_BELIEVED_LIMIT, MAX_BELIEVED_LIMIT = 1e-6, 0.1  # m, limits that are believed
LONG_EDGE_RATIO = 1.5  # length of the edges over the diameter: longer than most end mills have
MAX_GRID_RUN_ON_STEPS = 1_000_000  # steps up to which an undecided cut of the grid is run on
RUN_KEPT_STEPS = 20_000  # steps of each such cut that are kept for its chart
DEFAULT_SIMULATED_FEED = 1e-4  # m, feed per tooth of simulations where none is given
ADVICE = ("", "rev/min", "depth mm", "why")
NamedProgress = Callable[[str, int, int], None]
END_OF_SEARCH = "no limit was found at"  # how the words begin that a chart ends below its limits


@dataclass(frozen=True, eq=False)
class LobesStudy(NotebookText):
    """Stability chart of a cut, with advice, doubts, simulated cuts and probability.

    chart : its notes say what was assumed; advice : rows (what, rev/min, mm, why) of cuts to make; doubts : remarks on limits
    that are hard to believe; runs : cuts simulated in time; probability : of stability, None where it was not asked for;
    lowest : limit between the charted speeds (None for measured lines, whose charts take long).
    spread : of the limits from the machine's identified numbers, None where there are none; other_cuts : limits at other
    immersions and numbers of teeth, None where they were not asked for.
    """

    problem: MillingProblem
    chart: StabilityChart
    advice: tuple[tuple[str, ...], ...]
    doubts: tuple[Doubt, ...] = ()
    runs: tuple[Simulation, ...] = ()
    probability: ProbabilityChart | None = None
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    lowest: stability.LowestLimit | None = None
    spread: LimitSpread | None = None
    other_cuts: LimitTable | None = None

    @property
    def withheld(self) -> list[Doubt]:
        """The grave doubts for which no cut is recommended."""
        return grave_among(self.chart.notes)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """A line on every tried cut whose outcome the model hardly allows."""
        return contradictions(self.probability, self.uncertainty.cuts)

    def noted(self, notes: Sequence[str]) -> LobesStudy:
        """Return the study with further notes before those of its chart."""
        return replace(self, chart=replace(self.chart, notes=tuple(dict.fromkeys([*notes, *self.chart.notes]))))

    def table(self) -> str:
        """Return the lowest and highest limit and the cuts to make as text."""
        chart = self.chart
        title = f"Stability by {method_words(chart.method)}" + (" (not to be used: see the doubts)" if self.withheld else "")
        header = ["", "rev/min", "depth mm", "error mm", "chatter Hz"]
        rows = [*_lowest_rows(self.lowest), *_limit_rows(chart)]
        return text_table(title, header, rows) + "\n" + text_table("Cuts to make", ADVICE, self.advice)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, SI: stable intervals, error and chatter frequency of every speed's limit, advice.

        None where there is no limit. Where advice is withheld the reasons are given, and no lowest limit.
        """
        chart = self.chart
        points = chart.limit_points().tolist()
        return {"speed_rpm": chart.speeds.tolist(),
                "stable_intervals_m": [chart.intervals(i).tolist() for i in range(len(points))],
                "depth_max_m": chart.depth_max, "is_end_of_search": (~np.isfinite(chart.limit)).tolist(),
                "limit_error_m": [None if p < 0 else float(chart.error[p]) for p in points],
                "chatter_frequency_hz": [None if p < 0 else float(chart.frequency[p]) for p in points],
                "lowest_limit": None if self.withheld else _lowest_numbers(self.lowest),
                "withheld": list(self.withheld),
                "limit_interval_m": (chart.interval_rows() if self.spread is None
                                     else self.spread.rows(chart.limit, chart.limit_error)),
                "method": chart.method, "notes": list(chart.notes), "advice": [list(row) for row in self.advice],
                "contradictions": list(self.contradictions), "status": chart.status}


def chart_lobes(dynamics: ToolDynamics, values: Mapping[str, Any] | None = None, *, method: StabilityMethod | None = None,
                speeds: FloatArray | None = None, simulate_cuts: bool = False, uncertainty: Uncertainty | None = None,
                other_cuts: bool | None = False,
                progress: NamedProgress = lambda name, finished, total: None) -> LobesStudy:
    """Return the stability chart of a cut on these dynamics, deep enough to show limits, and the cuts to make.

    Parameters
    ----------
    dynamics : ToolDynamics
    values : mapping of flat keys of a CuttingDescription to values, optional
        In place of those of the machine, or of the example where there is none (a note says which).
    method : stability method, optional
        Chosen to suit the cut where left out.
    speeds : (n,) floats, optional
        rev/min; 200 over the range of the cut where left out.
    simulate_cuts : bool
        Simulate cuts in time on a grid of speeds and depths too.
    uncertainty : Uncertainty, optional
        With samples, also the probability of stability.
    other_cuts : bool, optional
        Whether limits at other immersions and numbers of teeth are computed too; None where that takes few seconds.
    progress : function of name, done and total

    >>> from toolpoint.cutting import ZeroOrder
    >>> from toolpoint.studies import modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> tip = Modes([900.0, 900.0], 0.02, 1.5 * np.eye(2), ("tip:+x", "tip:+y"))
    >>> cut = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 8e8, "normal": 3e8}
    >>> soft, hard = (chart_lobes(modal_dynamics(tip), {**cut, "tangential": factor * 8e8, "normal": factor * 3e8},
    ...                           speeds=np.array([9000.0]), method=ZeroOrder()).chart.limit[0] for factor in (1, 2))
    >>> round(float(soft / hard), 6)  # limits go with one over both coefficients
    2.0
    """
    uncertainty = uncertainty or Uncertainty()
    problem, cut, notes = build_problem(dynamics, values or {})
    timed = problem
    if simulate_cuts and not problem.plane.is_modal:
        timed = build_problem(dynamics, values or {}, in_time=True)[0]
    n = np.linspace(*cut.speeds, 200) if speeds is None else speeds
    progress(f"stability at {len(n)} speeds", 0, 1)
    end, why = cut.depth_end
    chart = _deep_chart(problem, n, method, end)
    lowest = None
    if problem.plane.is_modal:
        progress("the lowest limit between these speeds", 0, 1)
        lowest = stability.lowest_limit(problem, chart, method)
    reduced = question_reduction(dynamics.machine, dynamics.pose, problem, chart=chart)
    if reduced is not None:
        chart, notes = reduced.widen(chart), [*reduced.notes, *notes]
        lowest = None if lowest is None else reduced.widen_lowest(lowest)
    runs = _simulate_grid(timed, chart, progress) if simulate_cuts else []
    sampled: ProbabilityChart | None = None
    if uncertainty.samples:
        sampled, sampling_notes = sample_charts(problem, chart, uncertainty, method=method,
                                       progress=lambda finished, total: progress("sampled charts", finished, total))
        notes += sampling_notes
    spread = spread_of_limits(dynamics, values or {}, chart, method=method,
                              progress=lambda finished, total: progress("sampled machines", finished, total))
    if spread is not None and np.isfinite(chart.limit).any():
        notes = [spread.words(*least_limit(chart, lowest)), *notes]
    advice = advice_rows(chart, sampled, uncertainty, withheld=dynamics.withheld)
    doubts = [*doubts_among(notes), *doubtful_limits(chart)]
    best = from_chart(chart)
    if needs_long_edges(problem, best.depth) and not dynamics.withheld:
        diameters = best.depth / (2 * problem.tool.radius)
        notes = [f"the best cut is {text_below(1e3 * best.depth)} mm deep, {diameters:.2g} times the tool's diameter: only for "
                 "edges that are so long", *notes]
    if chart.limit_draws is not None and np.isfinite(chart.limit).any():
        notes = [drawn_words(chart), *notes]
    ended = end_words(chart, end, why)
    chart = replace(chart, notes=tuple(dict.fromkeys([*doubts, *ended, *notes, *chart.notes])))
    rows = tuple(tuple(row) for row in advice)
    tabled = None
    if problem.plane.is_modal and (other_cuts or (other_cuts is None and _is_quick(problem, method))):
        tabled = tabulate_limits(dynamics, values or {}, cut, chart=chart, method=method,
                                 progress=lambda finished, total: progress("other immersions and teeth", finished, total))
    return LobesStudy(problem, chart, rows, tuple(doubts), tuple(runs), sampled, uncertainty, lowest, spread, tabled)


def least_limit(chart: StabilityChart, lowest: stability.LowestLimit | None) -> tuple[float, float]:
    """Return the least limit and its stated error, m: that between the charted speeds where it is known, else the charted one.

    >>> from toolpoint.cutting import ZeroOrder
    >>> from toolpoint.studies import modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> tip = modal_dynamics(Modes([900.0, 900.0], 0.02, 1.5 * np.eye(2), ("tip:+x", "tip:+y")))
    >>> study = chart_lobes(tip, speeds=np.array([9000.0, 9500.0]), method=ZeroOrder())
    >>> bool(least_limit(study.chart, None)[0] == study.chart.limit.min())
    True
    """
    if lowest is not None and np.isfinite(lowest.depth):
        return lowest.depth, lowest.error
    index = int(np.argmin(chart.limit))
    return float(chart.limit[index]), float(chart.limit_error[index])


def _is_quick(problem: MillingProblem, method: StabilityMethod | None) -> bool:
    """Return whether a table of other cuts takes a few seconds: few modes, and no engine that goes depth by depth."""
    engine = stability.default_method(problem) if method is None or isinstance(method, Automatic) else method
    return problem.plane.poles.size <= MAX_QUICK_MODES and not isinstance(engine, PanelArnoldi)


def drawn_words(chart: StabilityChart) -> str:
    """Return the 95 % interval of the least charted limit by the draws of the response, in words."""
    lower, upper = chart.least_limit_ends
    return (f"95 % interval of the least charted limit from what is uncertain in the response: {1e3 * lower:.4g} .. "
            f"{1e3 * upper:.4g} mm ({len(chart.limit_draws if chart.limit_draws is not None else ())} draws)")


def needs_long_edges(problem: MillingProblem, depth: float) -> bool:
    """Return whether a depth asks for longer edges than most tools of the diameter have."""
    return depth > LONG_EDGE_RATIO * 2 * problem.tool.radius


def _deep_chart(problem: MillingProblem, speeds: FloatArray, method: StabilityMethod | None, end: float
                ) -> StabilityChart:
    """Return the chart, deep enough to show a limit at half of the speeds, where there is one above `end` (m)."""
    with _for_lines(problem):
        return deep_chart(problem, speeds, method, share=0.5, end=end)


def end_words(chart: StabilityChart, end: float, why: str) -> list[str]:
    """Return that at some speeds no limit was found to the end of the searched depths, and why that is there."""
    unlimited = int((~np.isfinite(chart.limit)).sum())
    if not unlimited:
        return []
    reason = why if chart.depth_max >= end * (1 - 1e-9) else "limits at most other speeds lie above it; `deepest` takes another"
    return [f"{END_OF_SEARCH} {unlimited} of {chart.speeds.size} speeds down to {1e3 * chart.depth_max:.4g} mm, the end "
            f"of the searched depths ({reason})"]


def doubtful_limits(chart: StabilityChart) -> list[Doubt]:
    """Return doubts about limits (depths or widths) that no machine has, and those that their stated errors give."""
    least_limit = float(np.min(np.minimum(chart.limit, chart.depth_max)))
    if MIN_BELIEVED_LIMIT < least_limit < MAX_BELIEVED_LIMIT:
        return [*chart.doubts]
    return [*chart.doubts, Doubt("lowest limit", f"{1e3 * least_limit:.3g} mm is hardly that of a machine",
                                 "check the units of the "
                                 "responses (lines in Hz, m/N), `quantity`, and the coefficients (N/mm^2)")]


@contextmanager
def _for_lines(problem: MillingProblem) -> Iterator[None]:
    """Replace the error of a method that needs modes by one with a remedy, where the dynamics are measured lines."""
    try:
        yield
    except ToolpointError as error:
        if problem.plane.is_modal:
            raise
        raise ToolpointError(f"{error}\nThe dynamics are measured lines, which this cut or method cannot take; identify "
                             "their modes first:\n  toolpoint identify FILE -m modes.h5, then give `modes` instead of the "
                             "FRF") from None


def _simulate_grid(problem: MillingProblem, chart: StabilityChart, progress: NamedProgress) -> list[Simulation]:
    """Simulate cuts at ten speeds and five depths around the limit."""
    fed = problem if problem.feed_per_tooth > 0 else problem.changed(feed_per_tooth=DEFAULT_SIMULATED_FEED)
    finite = chart.limit[np.isfinite(chart.limit)]
    largest_depth = 1.8 * float(np.median(finite)) if finite.size else chart.depth_max
    grid = [(float(n), float(w)) for n in np.linspace(chart.speeds[0], chart.speeds[-1], 10)
            for w in np.linspace(largest_depth / 5, largest_depth, 5)]
    runs = []
    for i, (speed, depth) in enumerate(grid):
        max_repeats = MAX_GRID_RUN_ON_STEPS // (ExactSteps().chosen(fed, speed) * fed.tool.teeth)
        runs.append(run_until_decided(RunningCut(fed, speed, depth, kept=RUN_KEPT_STEPS), 60, max(60, max_repeats)))
        progress("simulated cuts", i + 1, len(grid))
    return runs


def _limit_rows(chart: StabilityChart) -> list[list[str]]:
    limit = chart.limit
    lowest, highest = int(np.argmin(limit)), int(np.argmax(np.where(np.isfinite(limit), limit, chart.depth_max)))
    points = chart.limit_points()
    rows = []
    for name, i in (("lowest charted limit", lowest), ("highest charted limit", highest)):
        p = int(points[i])
        end = ["", ""] if p < 0 else [f"{1e3 * chart.error[p]:.2g}", f"{chart.frequency[p]:.1f}"]
        error = 0.0 if p < 0 else float(chart.error[p])
        depth = _millimetres(limit[i], error) if np.isfinite(limit[i]) else f"above {1e3 * chart.depth_max:.3g}"
        rows.append([name, f"{chart.speeds[i]:.0f}", depth, *end])
    return rows


def _lowest_rows(lowest: stability.LowestLimit | None) -> list[list[str]]:
    if lowest is None or not np.isfinite(lowest.depth):
        return []
    return [["lowest limit between these speeds", f"{lowest.speed:.0f}", _millimetres(lowest.depth, lowest.error),
             f"{1e3 * lowest.error:.2g}", f"{lowest.frequency:.1f}"]]


def _lowest_numbers(lowest: stability.LowestLimit | None) -> dict[str, float] | None:
    if lowest is None or not np.isfinite(lowest.depth):
        return None
    return {"depth_m": lowest.depth, "error_m": lowest.error, "speed_rpm": lowest.speed,
            "chatter_frequency_hz": lowest.frequency}


def _millimetres(depth: float, error: float) -> str:
    """Return a depth (m) in mm to the last digit that its error (m) leaves, at most four decimals."""
    # No digit below a third of a micrometre: no cut is set more exactly, however small the numerical error.
    return number_text(1e3 * depth, max(1e3 * error, 3e-4))
