"""Points: where the texture shows motion, in both directions, across an edge only, or not at all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint._deprecation import rename_argument
from toolpoint.vision.displacement.reference import Reference
from toolpoint.vision.displacement.survey import MAX_SATURATED_FRACTION, Survey

BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT = 0, 1, 2  # places in `SIGHTS`
SIGHTS = ("blind", "across the edge only", "both directions")
# Pixels a frame: a direction whose standard deviation is above this is not measured.
MAX_POINT_DEVIATION = 0.3
MIN_TEXTURE_RATIO = 1.0  # information of the texture over what noise of the reference looks like
# Pixels along the border of a window, and the least share of its information within them over that of even texture: an edge
# that only reaches into a window leaves it by its own motion, and a window that follows it wanders.
BORDER_WIDTH, MIN_INNER_INFORMATION = 2, 0.5


@dataclass(frozen=True, eq=False)
class Windows:
    """Square windows of the picture and how well motion shows in each.

    corners : (n, 2) top row and left column; side : pixels; sight : (n,) of `SIGHTS`; normal : (n, 2) direction (right,
    down) that shows best; bound : (n, 2) least standard deviation (Cramer-Rao) along the normal and across it, pixels a
    frame, infinite where not measured; saturated : (n,) share of black or white pixels.
    """

    corners: IndexArray
    side: int
    sight: IndexArray
    normal: FloatArray
    bound: FloatArray
    saturated: FloatArray

    @property
    def centres(self) -> FloatArray:
        """Centres (n, 2), column and row."""
        return self.corners[:, ::-1] + (self.side - 1) / 2

    def selected(self, keep: np.ndarray) -> Windows:
        """Return these windows."""
        return Windows(self.corners[keep], self.side, self.sight[keep], self.normal[keep], self.bound[keep],
                       self.saturated[keep])

    def measured_with(self, covariance: FloatArray) -> Windows:
        """Return the windows with those blind that a method does not measure: their covariance (n, 2, 2) is zero."""
        is_unmeasured = np.trace(covariance, axis1=1, axis2=2) <= 0
        return replace(self, sight=np.where(is_unmeasured, BLIND_SIGHT, self.sight),
                       bound=np.where(is_unmeasured[:, None], np.inf, self.bound))


def windows_at(reference: Reference, corners: IndexArray, side: int, *, saturated: FloatArray | None = None,
               max_deviation: float = MAX_POINT_DEVIATION) -> Windows:
    """Return the windows at these corners (top row, left column), judged by their texture."""
    rows, columns = reference.picture.shape
    if side < 5 or side > min(rows, columns) - 4:
        fail("window", f"{side} pixels", f"must be 5 to {min(rows, columns) - 4}")
    middle = corners + side // 2
    information = reference.information(side)[middle[:, 0], middle[:, 1]]
    size, vectors = np.linalg.eigh(information)
    size, vectors = size[:, ::-1], vectors[:, :, ::-1]  # the normal, which shows best, first
    bound = np.where(size > 0, 1 / np.sqrt(np.maximum(size, 1e-12)), np.inf)
    # What noise of the reference looks like is no texture; fluctuations of it neither.
    is_measured = (bound <= max_deviation) & (size > MIN_TEXTURE_RATIO * reference.false_information(side))
    inner_side = side - 2 * BORDER_WIDTH
    inner_information = np.einsum("nij,nik,nkj->nj", vectors, reference.information(inner_side)[middle[:, 0], middle[:, 1]],
                                  vectors)
    is_measured &= inner_information > MIN_INNER_INFORMATION * (inner_side / side) ** 2 * size
    sight = is_measured[:, 0].astype(int) + (is_measured[:, 0] & is_measured[:, 1])
    clipped_share = np.zeros(len(corners)) if saturated is None else _share(saturated, corners, side)
    sight = np.where(clipped_share > MAX_SATURATED_FRACTION, BLIND_SIGHT, sight)
    bound = np.where(np.arange(2) < sight[:, None], bound, np.inf)
    return Windows(corners, side, sight, vectors[:, :, 0], bound, clipped_share)


@rename_argument("coarsest", "max_deviation", since="0.2")
def grid_windows(reference: Reference, survey: Survey, side: int = 16, *, margin: int = 4,
                 max_deviation: float = MAX_POINT_DEVIATION) -> Windows:
    """Return windows side by side over the whole picture.

    >>> import numpy as np
    >>> from scipy import ndimage
    >>> from toolpoint.vision import clip_of, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> len(grid_windows(scanned.reference, scanned.survey, side=16).corners)  # two rows of three, a margin of 4 pixels around
    6
    """
    rows, columns = reference.picture.shape
    first_rows, first_columns = np.arange(margin, rows - side - margin + 1,
                                          side), np.arange(margin, columns - side - margin + 1, side)
    corners = np.stack(np.meshgrid(first_rows, first_columns, indexing="ij"), axis=-1).reshape(-1, 2)
    return windows_at(reference, corners, side, saturated=survey.saturated, max_deviation=max_deviation)


def choose_points(reference: Reference, survey: Survey, count: int = 200, *, side: int = 21) -> Windows:
    """Return windows on corners and edges: the best of the picture, spread over it.

    The picture is parted into cells, four a point wanted; each gives its best place (least bound across the worse direction,
    or along the normal where there are only edges), the best cells win.

    >>> import numpy as np
    >>> from scipy import ndimage
    >>> from toolpoint.vision import clip_of, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> choose_points(scanned.reference, scanned.survey, 4, side=15).corners.shape  # windows; row and column
    (4, 2)
    """
    rows, columns = reference.picture.shape
    margin = side // 2 + 6
    if min(rows, columns) <= 2 * margin:
        fail("window", f"{side} pixels in a picture of {columns} x {rows}", "must leave room to move",
             remedy="take a smaller one")
    size = np.linalg.eigvalsh(reference.information(side - 2 * BORDER_WIDTH))
    size[:margin], size[-margin:], size[:, :margin], size[:, -margin:] = 0.0, 0.0, 0.0, 0.0
    score = np.maximum(size[..., 0], 1e-3 * size[..., 1])
    cell_side = max(side // 2, int(np.sqrt(rows * columns / (4 * count))))
    places = []
    for first_row in range(0, rows, cell_side):
        for first_column in range(0, columns, cell_side):
            cell = score[first_row:first_row + cell_side, first_column:first_column + cell_side]
            peak = np.unravel_index(int(np.argmax(cell)), cell.shape)
            if cell[peak] > 0:
                places.append((float(cell[peak]), first_row + int(peak[0]), first_column + int(peak[1])))
    places.sort(reverse=True)
    if not places:
        fail("clip", "no texture", "needs edges or corners that move",
             remedy="stick or spray a pattern on the machine, light it, focus")
    corners = np.array([(y - side // 2, x - side // 2) for _, y, x in places])
    windows = windows_at(reference, corners, side, saturated=survey.saturated)
    return windows.selected(np.flatnonzero(windows.sight > BLIND_SIGHT)[:count])


def _share(saturated: FloatArray, corners: IndexArray, side: int) -> FloatArray:
    """Return the share of saturated pixels in each window, from a summed-area table."""
    total = np.pad(np.cumsum(np.cumsum(saturated > 0.5, axis=0), axis=1), ((1, 0), (1, 0)))
    y, x = corners[:, 0], corners[:, 1]
    return (total[y + side, x + side] - total[y, x + side] - total[y + side, x] + total[y, x]) / side**2
