"""The pages of maps over the workspace: natural frequencies, stiffness or responses of the tool against the work."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._rounding import number_text, with_uncertainty
from toolpoint.pages.remarks import with_remarks
from toolpoint.plot import Chart, Notes, Report
from toolpoint.plot.figures.machines.pose_map import frequency_curves, frequency_map, is_coarse
from toolpoint.studies.machines.pose_grid import Grid
from toolpoint.studies.machines.pose_map import PoseMap
from toolpoint.studies.machines.response_map import NAMES as DIRECTIONS
from toolpoint.studies.machines.response_map import ResponseMap
from toolpoint.studies.machines.stiffness_map import NAMES, StiffnessMap
from toolpoint.studies.robots.motion_map import MotionColumn, MotionMap

_MOTION_GROUPS: tuple[tuple[str, Callable[[MotionColumn], bool]], ...] = (
    ("Lengths", lambda column: column.unit == "mm"), ("Angles", lambda column: column.unit == "°"),
    ("Determinant", lambda column: column.name == "determinant"),
    ("Condition number", lambda column: column.name.startswith("condition")))  # sections, and the columns of each


def map_page(result: PoseMap | StiffnessMap | ResponseMap | MotionMap, name: str) -> Report:
    """Return the page of a map of frequencies, stiffness, responses or motion; name : of the machine, for the title.

    >>> from importlib.resources import files
    >>> from toolpoint.io import read_machine
    >>> from toolpoint.studies import map_frequencies
    >>> machine = read_machine(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml")
    >>> page = map_page(map_frequencies(machine, {"X": [-0.1, 0.1]}, 2), "mill")
    >>> page.summary
    'The lowest natural frequency is lowest, 21.49 Hz, at X 100 mm; it rises to 21.50 Hz at X -100 mm.'
    """
    if isinstance(result, MotionMap):
        return motion_map_page(result, name)
    if isinstance(result, ResponseMap):
        return response_map_page(result, name)
    return frequency_map_page(result, name) if isinstance(result, PoseMap) else stiffness_map_page(result, name)


def frequency_map_page(result: PoseMap, name: str) -> Report:
    """Return a page with the map of every mode over two axes: the first two with several positions, the rest at their first."""
    report = Report(f"Natural frequencies over the workspace: {name}", _extreme_sentence(
        result.grid, result.frequency[..., 0], "The lowest natural frequency", "Hz", _frequency_half_width(result)),
        subtitle=_grid_words(result))
    modes = [f"mode {i + 1}" for i in range(result.frequency.shape[-1])]
    report = _map_page(report, "Frequencies", result.grid, (result.frequency, modes, "Natural frequency, Hz"),
                       lines=[*result.extremes(), *result.uncertain()], failures=result.failures)
    exact = () if result.uncertainty is not None else ("The numbers of the machine file are taken as exact.",)
    return with_remarks(report, ["Undamped natural frequencies of the linear machine about each pose.", *exact,
                                 *result.reduction])


def stiffness_map_page(result: StiffnessMap, name: str) -> Report:
    """Return a page with maps of the tool's stiffness, N/µm, along its x, y and z and in principal directions."""
    softest = 1e-6 * result.stiffness[..., list(NAMES).index("softest direction")]
    report = Report(f"{result.kind.capitalize()} stiffness over the workspace: {name}", _extreme_sentence(
        result.grid, softest, f"The {result.kind} stiffness of the tool in its softest direction", "N/µm"),
        subtitle=_grid_words(result))
    return _map_page(report, "Stiffness", result.grid, (1e-6 * result.stiffness, list(NAMES), "Stiffness, N/µm"),
                     lines=result.extremes(), failures=result.failures).with_assumptions(
        "Of the tool against the work, along the tool's x, y and z and in principal directions; the machine is linear about "
        "each pose and its numbers are taken as exact.")


def response_map_page(result: ResponseMap, name: str) -> Report:
    """Return a page with the responses over one axis and frequency, and the greatest of each pose over two axes."""
    report = Report(f"Responses over the workspace: {name}", _extreme_sentence(
        result.grid, 1e6 * result.greatest().max(axis=-1), "The greatest receptance of the tool"
        + (f" at {result.frequency[0]:.4g} Hz" if result.frequency.size == 1 else ""), "µm/N", worst_is_high=True),
        subtitle=_grid_words(result))
    grid = result.grid
    first = next((k for k, positions in enumerate(grid.axes.values()) if len(positions) > 1), None)
    if first is not None and result.frequency.size > 1:
        name = list(grid.axes)[first]
        size = np.abs(result.values[tuple(slice(None) if k == first else 0 for k in range(len(grid.axes)))])
        others = [other for other in grid.axes if other != name]
        other_axes = f"; {', '.join(others)} at the first position" if others else ""
        chart = frequency_map(grid.shown(name), result.frequency, np.log10(1e6 * size), axes=(name, "frequency"),
                              units=(grid.unit(name), "Hz"), names=DIRECTIONS, quantity="log10 of µm/N",
                              is_logarithm=True)
        report = report.with_section("Responses over the position", f"Receptance over {name}{other_axes}.", Chart(chart))
    at_line = f" at {result.frequency[0]:.4g} Hz" if result.frequency.size == 1 else ""
    kind = "Receptance" if at_line else "Greatest receptance"
    greatest = (1e6 * result.greatest(), list(DIRECTIONS), f"{kind}, µm/N")
    report = _map_page(report, f"Response{at_line}" if at_line else "Greatest response", grid, greatest,
                       lines=result.extremes(), failures=result.failures)
    return with_remarks(report, [*result.notes, "Along the tool's x, y and z, force and motion in the same direction."])


def motion_map_page(result: MotionMap, name: str) -> Report:
    """Return a page with maps of driven axes, passive joints, parasitic shift, determinant and condition."""
    condition = result.of("condition of the tool")
    report = Report(f"Motion over the workspace: {name}", _extreme_sentence(
        result.grid, condition, "The condition number of the tool's motion", "", worst_is_high=True),
        subtitle=_grid_words(result))
    lines = result.extremes()
    for title, belongs in _MOTION_GROUPS:
        chosen = [k for k, column in enumerate(result.columns) if belongs(column)]
        if chosen:
            unit = result.columns[chosen[0]].unit
            columns = (result.shown[..., chosen], [result.columns[k].name for k in chosen], f"{title}{unit and ', '}{unit}")
            report = _map_page(report, title, result.grid, columns, lines=[lines[k] for k in chosen], failures={})
    if result.failures:
        report = report.with_section("Failed poses", Notes(result.failed(), "warning")).with_doubts(
            f"{len(result.failures)} of {int(np.prod(result.grid.shape))} poses could not be computed")
    return with_remarks(report, list(result.notes))


def _frequency_half_width(result: PoseMap) -> FloatArray | None:
    """Return the half-widths (Hz, 95 %) of the intervals of the first frequency over the grid; None without an uncertainty."""
    return None if result.uncertainty is None else result.uncertainty.interval[..., 0]


def _grid_words(result: PoseMap | StiffnessMap | ResponseMap | MotionMap) -> str:
    """Return the number of poses computed, and of those failed."""
    return f"{result.grid} poses computed" + (f", {len(result.failures)} failed" if result.failures else "")


def _extreme_sentence(grid: Grid, values: FloatArray, quantity_words: str, unit: str, half_width: FloatArray | None = None, *,
                      worst_is_high: bool = False) -> str:
    """Return the pose with the lowest value of a quantity, and with its highest, in a sentence; NaN where a pose failed.

    values, half_width : of the grid's shape, in `unit`. With `worst_is_high` the highest value comes first.
    """
    if np.isnan(values).all():
        return "No pose could be computed."
    lowest_index, highest_index = (tuple(int(i) for i in np.unravel_index(int(pick(values)), values.shape))
                                   for pick in (np.nanargmin, np.nanargmax))
    worst_index, opposite_index = (highest_index, lowest_index) if worst_is_high else (lowest_index, highest_index)
    spaced_unit = f" {unit}" if unit else ""
    # Of a map that does not change rounding alone would name a lowest and a highest pose.
    if values[highest_index] - values[lowest_index] <= 1e-6 * abs(values[highest_index]):
        return f"{quantity_words} is {number_text(float(values[lowest_index]))}{spaced_unit} at every pose."
    size = with_uncertainty(float(values[worst_index]), None if half_width is None else float(half_width[worst_index]), unit)
    words = "highest" if worst_is_high else "lowest"
    other = "falls to" if worst_is_high else "rises to"
    return (f"{quantity_words} is {words}, {size}{'' if half_width is None else ' (95 %)'}, at {grid.words(worst_index)}; it "
            f"{other} {number_text(float(values[opposite_index]))}{spaced_unit} at {grid.words(opposite_index)}.")


def _map_page(report: Report, title: str, grid: Grid, columns_shown: tuple[FloatArray, Sequence[str], str], *,
              lines: Sequence[str],
              failures: Mapping[tuple[int, ...], str]) -> Report:
    """Add a map over the first two axes with several positions; further axes stand at their first.

    columns_shown : values (grid shape, columns), names of the columns, title of the colour scale; lines : remarks on the
    extremes; failures : place in the grid to its reason.
    """
    values, columns, quantity = columns_shown
    drawn_axes = [k for k, positions in enumerate(grid.axes.values()) if len(positions) > 1][:2]
    names = [list(grid.axes)[k] for k in drawn_axes]
    values = values[tuple(slice(None) if k in drawn_axes else 0 for k in range(len(grid.axes)))]
    where = Notes(list(lines), "note", "Where it is lowest and highest")
    if not drawn_axes:
        report = report.with_section(title, where)
    elif len(drawn_axes) == 1:
        chart = frequency_curves(grid.shown(names[0]), values, axis=names[0], unit=grid.unit(names[0]), names=columns,
                                 quantity=quantity)
        report = report.with_section(title, Chart(chart), where)
    else:
        chart = frequency_map(grid.shown(names[0]), grid.shown(names[1]), values, axes=(names[0], names[1]),
                              units=(grid.unit(names[0]), grid.unit(names[1])), names=columns, quantity=quantity,
                              reasons={(index[drawn_axes[0]], index[drawn_axes[1]]): reason for index,
                                       reason in failures.items()
                                       if all(i == 0 for k, i in enumerate(index) if k not in drawn_axes)})
        report = report.with_section(title, Chart(chart, _map_caption(grid, names)), where)
    cut_axes = [name for name in grid.axes if name not in names]
    if cut_axes and names:
        report = report.with_section("Cut", f"Axes {', '.join(cut_axes)} stand at their first position.")
    if failures:
        report = report.with_section("Failed poses", Notes(grid.failure_lines(failures), "warning")).with_doubts(
            f"{len(failures)} of {int(np.prod(grid.shape))} poses could not be computed (crosses on the map)")
    return report


def _map_caption(grid: Grid, names: Sequence[str]) -> str:
    """Return a sentence on the map between its poses: interpolated, or not where the grid is coarse."""
    if is_coarse(*(len(grid.axes[name]) for name in names)):
        return "Every cell is a pose that was computed; with so few nothing is interpolated."
    return "Dots are poses that were computed; between them the contours are interpolated."
