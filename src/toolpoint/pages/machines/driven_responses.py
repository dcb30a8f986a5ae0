"""The page of a machine's responses with its drives on, off, shorted and braked."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.studies.servos.driven_responses import STATE_HEADER, DrivenResponses


def driven_responses_page(result: DrivenResponses, warnings: Sequence[str] = ()) -> Report:
    """Return the page of the responses for every state of the drives.

    Examples
    --------
    Runs in ``examples/drives_on_and_off.py``.
    """
    report = Report(f"{result.name}: its drives on, off and braked", result.status)
    if result.doubts:
        report = report.with_section("Doubts", Notes(list(result.doubts), "warning", "Look at these first"))
    rows = [list(row) for row in result.rows()]
    report = report.with_section("Responses by state of the drives", Table(list(STATE_HEADER), rows))
    for output in result.frfs["on"].outputs:
        curves = {name: frf.selected([output], [output]) for name, frf in result.frfs.items()}
        report = report.with_section(f"{output}", Chart(bode(curves, title=f"{output} / {output}"),
                                                        "Force and motion at the same place, drives in every state."))
    lines = [line for line in dict.fromkeys(warnings) if line not in (*result.doubts, *result.notes)]
    parts = [Notes(lines, "warning")] if lines else []
    return report.with_section("What was assumed and done", *parts, Notes(list(result.notes), "assumed"))
