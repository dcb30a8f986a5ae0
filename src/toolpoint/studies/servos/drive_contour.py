"""Contour error of a simulated program: columns of the path that the servo drives, places of its points, cuts and rapids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.drives.accuracy.contour import ContourError, contour_error
from toolpoint.drives.accuracy.lag import delay, estimate_lag, window_around
from toolpoint.drives.program.path import ARC_KIND, Path

SPACE = ("X", "Y", "Z")


@dataclass(frozen=True)
class DrivenColumns:
    """Columns of a path (0 to 2) that the servo's axes drive, in the servo's order; notes on axes taken as ideal."""

    columns: tuple[int, ...]
    notes: tuple[str, ...]


def match_axes(path: Path, axes: Sequence[str], *, ideal: Sequence[str] = ()) -> DrivenColumns:
    """Return which columns of the path the servo drives.

    Axes named X, Y, Z (any case) drive these; with other names they drive the first columns in order. An axis of the program
    that the servo lacks is taken as ideal where it only positions (it never moves together with the servo's axes in a cut), or
    where `ideal` names it: then it moves in step with the others, so that it adds no error of its own.

    Raises
    ------
    ToolpointError
        Where such an axis takes part in the contour and is not named; where the servo has more than three axes.
    """
    if len(axes) > len(SPACE):
        raise ToolpointError(f"drives: {len(axes)} axes; a path has three, X, Y and Z; leave the others out of the drive file")
    names = [name.upper() for name in axes]
    named = all(name in SPACE for name in names)
    columns = tuple(SPACE.index(name) for name in names) if named else tuple(range(len(axes)))
    moving = _moving_axes(path)
    # In rapids the path between the ends does not matter.
    with_servo = moving[:, columns].any(axis=1) & ~path.rapid
    notes = []
    wished = {name.upper() for name in ideal}
    unknown = sorted(wished - set(SPACE))
    if unknown:
        raise ToolpointError(f"ideal: {', '.join(unknown)}; must be axes of the program, X, Y or Z")
    for column in sorted(set(range(3)) - set(columns)):
        name, together = SPACE[column], moving[:, column] & with_servo
        if not moving[:, column].any():
            continue
        if together.any() and name not in wished:
            line = int(path.line[int(np.argmax(together))])
            raise ToolpointError(
                f"path: {name} moves together with the axes of the servo (line {line}), but the servo lacks it (it has "
                f"{', '.join(axes)}); describe it in the drive file, or take it as ideal with ideal=(\"{name}\",) "
                f"(--ideal {name})")
        notes.append(f"axis {name} is not in the drive file and is taken as ideal: it "
                     + ("moves in step with the others and adds no error of its own" if together.any()
                        else "only positions while the others stand, or in rapids"))
    return DrivenColumns(columns, tuple(notes))


def _moving_axes(path: Path) -> np.ndarray:
    """Return which of X, Y, Z every segment moves, (n, 3)."""
    moving = np.abs(path.end - path.start) > 0
    arc = np.flatnonzero(path.kind == ARC_KIND)
    # A full circle ends where it began, and moves both axes of its plane all the same.
    moving[arc[:, None], path.plane[arc]] = True
    return moving


def measure_contour(path: Path, time: FloatArray, place: FloatArray, *, actual: FloatArray, columns: Sequence[int]
                    ) -> ContourError:
    """Return the contour error of simulated points.

    Parameters
    ----------
    path : Path
        As programmed.
    time : (n,) floats
        s.
    place : (n,) floats
        Arc length of the set point along the path at each time, m.
    actual : (n, n_axes) floats
        Of the servo's axes, m, in the path's coordinates; the others move with the set point that belongs to these.
    """
    driven = list(columns)
    # Lag along the path is no contour error: ideal axes are placed where the others, being late, have got to.
    lag = estimate_lag(time, path.at(place)[:, driven], actual)
    delayed_place = delay(time, place[:, None], lag)[:, 0]
    expected = path.at(delayed_place)
    points = expected.copy()
    points[:, driven] = actual
    return contour_error(path, points, delayed_place, window=window_around(expected, points))


def is_cutting(path: Path, error: ContourError) -> np.ndarray:
    """Return the mask of instants whose foot lies on a cutting segment, (n,) bools."""
    # A foot on the very end of the path belongs to its last segment.
    ends = np.cumsum(path.lengths)
    segment = np.minimum(np.searchsorted(ends, error.progress, side="left"), path.count - 1)
    return ~path.rapid[segment]
