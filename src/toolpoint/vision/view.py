"""View of a picture: machine directions of right and down, metres a pixel, and the pixel of the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.vibration import Dof

# Right and down of the picture for each plane.
_PLANES = {"xz": ("+x", "-z"), "yz": ("+y", "-z"), "xy": ("+x", "-y")}


@dataclass(frozen=True)
class View:
    """A picture plane, seen from afar (parallel projection).

    Parameters
    ----------
    right, down : str
        Directions of the machine (``+x`` .. ``-z``) in which columns and rows of the picture increase.
    scale : float
        Metres a pixel; None where unknown: shapes then stay in pixels.
    origin : (column, row)
        Where the machine's origin is seen, pixels.

    >>> View(right="+x", down="-z", scale=2e-4).scale  # m a pixel
    0.0002
    """

    right: str = "+x"
    down: str = "-z"
    scale: float | None = None
    origin: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        first, second = Dof("p", self.right), Dof("p", self.down)
        if first.is_rotation or second.is_rotation or first.direction[1] == second.direction[1]:
            fail("View", f"right {self.right}, down {self.down}", "must be two different directions of +x .. -z")
        object.__setattr__(self, "right", first.direction)
        object.__setattr__(self, "down", second.direction)
        if self.scale is not None:
            object.__setattr__(self, "scale", positive("View.scale", self.scale))

    @classmethod
    def of_plane(cls, plane: str, scale: float | None = None, origin: tuple[float, float] = (0.0, 0.0)) -> View:
        """Return the view of a plane: ``xz``, ``yz`` (z up) or ``xy`` (y up)."""
        if plane not in _PLANES:
            fail("view", repr(plane), f"must be one of {', '.join(_PLANES)}",
                 remedy="or give right and down, e.g. View('-y', '-z')")
        return cls(*_PLANES[plane], scale, origin)

    @property
    def axes(self) -> FloatArray:
        """Unit vectors of right and down in the machine, shape (2, 3)."""
        return np.stack([Dof("p", self.right).unit[:3], Dof("p", self.down).unit[:3]])

    @property
    def normal(self) -> FloatArray:
        """Unit vector of the line of sight, away from the camera, shape (3,)."""
        return np.cross(*self.axes)

    @property
    def metres(self) -> float:
        """Metres a pixel; refused where the scale is unknown."""
        if self.scale is None:
            fail("View.scale", "unknown", "is needed to go from pixels to metres",
                 remedy="state it, or take it from a known length: View.scaled_by")
        return self.scale

    def scaled_by(self, first: ArrayLike, second: ArrayLike, *, length: float) -> View:
        """Return the view with the scale of a known length (m) between two places in the picture (column, row)."""
        pixels = float(np.linalg.norm(floats("second", second, (2,)) - floats("first", first, (2,))))
        if pixels < 10:
            fail("scaled_by", f"{pixels:.3g} pixels between the two places", "must be 10 at least",
                 remedy="take a longer known length")
        return View(self.right, self.down, positive("length", length) / pixels, self.origin)

    def project(self, places: ArrayLike) -> FloatArray:
        """Return the pixels (n, 2), column and row, of places of the machine (n, 3), m."""
        return floats("places", places, (3,)) @ self.axes.T / self.metres + np.asarray(self.origin)

    def locate(self, pixels: ArrayLike, depth: float = 0.0) -> FloatArray:
        """Return the places (n, 3), m, behind these pixels (n, 2), `depth` (m) along the line of sight."""
        offsets = (floats("pixels", pixels, (2,)) - np.asarray(self.origin)) * self.metres
        return np.asarray(offsets @ self.axes + depth * self.normal)
