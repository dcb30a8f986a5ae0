"""Error spheres along a path: the mean radius of the position error over short pieces of each side, at their places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail
from toolpoint.studies.accuracy.side_run import SideAccuracy

MIN_TEETH_PER_SPHERE = 10  # tooth periods that a sphere averages over at least


@dataclass(frozen=True, eq=False)
class ErrorSpheres:
    """Spheres of a side: `centres` (n, 3) and `radii` (n,) in m, and the `course` of the tool (k, 3), m, in machine axes."""

    centres: FloatArray
    radii: FloatArray
    course: FloatArray


def spheres_along(side: SideAccuracy, tooth: float, *, number: int = 20) -> ErrorSpheres:
    """Return the error spheres of a side: mean radii (26) over up to `number` pieces of equal time.

    Parameters
    ----------
    side : SideAccuracy
        Of `mill_side` or `mill_path`.
    tooth : float
        Tooth-passing frequency, Hz: a sphere averages over ten periods at least.
    number : int

    Raises
    ------
    ToolpointError
        For a side without its path.

    Examples
    --------
    >>> from toolpoint.studies import line
    >>> side = SideAccuracy("side 1", (0.0, 1.0), np.linspace(0, 1, 101), np.linspace(0, 0.1, 101), np.zeros((101, 6)),
    ...                     np.zeros((0, 6)), 0.0, None, path=line((0, 0, 0), (0.1, 0, 0))[0])
    >>> spheres_along(side, 100.0, number=4).centres[:, 0].round(4).tolist()
    [0.0125, 0.038, 0.063, 0.088]
    """
    count("number", number)
    if side.path is None:
        fail("side", f"{side.name} without its path", "must know where its lengths are", remedy="take it from mill_side")
    pieces = int(np.clip(side.duration * tooth / MIN_TEETH_PER_SPHERE, 1, min(number, len(side.time))))
    parts = np.array_split(np.arange(len(side.time)), pieces)
    centres = side.path.points(np.array([side.length[part].mean() for part in parts]))
    radii = np.array([side.position_radius[part].mean() for part in parts])
    return ErrorSpheres(centres, radii, side.path.points(np.linspace(0.0, side.path.length, 200)))
