"""The pages of maps over the workspace: natural frequencies, stiffness or responses of the tool against the work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.pose_map import frequency_curves, frequency_map
from toolpoint.studies.machines.pose_grid import Grid
from toolpoint.studies.machines.pose_map import PoseMap
from toolpoint.studies.machines.response_map import NAMES as DIRECTIONS
from toolpoint.studies.machines.response_map import ResponseMap
from toolpoint.studies.machines.stiffness_map import NAMES, StiffnessMap


def map_page(result: PoseMap | StiffnessMap | ResponseMap, name: str) -> Report:
    """Return the page of a map of any kind."""
    if isinstance(result, ResponseMap):
        return response_map_page(result, name)
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


def response_map_page(result: ResponseMap, name: str) -> Report:
    """Return a page with the responses over the lines and the first axis, and the greatest of each pose over two axes."""
    report = Report(f"Responses over the workspace: {name}",
                    repr(result) + ". Along the tool's x, y and z; force and motion in the same direction.")
    grid = result.grid
    first = next((k for k, at in enumerate(grid.axes.values()) if len(at) > 1), None)
    if first is not None:
        name = list(grid.axes)[first]
        size = np.abs(result.values[tuple(slice(None) if k == first else 0 for k in range(len(grid.axes)))])
        others = [other for other in grid.axes if other != name]
        rest = f"; {', '.join(others)} at the first position" if others else ""
        chart = frequency_map(grid.shown(name), result.frequency, np.log10(1e6 * size), axes=(name, "frequency"),
                              units=(grid.unit(name), "Hz"), names=DIRECTIONS, quantity="log10 of um/N")
        report = report.with_section("Responses over the position", f"Receptance over {name}{rest}.", Chart(chart))
    greatest = (1e6 * result.greatest(), list(DIRECTIONS), "Greatest receptance, um/N")
    report = _map_page(report, "Greatest response", grid, greatest, lines=result.extremes(), failures=result.failures)
    return with_remarks(report, result.notes)


def _map_page(report: Report, title: str, grid: Grid, shown: tuple[FloatArray, Sequence[str], str], *, lines: Sequence[str],
              failures: Mapping[tuple[int, ...], str]) -> Report:
    """Add a map over the first two axes of several positions; further ones stand at their first."""
    values, columns, quantity = shown
    drawn = [k for k, at in enumerate(grid.axes.values()) if len(at) > 1][:2]
    names = [list(grid.axes)[k] for k in drawn]
    values = values[tuple(slice(None) if k in drawn else 0 for k in range(len(grid.axes)))]
    where = Notes(list(lines), "note", "Where it is lowest and highest")
    if not drawn:
        report = report.with_section(title, where)
    elif len(drawn) == 1:
        chart = frequency_curves(grid.shown(names[0]), values, axis=names[0], unit=grid.unit(names[0]), names=columns,
                                 quantity=quantity)
        report = report.with_section(title, Chart(chart), where)
    else:
        chart = frequency_map(grid.shown(names[0]), grid.shown(names[1]), values, axes=(names[0], names[1]),
                              units=(grid.unit(names[0]), grid.unit(names[1])), names=columns, quantity=quantity,
                              reasons={(index[drawn[0]], index[drawn[1]]): reason for index, reason in failures.items()
                                       if all(i == 0 for k, i in enumerate(index) if k not in drawn)})
        report = report.with_section(title, Chart(chart), where)
    rest = [name for name in grid.axes if name not in names]
    if rest and names:
        report = report.with_section("Cut", f"Axes {', '.join(rest)} stand at their first position.")
    if failures:
        report = report.with_section("Failed poses", Notes(grid.failure_lines(failures), "warning"))
    return report
