"""Effects of changes with confidence: one at a time, factorial contrasts, Sobol indices, rank regression; their ranking."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import rankdata, sobol_indices

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.studies.screening.metrics import is_lower_better, share_text
from toolpoint.studies.screening.screen import Screening
from toolpoint.studies.text_table import text_table

_INTERVAL_PERCENTILES = (2.5, 97.5)  # ends of 95 % intervals
# Enough for the ends of a 95 % interval to two digits; each is a resampling of what is computed already.
_BOOTSTRAP_SAMPLES = 400


@dataclass(frozen=True)
class Effect:
    """Effect of a change on a metric: its value, 95 % interval, and total effect where the design gives it.

    first : probability that no other change does more for the better (of one-at-a-time designs with draws; not a number else).
    """

    name: str
    value: float
    low: float
    high: float
    total: float = float("nan")
    total_low: float = float("nan")
    total_high: float = float("nan")
    first: float = float("nan")


SHARES = ("relative change", "contrast over the mean")  # meanings of effects that are shares of the metric



@dataclass(frozen=True, eq=False)
class Ranking(NotebookText):
    """Effects of all changes on a metric, the best first; what : meaning of the numbers; doubt : about the order."""

    metric: str
    what: str
    effects: tuple[Effect, ...]
    loads: str
    doubt: Doubt | None

    def table(self) -> str:
        """Return the ranking as text."""
        has_total = not np.isnan(self.effects[0].total)
        has_first = not np.isnan(self.effects[0].first)
        # Where no interval is known at all, the doubt says it once.
        has_interval = not all(np.isnan(e.low) for e in self.effects)
        intervals = ["not known" if np.isnan(e.low) else f"{self._words(e.low)} .. {self._words(e.high)}"
                     for e in self.effects]
        rows = [[e.name, self._words(e.value), *([interval] if has_interval else []),
                 *([f"{e.total:.4g}", f"{e.total_low:.4g} .. {e.total_high:.4g}"] if has_total else []),
                 *([f"{100 * e.first:.0f} %"] if has_first else [])]
                for e, interval in zip(self.effects, intervals, strict=True)]
        header = ["change", self.what, *(["95 %"] if has_interval else []), *(["total", "95 %"] if has_total else []),
                  *(["ranks first"] if has_first else [])]
        return "\n".join([*mark_notes([self.doubt] if self.doubt else []), text_table(
            f"Effects on the {self.metric}, the best first", header, rows), f"loads: {self.loads}"])

    def _words(self, value: float) -> str:
        """Return an effect in words: a share of the metric in per cent."""
        return share_text(value) if self.what in SHARES else f"{value:+.4g}"

    def to_dict(self) -> dict[str, Any]:
        """Return the ranking as plain data."""
        return {"metric": self.metric, "what": self.what, "loads": self.loads, "doubt": self.doubt or "",
                "effects": [vars(effect) for effect in self.effects]}


def rank_changes(result: Screening, metric: str = "", rng: np.random.Generator | None = None) -> Ranking:
    """Return the changes ranked by their effect on a metric (the first where left out).

    One at a time: relative change, its interval over the draws of uncertain inputs. Factorial: contrast of the two ends over
    the mean, its interval from the scatter that the main effects leave. Sobol indices: shares of the variance. Other samples:
    rank correlation, bootstrapped. rng : of the bootstrap; seed 0 where left out.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.variation import Factor
    >>> from toolpoint.studies.screening.designs import one_at_a_time
    >>> from toolpoint.studies.screening.metrics import NamedMetrics
    >>> from toolpoint.studies.screening.screen import screen
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> result = screen(machine, one_at_a_time([Factor("head", ("bodies.head.mass",))]), NamedMetrics())
    >>> [effect.name for effect in rank_changes(result).effects]
    ['head -20 %', 'head +20 %']
    """
    name = metric or result.metrics[0]
    result.metric(name)
    generator = rng or np.random.default_rng(0)
    kind = result.design.kind
    if kind == "one at a time":
        effects, what, doubt = _single_effects(result, name)
    elif "factorial" in kind:
        effects, what, doubt = _contrasts(result, name)
    elif kind == "Sobol indices":
        effects, what, doubt = _indices(result, name, generator)
    else:
        effects, what, doubt = _correlations(result, name, generator)
    sense = 1 if is_lower_better(name) and what == "relative change" else -1
    key = (lambda e: sense * e.value) if what == "relative change" else (lambda e: -abs(e.value))
    return Ranking(name, what, tuple(sorted(effects, key=key)), result.loads, doubt)


def _single_effects(result: Screening, name: str) -> tuple[list[Effect], str, Doubt | None]:
    values = result.metric(name)
    change = values[:, 1:] / values[:, :1] - 1
    sense = -1.0 if is_lower_better(name) else 1.0
    # The first row is the machine as described, the others are draws of its uncertain inputs.
    drawn = change[1:] if len(change) > 1 else change
    lower, upper = np.nanpercentile(drawn, _INTERVAL_PERCENTILES, axis=0)
    # In every draw one change does most; how often it is this one is its probability of being first.
    best = np.argmax(np.where(np.isnan(drawn), -np.inf, sense * drawn), axis=1)
    effects = [Effect(label, float(change[0, k]), float(lower[k]) if len(change) > 1 else float("nan"),
                      float(upper[k]) if len(change) > 1 else float("nan"),
                      first=float((best == k).mean()) if len(change) > 1 else float("nan"))
               for k, label in enumerate(result.design.labels[1:]) if np.isfinite(change[0, k])]
    unsure = Doubt("order", "no uncertain inputs were drawn: nothing tells how sure it is", "give doubts and draws")
    return effects, "relative change", None if len(change) > 1 else unsure


def _contrasts(result: Screening, name: str) -> tuple[list[Effect], str, Doubt | None]:
    values, points = result.metric(name)[0], result.design.points
    ends = points.min(axis=0), points.max(axis=0)
    # From -1/2 to 1/2: a coefficient is the difference of the two ends.
    columns = (points - (ends[0] + ends[1]) / 2) / np.where(ends[1] > ends[0], ends[1] - ends[0], 1.0)
    matrix = np.column_stack([np.ones(len(points)), columns])
    if len(points) <= matrix.shape[1]:
        fail("design", f"{len(points)} points for {matrix.shape[1]} numbers", "must be more", remedy="take a larger fraction")
    solution, *_ = np.linalg.lstsq(matrix, values, rcond=None)
    residual = values - matrix @ solution
    # Residual variance over its degrees of freedom, carried through the least squares.
    variance = float(residual @ residual) / (len(points) - matrix.shape[1]) * np.linalg.inv(matrix.T @ matrix).diagonal()[1:]
    mean = float(solution[0])
    half = NORMAL_QUANTILE_95 * np.sqrt(variance) / abs(mean)
    share = float(residual @ residual) / max(float(((values - values.mean()) ** 2).sum()), 1e-300)
    effects = [Effect(c, float(e / mean), float(e / mean - h), float(e / mean + h))
               for c, e, h in zip(result.design.names, solution[1:], half, strict=True)]
    doubt = Doubt("main effects", f"{100 * share:.0f} % of the scatter is of pairs of changes or curvature, not of them",
                  figure=float(share))
    return effects, "contrast over the mean", None if share < 0.1 else doubt


def _indices(result: Screening, name: str, rng: np.random.Generator) -> tuple[list[Effect], str, Doubt | None]:
    values, d = result.metric(name)[0], len(result.design.changes)
    if np.isnan(values).any():
        fail("screening", f"{int(np.isnan(values).sum())} failed variants", "indices need all of them",
             remedy="narrow the ranges")
    n = len(values) // (d + 2)
    # Order of the points: A, B, then A with each column of B (`sobol_pairs`).
    parts = values.reshape(d + 2, n)
    data: dict[str, FloatArray] = {"f_A": parts[0][None], "f_B": parts[1][None], "f_AB": parts[2:, None, :]}
    indices = sobol_indices(func=data, n=n, rng=rng)
    interval = indices.bootstrap(confidence_level=0.95, n_resamples=_BOOTSTRAP_SAMPLES)
    main, total = interval.first_order.confidence_interval, interval.total_order.confidence_interval
    effects = [Effect(change, *(float(np.ravel(v)[k]) for v in (indices.first_order, main.low, main.high, indices.total_order,
                                                               total.low, total.high)))
               for k, change in enumerate(result.design.names)]
    largest_width = float(np.max(np.ravel(total.high) - np.ravel(total.low)))
    return effects, "main effect", None if largest_width < 0.2 else Doubt(
        "total effects", f"their intervals are up to {largest_width:.2g} wide", "take more points", figure=float(largest_width))


def _correlations(result: Screening, name: str, rng: np.random.Generator) -> tuple[list[Effect], str, Doubt | None]:
    values, points = result.metric(name)[0], result.design.points
    good = np.flatnonzero(~np.isnan(values))

    def partial(pick: np.ndarray) -> FloatArray:
        # Ranks make any monotone effect a straight line.
        ranks = np.column_stack([rankdata(points[pick, k]) for k in range(points.shape[1])])
        matrix = np.column_stack([np.ones(len(pick)), (ranks - ranks.mean(0)) / ranks.std(0)])
        answer = rankdata(values[pick])
        return np.linalg.lstsq(matrix, (answer - answer.mean()) / answer.std(), rcond=None)[0][1:]

    if len(good) <= points.shape[1] + 2:
        fail("design", f"{len(good)} points", f"must be more than {points.shape[1] + 2}", remedy="take more points")
    central = partial(good)
    drawn = np.array([partial(rng.choice(good, good.size)) for _ in range(_BOOTSTRAP_SAMPLES)])
    lower, upper = np.percentile(drawn, _INTERVAL_PERCENTILES, axis=0)
    effects = [Effect(change, float(central[k]), float(lower[k]), float(upper[k])) for k,
               change in enumerate(result.design.names)]
    return effects, "standardised rank regression", None if (central**2).sum() > 0.7 else Doubt(
        "ranks", "explain less than 70 % of the scatter: effects are not monotone or act together", "take Sobol indices",
        figure=float((central**2).sum()))
