"""Frequency maps from the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from toolpoint.app import console
from toolpoint.app.poses import grid
from toolpoint.io.yaml import machine_file
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.pose_map import frequency_curves
from toolpoint.plot.figures.pose_map import frequency_map as figure
from toolpoint.studies.execute import Dask, Serial
from toolpoint.studies.pose_map import PoseMap, pose_map


def frequency_map(
    machine: Path, axes: Sequence[str], count: int = 6, workers: int = 0, folder: Path | None = None, quiet: bool = False
) -> PoseMap:
    """Return the frequencies of a machine file over a grid; axes as ``X=-0.3:0.3:21``."""
    built = machine_file.read(machine)
    positions = grid(built, axes, "--axis")
    engine = Dask(workers) if workers else Serial()
    with console.counted("blocks of poses", quiet or not console.interactive()) as progress:
        return pose_map(built, positions, count, engine, folder, progress)


def failures(found: PoseMap) -> list[str]:
    """Return a line on every pose that failed: where it is, and why."""
    names = list(found.axes)
    return [", ".join(f"{name} {found.axes[name][i]:g}" for name, i in zip(names, place, strict=True)) + f": {reason}"
            for place, reason in found.failures.items()]


def plain(found: PoseMap) -> dict[str, object]:
    """Return a map as plain numbers and text, None where a pose failed."""
    values = found.frequency.astype(object)
    values[np.isnan(found.frequency)] = None
    return {"axes": {name: v.tolist() for name, v in found.axes.items()}, "frequency_hz": values.tolist(),
            "failures": failures(found)}


def page(found: PoseMap, machine: Path) -> Report:
    """Return a page with the map of every mode over the first two axes (the others at their first position)."""
    report = Report(f"Natural frequencies over the workspace: {machine.stem}", repr(found))
    names = list(found.axes)
    values = found.frequency
    while values.ndim > 3:
        values = values[..., 0, :]
    if len(names) == 1:
        report = report.with_section("Frequencies", Chart(frequency_curves(found.axes[names[0]], values, axis=names[0])))
    else:
        made = figure(found.axes[names[0]], found.axes[names[1]], values, axes=(names[0], names[1]))
        report = report.with_section("Frequencies", Chart(made))
    if len(names) > 2:
        report = report.with_section("Cut", f"Axes {', '.join(names[2:])} stand at their first position.")
    if found.failures:
        report = report.with_section("Failed poses", Notes(failures(found), "warning"))
    return report
