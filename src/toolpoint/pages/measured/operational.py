"""The page of an operational modal analysis: the modes, the harmonics that are none, and why both are believed."""

from __future__ import annotations

from collections.abc import Sequence

from toolpoint._rounding import with_uncertainty
from toolpoint.modal_identification import phase_collinearity
from toolpoint.plot import AnimatedShapes, Cell, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.measured.operational import operational_poles, singular_values
from toolpoint.studies.measured.operational_study import NO_SCALE, OperationalStudy
from toolpoint.vibration.geometry import Geometry

NAMED_MODES = 5  # in the answer


def operational_page(study: OperationalStudy, geometry: Geometry | None = None, names: Sequence[str] = (), *,
                     warnings: Sequence[str] = ()) -> Report:
    """Return the page of an operational modal analysis of records with these names.

    Examples
    --------
    Runs in ``examples/scale_modes_of_a_machine_at_work.py``.
    """
    result = study.identification
    report = Report("Modes of the machine at work", answer(study), subtitle=", ".join(names))
    report = report.with_doubts(*study.doubts, *warnings)
    report = report.with_section("Modes", _mode_table(study), *([Notes(study.notes, "note", "What was done")]
                                                                if study.notes else []))
    if result.harmonics:
        report = report.with_section("Harmonics of rotating parts",
                                     "These lines have a constant amplitude: they are forced, and no "
                                     "modes. They were taken off the records before modes were sought.", _harmonic_table(study))
    if geometry is not None:
        scene = Scene.of_points(geometry.points, geometry.lines)
        report = report.with_section("Mode shapes", ShapeView(scene, AnimatedShapes.from_modes(result.modes, geometry.points),
                                                              "modes", "Identified modes"))
    report = report.with_section(
        "Spectra", Chart(singular_values(result),
                         "Singular values of the spectra of all channels, each over its rms, harmonics taken off. A peak of "
                         "the first is a mode; a second that rises with it, two close ones. Dotted: the modes; "
                         "crosses: harmonics.",
                         "spectra"))
    report = report.with_section(
        "Poles of all orders", Chart(operational_poles(result),
                                     "A mode returns at every order; the poles of the noise scatter. A mode "
                                     "is taken where the scatter of the record's blocks leaves its pole well within its own "
                                     "half width.", "poles"))
    return report.with_assumptions(
        "The loads are random, broad and independent of the motion, and the machine does not change during the records.",
        "Intervals (95 %) hold the finite length of the records and the choice of the order. They do not hold loads that "
        "change with the motion (a cut that regenerates), sensors that load the structure, or a machine that is not linear.",
        f"Method: {result.method}, {result.duration:.4g} s.", NO_SCALE if not study.scale else f"Scale by {study.scale}.")


def answer(study: OperationalStudy) -> str:
    """Return the modes with their intervals in a sentence, and the harmonics that are none."""
    modes = study.identification.modes
    parts = [with_uncertainty(float(modes.frequency[i]), float(modes.frequency_interval[i]), "Hz")
             + f" ({100 * float(modes.damping_ratio[i]):.2g} %)" for i in range(min(modes.count, NAMED_MODES))]
    others_text = f" and {modes.count - NAMED_MODES} more" if modes.count > NAMED_MODES else ""
    text = f"{modes.count} mode{'s' * (modes.count != 1)}: {', '.join(parts)}{others_text} (95 % intervals, damping in"
    text += " brackets)."
    removed = [h for h in study.identification.harmonics if h.is_removed]
    if removed:
        names = ", ".join(f"{h.frequency:.4g} Hz" for h in removed[:NAMED_MODES])
        text += f" {len(removed)} lines of rotating parts are no modes: {names}." if len(removed) > 1 else (
            f" The line of a rotating part at {names} is no mode.")
    return text


def _mode_table(study: OperationalStudy) -> Table:
    result = study.identification
    modes, collinear = result.modes, phase_collinearity(result.modes.shape)
    rows: list[list[object]] = [
        [i + 1, Cell(float(modes.frequency[i]), uncertainty=float(modes.frequency_interval[i])),
         Cell(100 * float(modes.damping_ratio[i]), uncertainty=100 * float(modes.damping_interval[i])),
         f"{collinear[i]:.3f}", f"{100 * float(result.power_share[i]):.1f}",
         Cell("finds it too", "good") if result.confirmed[i] else Cell("does not", "doubtful")] for i in range(modes.count)]
    return Table(["mode", "frequency, Hz (95 %)", "damping, % (95 %)", "MPC", "power, %", "second method"], rows,
                 "MPC: phase collinearity, 1 for a real shape. Power: share of the motion of all channels. Second method: "
                 "pLSCF on half spectra.", digits=5)


def _harmonic_table(study: OperationalStudy) -> Table:
    rows: list[list[object]] = [
        [f"{h.frequency:.4f}", "-" if h.order is None else str(h.order), f"{100 * h.wander:.3f}", f"{100 * h.power_share:.1f}",
         Cell("taken off", "good") if h.is_removed else Cell("left in: mode or harmonic, cannot tell", "doubtful")]
        for h in study.identification.harmonics]
    return Table(["frequency, Hz", "order", "wander, %", "power, %", ""], rows,
                 "Order: multiple of the lowest rotating frequency that explains at least two lines. Power: of the "
                 "channel where it is strongest.")
