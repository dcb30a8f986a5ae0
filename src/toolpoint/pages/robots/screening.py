"""The page of a screening: every variant, a scatter of two metrics, and rankings with confidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._rounding import with_uncertainty
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.machines.screening import effect_bars, variant_scatter
from toolpoint.studies.screening.effects import SHARES
from toolpoint.studies.screening.metrics import shown_name, shown_unit
from toolpoint.studies.screening.planned import PlannedScreening

_MAX_TABLE_VARIANTS = 60  # variants in the table


def screening_page(result: PlannedScreening, name: str, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a planned screening.

    Examples
    --------
    Runs in ``examples/screen_a_plan_of_changes.py``.
    """
    screening = result.screening
    report = Report(f"Screening: {name}", _answer(result), subtitle=f"Loads: {screening.loads}")
    labels = [screening.design.words(i) for i in range(len(screening.stated))]
    has_base = bool(screening.design.labels) and screening.design.labels[0] == "as it is"
    factors = np.array([shown_unit(metric)[1] for metric in screening.metrics])
    if len(screening.metrics) > 1:
        names = [shown_name(metric) for metric in screening.metrics[:2]]
        report = report.with_section("Variants", Chart(variant_scatter(
            factors[0] * screening.stated[:, 0], factors[1] * screening.stated[:, 1], labels=labels, names=(names[0], names[1]),
            base=0 if has_base else None)))
    for ranking in result.rankings:
        effects = ranking.effects
        effects_found, lower_ends, upper_ends = (np.array([getattr(e, key) for e in effects])
                                                 for key in ("value", "low", "high"))
        chart = effect_bars([e.name for e in effects], effects_found, lower_ends, upper_ends=upper_ends, title=ranking.what)
        doubt = [Notes([ranking.doubt], "warning", "How sure")] if ranking.doubt else []
        report = report.with_section(ranking.metric.capitalize(), Chart(chart), *doubt)
    rows = [[i, label, *map(float, factors * row)] for i,
            (label, row) in enumerate(zip(labels[:_MAX_TABLE_VARIANTS], screening.stated, strict=False))]
    report = report.with_section("All variants", Table(["number", "variant", *map(shown_name, screening.metrics)], rows,
                                                       digits=6))
    drawn = "Effects are those of the file's numbers, with its doubts drawn at random where it states any."
    return with_remarks(report, [*result.remarks, screening.status, drawn], [*screening.failures.values(), *warnings])


def _answer(result: PlannedScreening) -> str:
    """Return the greatest effect on the first metric with its interval."""
    count = len(result.screening.stated)
    if not result.rankings or not result.rankings[0].effects:
        return f"{count} variants were computed."
    ranking = result.rankings[0]
    best = max(ranking.effects, key=lambda effect: abs(effect.value))
    half = (best.high - best.low) / 2
    scale, unit = (100, "%") if ranking.what in SHARES else (1, "")
    words = with_uncertainty(scale * float(best.value), scale * float(half) if np.isfinite(half) else None, unit)
    sure = " (95 %)" if np.isfinite(half) else ", without an interval"
    return f"Of {count} variants, {best.name} moves {ranking.metric} most: {ranking.what} {words}{sure}."
