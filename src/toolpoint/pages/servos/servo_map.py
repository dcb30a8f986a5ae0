"""The page of a servo over the workspace: ranges, a chart of every quantity that changes, failed poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.servos.servo_map import QUANTITIES, ServoMap

# A map of less change than this share would show rounding, not the machine.
_FLAT = 1e-3


def servo_map_page(result: ServoMap, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a map over a grid of one or two axes; `warnings` are those of the run."""
    report = Report(f"Servo over the workspace: {result.name}", repr(result))
    table = Table(["quantity", "axis", "smallest", "largest"], result.rows())
    report = report.with_section("Range over the poses", table)
    for key, words, factor in QUANTITIES:
        values, names = result.columns(key, factor)
        if not np.isfinite(values).any():
            continue
        heading = words.split(",")[0]
        if np.all(np.nanmax(values, axis=0) - np.nanmin(values, axis=0) <= _FLAT * np.abs(np.nanmean(values, axis=0))):
            report = report.with_section(heading, f"The same at every pose to {100 * _FLAT:g} %: see the table.")
        else:
            report = report.with_section(heading, _chart(result, values, names, words))
    notes = [*result.notes(), *dict.fromkeys(warnings)]
    return report.with_section("Failed poses and warnings", Notes(notes, "warning")) if notes else report


def _chart(result: ServoMap, values: FloatArray, names: tuple[str, ...], words: str) -> Chart:
    axes = list(result.grid)
    units = ["deg" if axis in result.angles else "m" for axis in axes]
    positions = [np.degrees(at) if axis in result.angles else at for axis, at in result.grid.items()]
    if len(axes) == 1:
        return Chart(frequency_curves(positions[0], values, axis=axes[0], unit=units[0], names=names, quantity=words))
    shaped = values.reshape(len(positions[0]), len(positions[1]), -1)
    return Chart(frequency_map(positions[0], positions[1], shaped, axes=(axes[0], axes[1]), units=(units[0], units[1]),
                               names=names, quantity=words))
