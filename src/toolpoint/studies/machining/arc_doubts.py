"""Doubts about arcs of cut that the spacing of the dexels leaves open, and what those do to limits next to a depth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.studies.execute import Threads, execute
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.margins import PlaceMargins

MAX_UNDOUBTED_ARC_ERROR = np.radians(0.5)  # rad: arcs that are known less well are doubted
MAX_ASKED_PLACES = 5  # nearest to their limits, solved again with a shorter and a longer arc
_WALL_REACH = np.radians(1.0)  # rad: an end so near to 0 or 180 degrees lies on a wall and does not move with the error
_MIN_ARC = np.radians(0.5)  # rad


def question_arcs(error: float, judged: JudgedPlaces | None, spacing: float, *, folder: Path | None = None
                  ) -> tuple[list[Doubt], list[str]]:
    """Return doubts and notes about arcs of cut that are known within an error (rad) at a spacing of the dexels (m).

    The limits of the places nearest to theirs are solved with arcs shorter and longer by the error: where the depth lies
    between them the verdict is doubted.

    folder : where solved cuts are kept.
    """
    doubts, degrees = list[Doubt](), np.degrees(error)
    remedy = f"a spacing of about {1e3 * spacing * min(MAX_UNDOUBTED_ARC_ERROR / error, 0.5):.2g} mm"
    if error > MAX_UNDOUBTED_ARC_ERROR:
        doubts.append(Doubt("arcs of cut", f"known within {degrees:.1f}° only (95 % of the places, from a run with twice the "
                            f"spacing of {1e3 * spacing:.3g} mm)", f"{remedy} should carry 0.5°", figure=error))
    if judged is None:
        return doubts, []
    places, notes = _nearest(judged).tolist(), list[str]()
    for k, (m, (lower, upper)) in enumerate(zip(places, _limits(judged, places, error, folder=folder), strict=True)):
        line, depth = int(judged.laid.path.line[judged.block[m]]), float(judged.arcs.depth[m])
        words = (f"an arc known within {degrees:.2g}° leaves its limit between {1e3 * lower:.3g} and "
                 f"{1e3 * upper:.3g} mm" if np.isfinite(upper) else
                 f"an arc known within {degrees:.2g}° leaves its limit above {1e3 * lower:.3g} mm, or none near its depth")
        if lower <= depth <= upper:
            doubts.append(Doubt("verdict", f"line {line}: {words}, on both sides of its depth of {1e3 * depth:.3g} mm",
                                f"{remedy}, or more in hand", figure=abs(depth / lower - 1) if lower > 0 else 1.0))
        if k == 0:
            notes.append(f"Line {line}, the place nearest to its limit: {words}.")
    return doubts, notes


def _nearest(judged: JudgedPlaces) -> np.ndarray:
    """Return the places whose limits are nearest to their depths, one a line of the program; those that have a limit."""
    margins: PlaceMargins = judged.margins
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.abs(np.log(margins.limit / judged.arcs.depth))
    order = np.argsort(np.where(np.isfinite(distance), distance, np.inf), kind="stable")
    order = order[np.isfinite(distance[order])]
    lines = judged.laid.path.line[judged.block[order]]
    return np.asarray(order[np.sort(np.unique(lines, return_index=True)[1])][:MAX_ASKED_PLACES])


def _limits(judged: JudgedPlaces, places: Sequence[int], error: float, *, folder: Path | None) -> list[tuple[float, float]]:
    """Return the lower and the upper of the limits (m) of places whose arcs are longer and shorter by an error."""
    points, owners = list[list[float]](), list[int]()
    for k, m in enumerate(places):
        block, depth = int(judged.block[m]), float(judged.arcs.depth[m])
        for first, last in _arcs_within(float(judged.arcs.entry[m]), float(judged.arcs.exit[m]), error):
            points.append([float(judged.laid.tool[block]), float(judged.pose[judged.arcs.place[m]]), first, last,
                           float(judged.arcs.angle[m]), float(judged.laid.speed[block]), depth])
            owners.append(k)
    limits = [[float(judged.margins.limit[m])] for m in places]
    outcomes = execute(judged.solver, points, Threads(), folder=None if folder is None else folder / "arcs").outcomes \
        if points else ()
    for k, outcome in zip(owners, outcomes, strict=True):
        if outcome.values is not None:
            limits[k].append(float(outcome.values["limit"]))
    return [(min(values), max(values)) for values in limits]


def _arcs_within(entry: float, leave: float, error: float) -> list[tuple[float, float]]:
    """Return the arcs shorter and longer by an error at the ends that do not lie on a wall."""
    is_free = entry > _WALL_REACH, leave < np.pi - _WALL_REACH
    share = error / max(sum(is_free), 1)
    arcs = [(max(entry - sign * share * is_free[0], 0.0), min(leave + sign * share * is_free[1], float(np.pi)))
            for sign in (-1.0, 1.0)]
    return [arc for arc in arcs if arc[1] - arc[0] >= _MIN_ARC]
