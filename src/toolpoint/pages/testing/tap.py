"""The page of a tap test: the answer, a light for each step, limits, speeds to use, modes, responses, hits, assumptions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Cell, Chart, Notes, Report, Table
from toolpoint.plot.figures.cuts.tap import limit_chart
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.studies.measured.hammer_study import HEADER
from toolpoint.studies.testing.tap_study import MODE_COLUMNS, SPEED_COLUMNS, TappedDirection, TapStudy


def tap_page(result: TapStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a tap test.

    Examples
    --------
    Runs in ``examples/tap_a_tool.py``.
    """
    report = Report("Tap test", result.status)
    rows = [[light.step, Cell(light.colour, light.colour), light.words, light.remedy] for light in result.lights]
    repeat_notes = [Notes(list(result.again), "warning", "What to strike or look at again")] if result.again else []
    report = report.with_section("Steps", Table(["step", "light", "what is so", "what to do"], rows), *repeat_notes)
    if result.speed_rows():
        caption = "95 % certain at the speed and 2 % beside it, with a tenth of the depth in hand; checked by the exact method."
        report = report.with_section("Speeds to use", Table(list(SPEED_COLUMNS), result.speed_rows(), caption))
    report = report.with_section("Limits", _limits(result))
    report = report.with_section("Modes", Table(list(MODE_COLUMNS), result.mode_rows()))
    for direction in result.directions:
        report = report.with_section(f"Along {direction.name}", *_evidence(direction))
    doubts = [doubt for d in result.directions for doubt in (*(d.hits.doubts if d.hits else ()), *d.modes.doubts)]
    notes = [note for d in result.directions for note in ((*d.hits.notes, *d.band.notes) if d.hits else d.band.notes)]
    lines = [line for line in dict.fromkeys([*doubts, *warnings]) if line not in result.limits.notes]
    parts = [Notes(lines, "warning")] if lines else []
    return report.with_section("What was assumed and done", *parts,
                               Notes(list(dict.fromkeys([*result.limits.notes, *notes])), "assumed"))


def _limits(result: TapStudy) -> Chart:
    """Return the chart of limits with their interval, the rough curve, and the speeds to use unless the light is red."""
    limits = result.limits
    limit = np.minimum(limits.chart.limit, limits.chart.depth_max)
    use = [] if result.colour == "red" else [(use.speed, use.depth) for use in limits.speeds]
    rough = (limits.rough.speeds, np.minimum(limits.rough.limit, limits.rough.depth_max))
    figure = limit_chart(limits.chart.speeds, limit, (limit * limits.low, limit * limits.high), rough=rough, use=use)
    return Chart(figure, "Stable below the line. " + ("Red: not to be used." if result.colour == "red" else ""))


def _evidence(direction: TappedDirection) -> list[Chart | Table]:
    """Return the response at the tip with its modes, and the hits behind it."""
    inside = direction.tip.between(*direction.band.ends)
    parts: list[Chart | Table] = [Chart(bode(inside, modes=direction.modes.modes), "The response at the tip, with its modes.")]
    if direction.hits is not None:
        rows = [[v.name, str(v.struck), float(f"{v.hit.force:.4g}"), Cell(v.verdict, "good" if v.hit.accepted else "doubtful"),
                 "; ".join(v.hit.reasons)] for v in direction.hits.verdicts]
        parts.append(Table(list(HEADER), rows))
    return parts
