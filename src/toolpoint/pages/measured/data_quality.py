"""Parts of an identification's page that judge data and shapes: coherence, reciprocity, phase collinearity, AutoMAC."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.modal_identification import Identification, phase_collinearity
from toolpoint.plot import Cell, Chart, Report, Table
from toolpoint.plot.figures.measured.correlation import mac_matrix
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.figures.measured.identification import argand_by_mode, coherence_range
from toolpoint.signals.checks import Reciprocity, reciprocity
from toolpoint.vibration.correlation import auto_mac

_DRAWN_RECIPROCAL_PAIRS = 3  # reciprocal pairs that are drawn, the worst first
_MIN_REAL_COLLINEARITY = 0.9  # phase collinearity below which a shape is called complex


def with_quality_of_data(report: Report, result: Identification) -> Report:
    """Return the report with coherence and reciprocity, or the reason for their absence."""
    frf = result.frf
    if frf.coherence is not None:
        lowest = np.unravel_index(int(np.argmin(frf.coherence.mean(axis=0))), frf.coherence.shape[1:])
        words = f"Lowest on average: {frf.outputs[int(lowest[0])]} / {frf.inputs[int(lowest[1])]}, " \
                f"{float(frf.coherence.mean(axis=0)[lowest]):.3f}."
        report = report.with_section("Coherence", words, Chart(coherence_range(frf), name="coherence"))
    else:
        words = ("The files hold no coherence: nothing tells noise from a structure that is not linear. Measure it with the "
                 "responses.")
        report = report.with_section("Coherence", words)
    pairs = sorted(reciprocity(frf), key=lambda pair: pair.agreement)
    if not pairs:
        words = ("No two points were both struck and measured, so reciprocity cannot be checked: strike at a sensor's place "
                 "and measure where it was struck.")
        return report.with_section("Reciprocity", words)
    charts = [_pair_chart(result, pair) for pair in pairs[:_DRAWN_RECIPROCAL_PAIRS]]
    return report.with_section("Reciprocity", _reciprocity_table(pairs), *charts)


def _reciprocity_table(pairs: Sequence[Reciprocity]) -> Table:
    rows = [[str(p.first), str(p.second), f"{p.agreement:.3f}", f"{p.ratio:.3f}",
             Cell("holds", "good") if p.holds else Cell("does not hold", "doubtful")] for p in pairs]
    return Table(["first", "second", "agreement", "ratio of sizes", ""], rows,
                 "H(first, second) beside H(second, first): agreement 1 and ratio 1 where both are right")


def _pair_chart(result: Identification, pair: Reciprocity) -> Chart:
    frf = result.frf
    curves = {}
    for a, b in ((pair.first, pair.second), (pair.second, pair.first)):
        curves[f"{a} / {b}"] = frf.selected([frf.outputs.index(a)], [frf.inputs.index(b)])
    return Chart(bode(curves, title=f"{pair.first} and {pair.second}, agreement {pair.agreement:.3f}"))


def with_phase_collinearity(report: Report, result: Identification) -> Report:
    """Return the report with the Argand plots and AutoMAC; of one response both say nothing."""
    modes = result.modes
    if len(modes.dofs) < 2:
        return report
    collinear = phase_collinearity(modes.shape)
    labels = [f"{i + 1}: {f:.2f} Hz, MPC {c:.3f}" for i, (f, c) in enumerate(zip(modes.frequency, collinear, strict=True))]
    complex_ = [labels[i] for i in np.flatnonzero(collinear < _MIN_REAL_COLLINEARITY)]
    words = "All shapes are nearly real (MPC above 0.9)."
    if complex_:
        words = (f"Shapes that are not real (MPC below 0.9): {'; '.join(complex_)}. Real causes are local damping and "
                 "gyroscopic bodies; neighbours that are not told apart and sensors with a delay look the same.")
    report = report.with_section("Phase collinearity", words, argand_by_mode(np.asarray(modes.shape, complex), labels))
    return report.with_section("AutoMAC", Chart(mac_matrix(auto_mac(modes.shape), modes, modes), name="automac"))
