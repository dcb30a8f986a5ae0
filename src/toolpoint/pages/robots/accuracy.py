"""The page of a milling accuracy: errors along every side, spectra, means, and for which loads they hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.screening import error_curves, error_spectrum
from toolpoint.studies.accuracy.milling_accuracy import COORDINATES, MillingAccuracy, SideAccuracy

_SHOWN = 3000  # samples of the middle of a side that are drawn


def accuracy_page(result: MillingAccuracy, teeth: int, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a milling accuracy."""
    report = Report(f"Milling accuracy: {result.machine}", repr(result), subtitle=f"Loads: {result.loads}")
    rows = [[s.name, 1e6 * s.position_error, 1e6 * s.rotation_error,
             *(1e6 * s.error.std(axis=0)).tolist()] for s in result.sides]
    table = Table(["side", "position, um", "rotation, urad", *(f"{c} rms" for c in COORDINATES)], rows,
                  "Mean radii of the error spheres, and the root mean square of every coordinate (um, urad)")
    report = report.with_section("Errors", table, Notes([result.status], "note", "Step and spacing"))
    for side in result.sides:
        report = _side(report, side, result.setup.speed / 60 * teeth)
    notes = list(dict.fromkeys(note for side in result.sides for note in side.notes))
    return with_remarks(report, [*notes, *warnings])


def _side(report: Report, side: SideAccuracy, tooth: float) -> Report:
    middle = len(side.time) // 2
    part = slice(max(0, middle - _SHOWN // 2), middle + _SHOWN // 2)
    curves = error_curves(1e3 * side.length[part], 1e6 * side.error[part, :3], names=COORDINATES[:3],
                          quantity="Position error, um")
    turns = error_curves(1e3 * side.length[part], 1e6 * side.error[part, 3:], names=COORDINATES[3:],
                         quantity="Rotation error, urad")
    frequency, amplitude = side.spectrum()
    low = frequency <= 5 * tooth
    step = max(1, int(low.sum()) // 4000)
    lines = error_spectrum(frequency[low][::step], 1e6 * _peaks(amplitude[low][:, :3], step), names=COORDINATES[:3],
                           quantity="Amplitude, um", tooth=tooth)
    return report.with_section(side.name.capitalize(), Chart(curves), Chart(turns), Chart(lines))


def _peaks(values: FloatArray, step: int) -> FloatArray:
    """Largest value of every group of lines, so that no peak is lost in drawing."""
    count = -(-len(values) // step)
    padded = np.concatenate([values, np.zeros((count * step - len(values), values.shape[1]))])
    return padded.reshape(count, step, -1).max(axis=1)
