"""The page of a simulated cut: forces, vibration, spectra, remarks."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint.pages.cuts.cut_words import dynamics_parts, no_cut_words, problem_words
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cuts.cutting import plot_wall, simulation_charts
from toolpoint.studies.cuts.simulated_cut import SimulatedCut
from toolpoint.studies.cuts.simulated_wall import SHOWN_PARAMETERS, SimulatedWall


def simulation_page(result: SimulatedCut, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a simulated cut.

    Examples
    --------
    Runs in ``examples/simulate_a_cut.py``.
    """
    run = result.run
    report = Report("Simulated cut", _answer(result), subtitle=f"{problem_words(run.problem)}; {run.speed:g} rev/min, depth "
                                                               f"{1e3 * run.depth:g} mm")
    report = report.with_section("Result", Table(["quantity", "value"], result.rows()))
    for name, figure in simulation_charts(run).items():
        report = report.with_section(name, Chart(figure))
    if result.wall is not None:
        wall, limits = result.wall, [1e3 * limit for limit in result.wall.parts.limits]
        bands = {"roughness": wall.parts.roughness, "waviness": wall.parts.waviness, "form": wall.parts.form}
        report = report.with_section(
            "Wall that is left", f"On average {1e6 * wall.location_error:+.2f} µm of material are left at the tip. Roughness, "
            f"waviness and form by lifting wavelets; the bands meet at {limits[0]:.3g} and {limits[1]:.3g} mm.",
            Chart(plot_wall(wall.place, wall.profile, bands), "Vibration of the last revolutions is repeated along the wall."),
            _roughness(wall))
    report = report.with_section("The dynamics it stands on", *dynamics_parts(run.problem.plane))
    return with_remarks(report, [*result.notes, "Dynamics and cutting coefficients are taken as exact."], warnings)


def _roughness(wall: SimulatedWall) -> Table:
    rows = [[name, *(1e6 * parameters[key] for key in SHOWN_PARAMETERS)]
            for name, parameters in {"lifting wavelets": wall.parameters, **wall.filtered}.items()]
    return Table(["filter", *(f"{key}, µm" for key in SHOWN_PARAMETERS)], rows,
                 f"Roughness as an instrument shows it whose filter has a cutoff of {1e3 * wall.parts.limits[0]:.3g} mm.")


def _answer(result: SimulatedCut) -> str:
    """Return the verdict with its reason."""
    if result.withheld:
        return no_cut_words(result.withheld)
    run, verdict = result.run, result.run.verdict()
    state_words = {"chatter": "chatters", "stable": "is stable"}.get(verdict.state, "is undecided")
    return (f"The cut at {run.speed:g} rev/min and {1e3 * run.depth:g} mm depth {state_words}: {verdict.reason.split(';')[0]}.")
