"""The page of a simulated cut: forces, vibration, spectra, remarks."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cutting import simulation_charts
from toolpoint.studies.cuts.simulated_cut import SimulatedCut


def simulation_page(result: SimulatedCut, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a simulated cut."""
    run = result.run
    report = Report("Simulated cut", f"{run.problem!r}", subtitle=f"{run.speed:g} rev/min, depth {1e3 * run.depth:g} mm")
    report = report.with_section("Result", Table(["quantity", "value"], result.rows()))
    for name, figure in simulation_charts(run).items():
        report = report.with_section(name, Chart(figure))
    return with_remarks(report, [*result.notes, *warnings])
