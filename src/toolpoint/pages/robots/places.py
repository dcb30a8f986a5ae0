"""The page of a quantity over places, with the most even segments."""

from __future__ import annotations

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.plot import Chart, Notes, Report, Table, frequency_curves
from toolpoint.plot.figures.machines.place_map import place_contours
from toolpoint.studies.robots.place_map import PlaceMap, place_words
from toolpoint.studies.robots.regions import RegionSearch

_DRAWN_SEGMENTS = 3  # segments drawn in the map, the most even first


def place_page(result: PlaceMap, search: RegionSearch | None, name: str) -> Report:
    """Return the page of a map over places, with the most even segments where they were searched for.

    Examples
    --------
    Runs in ``examples/map_where_a_robot_is_even.py``.
    """
    quantity = result.quantity
    report = Report(f"{quantity.kind.capitalize()} over places: {name}", _answer(result, search),
                    subtitle=f"{np.prod(result.grid.shape)} places along {', '.join(result.grid.names)}")
    label = f"{quantity.kind.capitalize()}, {quantity.unit}"
    axes = [k for k, count in enumerate(result.grid.shape) if count > 1]
    if len(axes) == 1:
        chart = frequency_curves(1e3 * result.grid.positions[axes[0]], result.values.reshape(-1, result.values.shape[-1]),
                                 axis=result.grid.names[axes[0]], unit="mm", names=quantity.columns, quantity=label)
        report = report.with_section("Map", Chart(chart), Notes(result.extremes(), "note", "Where it is lowest and highest"))
    elif axes:
        report = report.with_section("Map", Chart(_contours(result, search, (axes[0], axes[1]))),
                                     Notes(result.extremes(), "note", "Where it is lowest and highest"))
    if search is not None:
        rows = [[i + 1, place_words(r.start), place_words(r.end), r.total, f"{100 * r.share:.2f} %"]
                for i, r in enumerate(search.regions[:8])]
        report = report.with_section("Most even segments", Table(["rank", "from", "to", f"spread, {quantity.unit}",
                                                                  "largest share"],
                                                                 rows, f"Of {len(search.regions)} segments"),
                                     Notes(search.direction_words(), "note", "Direction of the best and the worst"))
    failures = [f"{place_words(place)}: {reason}"
                for place, reason in zip(result.reach.places, result.reasons, strict=True) if reason]
    report = report.with_assumptions(
        "The machine is linear about each pose and its numbers are taken as exact.",
        "A segment is judged at the places computed along it; between them nothing is known.", *result.notes)
    return report if not failures else report.with_section(
        "Places without a value", Notes([f"{len(failures)} places", *failures[:20]], "note",
                                        "Out of reach, beyond limits, or failed"))


def _answer(result: PlaceMap, search: RegionSearch | None) -> str:
    """Return the range of the first column, and the most even segment."""
    column, unit = result.values[..., 0], result.quantity.unit
    if np.isnan(column).all():
        return "No place could be computed."
    words = (f"{result.quantity.columns[0].capitalize()}: {number_text(float(np.nanmin(column)))} to "
             f"{number_text(float(np.nanmax(column)))} {unit} over the places")
    if search is not None and search.regions:
        best = search.regions[0]
        words += (f". Most even is the segment from {place_words(best.start)} to {place_words(best.end)}, spread "
                  f"{number_text(float(best.total), digits=3)} {unit}")
    return words + "."


def _contours(result: PlaceMap, search: RegionSearch | None, axes: tuple[int, int]) -> object:
    """Return the contours of a quantity over a plane of places, further axes at their first place."""
    values, grid = result.values, result.grid
    plane_values = np.moveaxis(values, axes, (0, 1))
    while plane_values.ndim > 3:
        plane_values = plane_values[:, :, 0]
    directions = [grid.places[tuple(1 if k == axis else 0 for k in range(len(grid.shape)))] - grid.places[(0,
                                                                                                           ) * len(grid.shape)]
                  for axis in axes]
    unit_directions = np.array([d / np.linalg.norm(d) for d in directions])
    origin = grid.places[(0,) * len(grid.shape)] - sum((grid.positions[a][0] * b for a,
                                                        b in zip(axes, unit_directions, strict=True)),
                                                       np.zeros(3))
    segments = [] if search is None else [(1e3 * unit_directions @ (r.start - origin), 1e3 * unit_directions @ (r.end - origin))
                                          for r in search.regions[:_DRAWN_SEGMENTS]]
    return place_contours(1e3 * grid.positions[axes[0]], 1e3 * grid.positions[axes[1]], plane_values,
                          axes=(grid.names[axes[0]], grid.names[axes[1]]), columns=result.quantity.columns,
                          quantity=f"{result.quantity.kind.capitalize()}, {result.quantity.unit}", segments=segments)
