"""The page of a servo over the workspace: ranges, a chart of every quantity that changes, failed poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot import Chart, Report, Table
from toolpoint.plot.figures.machines.pose_map import frequency_curves, frequency_map
from toolpoint.studies.machines.pose_grid import Grid
from toolpoint.studies.machines.pose_words import position_words
from toolpoint.studies.servos.servo_map import QUANTITIES, ServoMap

# A map of less change than this share would show rounding, not the machine.
_MIN_MAP_CHANGE = 1e-3


def servo_map_page(result: ServoMap, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of a map over a grid of one or two axes; `warnings` are those of the run.

    Examples
    --------
    Runs in ``examples/map_a_servo_over_the_workspace.py``.
    """
    report = Report(f"Servo over the workspace: {result.name}", _answer(result),
                    subtitle=f"{len(result.poses)} poses, axes {', '.join(result.axes)}")
    table = Table(["quantity", "axis", "smallest", "largest"], result.rows())
    report = report.with_section("Range over the poses", table)
    for key, words, factor in QUANTITIES:
        values, names = result.columns(key, factor)
        if not np.isfinite(values).any():
            continue
        heading = words.split(",")[0]
        if np.all(np.nanmax(values, axis=0) - np.nanmin(values, axis=0) <= _MIN_MAP_CHANGE
                  * np.abs(np.nanmean(values, axis=0))):
            report = report.with_section(heading, f"The same at every pose to {100 * _MIN_MAP_CHANGE:g} %: see the table.")
        else:
            report = report.with_section(heading, _chart(result, values, names, words))
    return report.with_doubts(*result.doubts(), *warnings).with_assumptions(
        "The loops are linear: friction, backlash and limits of torque are not in margins and bandwidths.",
        "At each pose the structure is that of the pose; between the poses nothing is known.")


def _answer(result: ServoMap) -> str:
    """Return the number of stable poses and the place of the least phase margin."""
    stable = int(result.stable.sum())
    words = f"{stable} of {len(result.poses)} poses are stable"
    if not np.isfinite(result.velocity_phase_margin).any():
        return f"{words}; no margin could be computed."
    pose, axis = result.worst()
    place = ", ".join(f"{name} {position_words(value, name in result.angles)}" for name, value in result.poses[pose].items())
    lowest_margin = float(np.nanmin(result.velocity_phase_margin))
    return (f"{words}; the least phase margin of a velocity loop is {lowest_margin:.1f}° (axis {axis}, "
            f"{place or 'reference pose'}).")


def _chart(result: ServoMap, values: FloatArray, names: tuple[str, ...], words: str) -> Chart:
    """Return the chart of a quantity (n_poses, n_columns): curves over one axis, a map over two."""
    axes = list(result.grid)
    grid = Grid(result.grid, result.angles)
    units, positions = [grid.unit(axis) for axis in axes], [grid.shown(axis) for axis in axes]
    if len(axes) == 1:
        return Chart(frequency_curves(positions[0], values, axis=axes[0], unit=units[0], names=names, quantity=words))
    shaped = values.reshape(len(positions[0]), len(positions[1]), -1)
    return Chart(frequency_map(positions[0], positions[1], shaped, axes=(axes[0], axes[1]), units=(units[0], units[1]),
                               names=names, quantity=words))
