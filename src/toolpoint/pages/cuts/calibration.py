"""The page of a calibration: coefficients and run-out, mean forces, measured beside fitted forces."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint._rounding import with_uncertainty
from toolpoint.cutting.build import engagement_of, tool_of
from toolpoint.cutting.force.calibration import Calibration
from toolpoint.cutting.force.energy_fit import law_of_fit
from toolpoint.pages.cuts.cut_words import inside
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.cuts.calibration import mean_forces, plot_energy, plot_force_fit, plot_ratios
from toolpoint.studies.cuts.forces.calibration import HEADER, MEAN_FORCE_REMARK, TOOTH_REMARK, CalibrationStudy, fit_rows

MAX_FORCE_CHARTS = 8  # records whose forces are drawn, the smallest feeds first


def calibration_page(result: CalibrationStudy, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a calibration.

    Examples
    --------
    Runs in ``examples/calibrate_cutting_coefficients.py``.
    """
    test = result.test
    tool = tool_of(result.description)
    words = f"{inside(tool)}, engaged {inside(engagement_of(result.description)).replace('..', ' to ')}"
    report = Report("Calibration of cutting coefficients", _answer(result),
                    subtitle=f"{words}; {test.speed:g} rev/min, depth {1e3 * test.depth:g} mm, {result.feeds.size} records")
    report = report.with_section(
        "Coefficients and run-out", f"Fit of the forces over rotation; residual {result.fit.residual:.4g} N, "
        f"{result.fit.status}." + (f" {TOOTH_REMARK}" if result.is_named_by_fit else ""),
        Table(list(HEADER), fit_rows(result.fit)))
    if result.energy is not None and result.energies is not None:
        report = report.with_section(
            "Total energy and force ratios",
            "Energy per volume falls with the chip thickness h as (h / 1 mm)^-exponent; ratios are to the tangential force. "
            "Points are each feed by itself, the line is the law of all. Residual "
            f"{result.energy.residual:.4g} N, {result.energy.status}.", Table(list(HEADER), fit_rows(result.energy)),
            Chart(plot_energy(result.energies, law_of_fit(result.energy)), name="energy"),
            Chart(plot_ratios(result.energies, law_of_fit(result.energy)), name="ratios"))
    if result.average is not None:
        mean, model = result.measured.mean(1), result.fitted.mean(1)
        words = f"Fit of the mean forces over feed. {MEAN_FORCE_REMARK} The lines are those of the fit over rotation."
        report = report.with_section("Average forces", words, Table(list(HEADER), fit_rows(result.average)),
                                     Chart(mean_forces(result.feeds, mean, model), name="means"))
    charts = [Chart(plot_force_fit(result.angle, result.measured[i], result.fitted[i],
                                   title=f"{name}, {1e3 * feed:g} mm a tooth"),
                    name=f"forces{i}")
              for i, (feed, name) in enumerate(zip(result.feeds[:MAX_FORCE_CHARTS], result.names, strict=False))]
    report = report.with_section("Measured and fitted forces", "Forces on the tool over one revolution, the mean of all whole "
                               "revolutions of the record.", *charts)
    report = report.with_doubts(*warnings, *result.doubts)
    return report.with_assumptions(
        f"Forces act on the {test.force_on}; the spindle turns at {test.speed:g} rev/min exactly, at a depth of "
        f"{1e3 * test.depth:g} mm.", "The tool is rigid in the test: no vibration is taken off the forces.",
        *(() if test.runout else ("Run-out is taken as zero.",)))


def _answer(result: CalibrationStudy) -> str:
    """Return the coefficients with their 95 % intervals in a sentence."""
    if result.test.law == "total-energy" and result.energy is not None:
        return _answer_of_law(result, result.energy)
    fit, words = result.fit, []
    for name, value, (_, upper_end) in zip(fit.names, fit.values, fit.interval, strict=True):
        if name in ("kt", "kn", "ka"):
            words.append(f"K_{name[1]} = {with_uncertainty(float(value) / 1e6, float(upper_end - value) / 1e6)}")
    return f"{', '.join(words)} N/mm^2 (95 %), fitted to {result.feeds.size} records."


def _answer_of_law(result: CalibrationStudy, energy: Calibration) -> str:
    """Return the law with its 95 % intervals in a sentence."""
    numbers = {}
    for name, value, (_, upper_end) in zip(energy.names[:4], energy.values, energy.interval, strict=False):
        unit = 1e6 if name == "energy" else 1.0
        numbers[name] = with_uncertainty(float(value) / unit, float(upper_end - value) / unit)
    axial = f", axial {numbers['axial_ratio']}" if "axial_ratio" in numbers else ""
    return (f"Energy {numbers['energy']} N/mm^2 at a chip of 1 mm, falling with exponent {numbers['exponent']}; normal force "
            f"{numbers['normal_ratio']} of the tangential one{axial} (95 %), fitted to {result.feeds.size} records.")
