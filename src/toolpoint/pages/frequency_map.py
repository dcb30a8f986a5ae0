"""The pages of maps over the workspace: natural frequencies, or the stiffness of the tool against the work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from toolpoint._check import FloatArray
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.machines.pose_grid import Grid
from toolpoint.studies.machines.pose_map import PoseMap
from toolpoint.studies.machines.stiffness_map import NAMES, StiffnessMap


def map_page(result: PoseMap | StiffnessMap, name: str) -> Report:
    """Return the page of a map of either kind."""
    return frequency_map_page(result, name) if isinstance(result, PoseMap) else stiffness_map_page(result, name)


def frequency_map_page(result: PoseMap, name: str) -> Report:
    """Return a page with the map of every mode over the first two axes (the others at their first position)."""
    report = Report(f"Natural frequencies over the workspace: {name}", repr(result))
    modes = [f"mode {i + 1}" for i in range(result.frequency.shape[-1])]
    return _map_page(report, "Frequencies", result.grid, (result.frequency, modes, "Natural frequency, Hz"),
                     lines=result.extremes(), failures=result.failures)


def stiffness_map_page(result: StiffnessMap, name: str) -> Report:
    """Return a page with the map of the stiffness along the tool's axes and in principal directions."""
    report = Report(f"{result.kind.capitalize()} stiffness over the workspace: {name}",
                    repr(result) + ". Along the tool's x, y and z, and in the softest, middle and stiffest direction.")
    return _map_page(report, "Stiffness", result.grid, (1e-6 * result.stiffness, list(NAMES), "Stiffness, N/um"),
                     lines=result.extremes(), failures=result.failures)


def _map_page(report: Report, title: str, grid: Grid, shown: tuple[FloatArray, Sequence[str], str], *, lines: Sequence[str],
              failures: Mapping[tuple[int, ...], str]) -> Report:
    values, columns, quantity = shown
    names = list(grid.axes)
    while values.ndim > 3:
        values = values[..., 0, :]
    if len(names) == 1:
        chart = frequency_curves(grid.shown(names[0]), values, axis=names[0], unit=grid.unit(names[0]), names=columns,
                                 quantity=quantity)
    else:
        chart = frequency_map(grid.shown(names[0]), grid.shown(names[1]), values, axes=(names[0], names[1]),
                              units=(grid.unit(names[0]), grid.unit(names[1])), names=columns, quantity=quantity,
                              reasons=failures if len(names) == 2 else None)
    report = report.with_section(title, Chart(chart), Notes(list(lines), "note", "Where it is lowest and highest"))
    if len(names) > 2:
        report = report.with_section("Cut", f"Axes {', '.join(names[2:])} stand at their first position.")
    if failures:
        report = report.with_section("Failed poses", Notes(grid.failure_lines(failures), "warning"))
    return report
