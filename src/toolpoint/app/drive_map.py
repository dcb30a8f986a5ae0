"""`toolpoint drive --map`: margins, bandwidth and circular deviation of a servo over the workspace of its machine."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.app import console
from toolpoint.app.drive_servo import held_on, servo_on
from toolpoint.app.poses import grid as grid_of
from toolpoint.io.yaml import drive_file, machine_file
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.servo_map import ServoMap, servo_map

# A map of less change than this share would show rounding, not the machine.
_FLAT = 1e-3
_QUANTITIES = (("velocity_phase_margin", "Phase margin of the velocity loop, °", 1.0),
               ("velocity_gain_margin", "Gain margin of the velocity loop, dB", 1.0),
               ("phase_margin", "Phase margin of the position loop, °", 1.0),
               ("bandwidth", "Bandwidth of the position loop, Hz", 1.0),
               ("circular_deviation", "Circular deviation at the tool point, µm", 1e6))


def drive_map(drives: Path, machine: Path | None, axes: Sequence[str], circle: tuple[float, float] | None = None,
              output: Path = Path("toolpoint-report"), quiet: bool = False) -> ServoMap:
    """Return the servo over a grid of poses, print its table and write its page.

    Parameters
    ----------
    axes : sequence of str
        ``X=-0.3:0.3:7``: axis of the machine, first and last position (m), number of positions; one or two axes.
    circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle simulated at every pose.
    """
    if machine is None:
        raise ToolpointError("--map: a map needs the machine; give --machine FILE")
    described, built = drive_file.read(drives), machine_file.read(machine)
    grid = grid_of(built, axes, "--map")
    if len(grid) > 2:
        raise ToolpointError(f"--map: {len(grid)} axes; a map has one or two")
    if min(at.size for at in grid.values()) < 2:
        raise ToolpointError(f"--map: {' '.join(axes)}; needs two positions or more of each axis")
    free, boundaries, tools = held_on(described, built)
    poses = [dict(zip(grid, values, strict=True)) for values in product(*grid.values())]
    with console.collected_warnings() as warnings:
        servo_on(described, None)
        with console.counted("poses", quiet or not console.interactive()) as progress:
            found = servo_map(free, poses, boundaries, tools, lambda structure: servo_on(described, structure, False), circle,
                              progress)
    saved = _page(found, grid, described.name, list(warnings)).save(output)
    if not quiet:
        console.table(repr(found), ["quantity", "axis", "smallest", "largest"], _rows(found))
        for words in dict.fromkeys(warnings):
            console.ERR.print("warning: " + words, markup=False, style="yellow")
        console.OUT.print(f"Page written: {saved}", markup=False)
    return found


def _values(found: ServoMap, key: str, factor: float) -> tuple[FloatArray, tuple[str, ...]]:
    values = factor * getattr(found, key)
    return (values[:, None], ("tool point",)) if values.ndim == 1 else (values, found.axes)


def _rows(found: ServoMap) -> list[list[str]]:
    rows = []
    for key, words, factor in _QUANTITIES:
        values, names = _values(found, key, factor)
        for k, name in enumerate(names):
            if np.isfinite(values[:, k]).any():
                rows.append([words, name, f"{np.nanmin(values[:, k]):.2f}", f"{np.nanmax(values[:, k]):.2f}"])
    return rows


def _page(found: ServoMap, grid: dict[str, FloatArray], name: str, warnings: list[str]) -> Report:
    report = Report(f"Servo over the workspace: {name}", repr(found))
    rows = _rows(found)
    report = report.with_section("Range over the poses", Table(["quantity", "axis", "smallest", "largest"], rows))
    names = list(grid)
    for key, words, factor in _QUANTITIES:
        values, axes = _values(found, key, factor)
        if not np.isfinite(values).any():
            continue
        heading = words.split(",")[0]
        if np.all(np.nanmax(values, axis=0) - np.nanmin(values, axis=0) <= _FLAT * np.abs(np.nanmean(values, axis=0))):
            report = report.with_section(heading, f"The same at every pose to {100 * _FLAT:g} %: see the table.")
            continue
        if len(names) == 1:
            made = frequency_curves(grid[names[0]], values, axis=names[0], names=axes, quantity=words)
        else:
            shaped = values.reshape(len(grid[names[0]]), len(grid[names[1]]), -1)
            made = frequency_map(grid[names[0]], grid[names[1]], shaped, axes=(names[0], names[1]), names=axes, quantity=words)
        report = report.with_section(heading, Chart(made))
    notes = [f"{found.poses[k]}: {words}" for k, words in found.failures.items()]
    notes += [f"{found.poses[k]}: unstable" for k in np.flatnonzero(~found.stable) if k not in found.failures]
    if notes or warnings:
        report = report.with_section("Failed poses and warnings", Notes([*notes, *dict.fromkeys(warnings)], "warning"))
    return report
