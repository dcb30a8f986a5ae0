"""The page of a milling accuracy: errors along every side, spectra, means, and for which loads they hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._rounding import number_text
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.machines.screening import error_curves, error_spectrum, sphere_path
from toolpoint.studies.accuracy.error_spheres import spheres_along
from toolpoint.studies.accuracy.milling_accuracy import COORDINATES, MillingAccuracy, SideAccuracy

LARGEST_SPHERE_SHARE = 0.04  # drawn radius of the largest sphere over the extent of the path
_DRAWN_SIDE_SAMPLES = 3000  # samples of the middle of a side that are drawn


def accuracy_page(result: MillingAccuracy, teeth: int, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a milling accuracy.

    Examples
    --------
    Runs in ``examples/mill_a_square_with_a_robot.py``.
    """
    report = Report(f"Milling accuracy: {result.machine}", _answer(result), subtitle=f"Loads: {result.loads}")
    rows = [[s.name, 1e6 * s.position_error, 1e6 * s.rotation_error,
             *(1e6 * s.error.std(axis=0)).tolist()] for s in result.sides]
    table = Table(["side", "position, µm", "rotation, µrad", *(f"{c} rms" for c in COORDINATES)], rows,
                  "Mean radii of the error spheres, and the root mean square of every coordinate (µm, µrad)")
    report = report.with_section("Errors", table, Notes([result.numerics], "note", "Step and spacing"))
    if all(side.path is not None for side in result.sides):
        report = _spheres(report, result.sides, result.setup.speed / 60 * teeth)
    for side in result.sides:
        report = _side(report, side, result.setup.speed / 60 * teeth)
    return with_remarks(report, [*result.notes, f"Loads that count: {result.loads}; the other ones are left out.",
                                 "Dynamics and cutting coefficients are taken as exact."], warnings)


def _answer(result: MillingAccuracy) -> str:
    """Return the largest mean error over the sides, and what step and spacing change in it."""
    worst_side = max(result.sides, key=lambda side: side.position_error)
    share = (f" (step and spacing leave at most about {100 * worst_side.halving:.1g} %)" if np.isfinite(worst_side.halving)
             else "")
    mean = float(np.linalg.norm(worst_side.mean_deflection[:3]))
    doubted = " and ".join(dict.fromkeys(doubt.what for doubt in result.doubts))
    begin = f"Doubtful ({doubted}, see below): the" if doubted else "The"
    return (f"{begin} tool moves {number_text(1e6 * worst_side.position_error, digits=3)} µm, on average along the worst side, "
            f"{worst_side.name}{share}, and {number_text(1e6 * worst_side.rotation_error, digits=3)} µrad about its mean "
            f"deflection, which is {number_text(1e6 * mean, digits=3)} µm and taken out.")


def _spheres(report: Report, sides: Sequence[SideAccuracy], tooth: float) -> Report:
    """Return the report with the error spheres of all sides along the path."""
    spheres = [spheres_along(side, tooth) for side in sides]
    courses = np.concatenate([part.course for part in spheres])
    # Seen along the machine's axis over which the path extends least.
    first, second = sorted(np.argsort(-np.ptp(courses, axis=0), kind="stable")[:2].tolist())
    centres = 1e3 * np.concatenate([part.centres for part in spheres])[:, [first, second]]
    radii = 1e6 * np.concatenate([part.radii for part in spheres])
    extent = 1e3 * float(np.ptp(courses, axis=0).max())
    scale = float(f"{LARGEST_SPHERE_SHARE * extent / max(1e-3 * float(radii.max()), 1e-12):.1g}")
    chart = sphere_path([1e3 * part.course[:, [first, second]] for part in spheres], centres, radii,
                        axes=(f"{'xyz'[first]}, mm", f"{'xyz'[second]}, mm"), scale=scale, quantity="radius, µm")
    times = "at the size of" if scale == 1 else f"{scale:,g} times the size of"
    words = f"Circles are drawn {times} the mean errors that they stand for."
    return report.with_section("Error spheres along the path", Notes([words], "note", "Scale"), Chart(chart))


def _side(report: Report, side: SideAccuracy, tooth: float) -> Report:
    """Return the report with errors over the path and their spectrum, for one side."""
    middle_sample = len(side.time) // 2
    drawn = slice(max(0, middle_sample - _DRAWN_SIDE_SAMPLES // 2), middle_sample + _DRAWN_SIDE_SAMPLES // 2)
    curves = error_curves(1e3 * side.length[drawn], 1e6 * side.error[drawn, :3], names=COORDINATES[:3],
                          quantity="Position error, µm")
    turns = error_curves(1e3 * side.length[drawn], 1e6 * side.error[drawn, 3:], names=COORDINATES[3:],
                         quantity="Rotation error, µrad")
    frequency, amplitude = side.spectrum()
    is_low = frequency <= 5 * tooth
    # Peaks of groups of lines are drawn: a curve of all lines is slow, and one of each n-th would lose peaks.
    step = max(1, int(is_low.sum()) // 4000)
    lines = error_spectrum(frequency[is_low][::step], 1e6 * _peaks(amplitude[is_low][:, :3], step), names=COORDINATES[:3],
                           quantity="Amplitude, µm", tooth=tooth)
    return report.with_section(side.name.capitalize(), Chart(curves), Chart(turns), Chart(lines))


def _peaks(values: FloatArray, step: int) -> FloatArray:
    """Return the largest value of every group of lines, so that no peak is lost in drawing."""
    count = -(-len(values) // step)
    padded = np.concatenate([values, np.zeros((count * step - len(values), values.shape[1]))])
    return padded.reshape(count, step, -1).max(axis=1)
