"""Stock: box, cylinder or closed mesh before the first cut, and the dexels along z that it is laid out in."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, IndexArray, fail, floats, positive

BOX_KIND, CYLINDER_KIND, MESH_KIND = 0, 1, 2  # codes of `Stock.kind`, as kernels read them
MAX_DEXELS = 60_000_000  # of a grid: 2 GB


@dataclass(frozen=True, eq=False)
class Stock:
    """Stock in the coordinates of the program, m.

    Parameters
    ----------
    kind : int
        BOX, CYLINDER (upright) or MESH.
    lower, upper : (3,) floats
        Corners of its bounding box.
    triangles : (n, 3, 3) floats, optional
        Corners of the triangles of a closed mesh.

    Examples
    --------
    >>> round(Stock.box((0, 0, -0.01), (0.1, 0.05, 0)).volume, 9)
    5e-05
    """

    kind: int
    lower: FloatArray
    upper: FloatArray
    triangles: FloatArray = field(default_factory=lambda: np.zeros((0, 3, 3)))

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "lower", floats("Stock.lower", self.lower, (3,)))
        put(self, "upper", floats("Stock.upper", self.upper, (3,)))
        size = self.upper - self.lower
        if size.min() <= 0 or size.max() > 50:
            fail("stock", f"corners {_words(self.lower)} and {_words(self.upper)}",
                 "must be two corners, the second above the first in x, y and z, less than 50 m apart")

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Stock:
        """Return a box between two corners, m."""
        return cls(BOX_KIND, np.asarray(lower, float), np.asarray(upper, float))

    @classmethod
    def cylinder(cls, diameter: float, lower_end: float, upper_end: float, *,
                 centre: tuple[float, float] = (0.0, 0.0)) -> Stock:
        """Return an upright cylinder between two heights, m."""
        radius = positive("stock diameter", diameter, 50.0) / 2
        x, y = centre
        return cls(CYLINDER_KIND, np.array([x - radius, y - radius, lower_end]), np.array([x + radius, y + radius, upper_end]))

    @classmethod
    def mesh(cls, triangles: ArrayLike) -> Stock:
        """Return the inside of a closed mesh from the corners of its triangles (n, 3, 3), m."""
        corners = floats("triangles", triangles, (None, 3, 3))
        if len(corners) < 4:
            fail("stock", f"a mesh of {len(corners)} triangles", "must be closed: at least four triangles")
        return cls(MESH_KIND, corners.min((0, 1)), corners.max((0, 1)), corners)

    @property
    def volume(self) -> float:
        """Volume, m^3; of a mesh by the signed volumes of its triangles."""
        size = self.upper - self.lower
        if self.kind == MESH_KIND:
            a, b, c = self.triangles[:, 0], self.triangles[:, 1], self.triangles[:, 2]
            return float(abs(np.einsum("ni,ni->n", a, np.cross(b, c)).sum()) / 6)
        return float(size.prod() * (1.0 if self.kind == BOX_KIND else np.pi / 4))

    @property
    def words(self) -> str:
        """Kind and size in words."""
        size = 1e3 * (self.upper - self.lower)
        name = ("box", "cylinder", "mesh")[self.kind]
        return f"{name} {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm, top at z {1e3 * self.upper[2]:.4g} mm"

    def laid_out(self, spacing: float) -> Dexels:
        """Return the dexels at a spacing (m), their intervals sorted upwards."""
        h = positive("spacing", spacing)
        count = count_dexels(self.lower, self.upper, h)
        origin = self.lower[:2] + h / 2
        x, y = (origin[k] + h * np.arange(count[k]) for k in (0, 1))
        if self.kind == MESH_KIND:
            from toolpoint.material_removal.mesh_intervals import cross_mesh  # brings the compiler

            return Dexels(float(origin[0]), float(origin[1]), h, cross_mesh(self.triangles, x, y))
        intervals = np.empty((count[0], count[1], 1, 2))
        intervals[..., 0], intervals[..., 1] = self.lower[2], self.upper[2]
        if self.kind == CYLINDER_KIND:
            centre, radius = (self.lower + self.upper)[:2] / 2, (self.upper - self.lower)[0] / 2
            outside = (x[:, None] - centre[0]) ** 2 + (y[None, :] - centre[1]) ** 2 > radius**2
            intervals[outside] = np.nan
        return Dexels(float(origin[0]), float(origin[1]), h, intervals)

    def cell_lines(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the intervals (cells, lines, n, 2) of a mesh along upright lines at x and y (cells, lines), m."""
        from toolpoint.material_removal.mesh_intervals import cross_cells  # brings the compiler

        return cross_cells(self.triangles, x, y)


@dataclass(frozen=True, eq=False)
class Dexels:
    """Dexels along z: centres from (x, y) in steps of `spacing`, m; `intervals` (nx, ny, n, 2), not a number where none."""

    x: float
    y: float
    spacing: float
    intervals: FloatArray


def _words(place: FloatArray) -> str:
    """Return a place (m) in mm, as text."""
    return ", ".join(f"{1e3 * value:g}" for value in place) + " mm"


def count_dexels(lower: FloatArray, upper: FloatArray, spacing: float) -> IndexArray:
    """Return how many dexels along x and y, (2,), a stock between two corners (3,), m, has at a spacing, m; refuse too many."""
    count = np.maximum(np.ceil((upper[:2] - lower[:2]) / spacing - 1e-9).astype(int), 1)
    if int(count.prod()) > MAX_DEXELS:
        fail("spacing", f"{1e3 * spacing:g} mm: {count.prod() / 1e6:.0f} million dexels", f"must need at most "
             f"{MAX_DEXELS / 1e6:.0f} million", remedy="a larger spacing, or a smaller stock")
    return np.asarray(count)
