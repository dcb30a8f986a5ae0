"""Contour error: distance of the actual points from the path of lines and arcs, by projection along the arc length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint._notebook import NotebookText
from toolpoint.drives.program.path import ARC_KIND, CLOTHOID_KIND, Path

_MAX_WINDOW_PAIRS = 1e8  # pairs of a point and a segment: some tens of seconds


@dataclass(frozen=True, eq=False)
class ContourError(NotebookText):
    """Feet on the path (n, 3), vectors to the actual points (n, 3), arc length of the feet (n,), signed error (n,), m.

    The sign is that of the left-hand normal in the xy plane; `length` the length of the vector.
    """

    foot: FloatArray
    vector: FloatArray
    progress: FloatArray
    signed: FloatArray

    @property
    def length(self) -> FloatArray:
        """Distance from the path, m."""
        return np.linalg.norm(self.vector, axis=1)

    def enlarged(self, factor: float = 50.0) -> FloatArray:
        """Return the path with its error drawn `factor` times enlarged, (n, 3)."""
        return self.foot + positive("factor", factor) * self.vector

    def __repr__(self) -> str:
        e = self.length
        return f"ContourError(largest {1e6 * e.max():.4g} µm, root mean square {1e6 * np.sqrt((e**2).mean()):.4g} µm)"


def contour_error(path: Path, points: FloatArray, progress: FloatArray, *, window: float | FloatArray
                  ) -> ContourError:
    """Return the contour error of points, each projected on the part of the path near its commanded place.

    Parameters
    ----------
    path : Path
    points : (n, 2 or 3) floats
        Actual points, m.
    progress : (n,) floats
        Arc length of the command at each instant, m: where to look, not what to measure.
    window : float or (n,) floats
        m; the foot lies within it of the arc length in `progress`, so that a path that crosses itself or turns back is not
        mistaken. Too narrow a window adds what is missing of the way to the error: `lag.window_around` gives one that is not.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.drives.program.path import polyline
    >>> line = polyline([[0, 0], [0.1, 0]], feed=0.1)
    >>> contour_error(line, np.array([[0.05, 2e-6]]), np.array([0.05]), window=0.01).signed.tolist()
    [2e-06]
    """
    if (path.kind == CLOTHOID_KIND).any():
        fail("path", "clothoid blends", "must be lines and arcs",
             remedy="measure against the programmed path, not the rounded one")
    p = floats("points", points)
    p = np.hstack([p, np.zeros((len(p), 3 - p.shape[1]))])
    s = floats("progress", progress, (len(p),))
    reach = np.broadcast_to(floats("window", window), s.shape)
    positive("window", float(reach.min()))
    lengths = path.lengths
    ends = np.cumsum(lengths)
    starts = ends - lengths
    first = np.searchsorted(ends, np.maximum(s - reach, 0.0), side="left")
    last = np.minimum(np.searchsorted(starts, s + reach, side="right") - 1, path.count - 1)
    # Long windows over many short segments would run for hours: they are refused before the passes.
    spread = int((last - first).max()) + 1
    if (last - first + 1).sum() > _MAX_WINDOW_PAIRS:
        fail("window", f"{reach.max():g} m holds {spread} segments", f"all windows together may hold {_MAX_WINDOW_PAIRS:.0e}",
             remedy="take smaller windows or fewer points")
    best, foot, place = np.full(len(p), np.inf), np.zeros_like(p), np.zeros(len(p))
    # The k-th segment of every window at once: as many passes as the widest window holds segments.
    for offset in range(spread):
        points_here = np.flatnonzero(first + offset <= last)
        k = first[points_here] + offset
        share = _nearest(path, k, p[points_here],
                         np.clip((s[points_here] - starts[k]) / np.where(lengths[k] > 0, lengths[k], 1), 0, 1))
        share_min = np.clip((s[points_here] - reach[points_here] - starts[k]) / np.where(lengths[k] > 0, lengths[k], 1), 0, 1)
        share_max = np.clip((s[points_here] + reach[points_here] - starts[k]) / np.where(lengths[k] > 0, lengths[k], 1), 0, 1)
        share = np.clip(share, share_min, share_max)
        q = path.points(k, share)
        distance = np.linalg.norm(p[points_here] - q, axis=1)
        is_nearer = distance < best[points_here]
        i = points_here[is_nearer]
        best[i], foot[i] = distance[is_nearer], q[is_nearer]
        place[i] = starts[k[is_nearer]] + share[is_nearer] * lengths[k[is_nearer]]
    vector = p - foot
    k = np.minimum(np.searchsorted(ends, place, side="left"), path.count - 1)
    tangent = path.tangents(k, (place - starts[k]) / np.where(lengths[k] > 0, lengths[k], 1))
    cross = tangent[:, 0] * vector[:, 1] - tangent[:, 1] * vector[:, 0]
    return ContourError(foot, vector, place, np.where(cross < 0, -1.0, 1.0) * np.linalg.norm(vector, axis=1))


def _nearest(path: Path, k: np.ndarray, p: FloatArray, expected: FloatArray) -> FloatArray:
    """Return the share (0..1) of the nearest point on each segment; on an arc the turn nearest to the expected one."""
    chord = path.end[k] - path.start[k]
    # A segment without length has its start as nearest point.
    size = np.maximum((chord**2).sum(axis=1), 1e-300)
    share = np.clip(((p - path.start[k]) * chord).sum(axis=1) / size, 0.0, 1.0)
    arc = np.flatnonzero(path.kind[k] == ARC_KIND)
    if arc.size:
        i = k[arc]
        plane_axes, rows = path.plane[i], np.arange(i.size)[:, None]
        d, e = (path.start[i] - path.center[i])[rows, plane_axes], (p[arc] - path.center[i])[rows, plane_axes]
        turned = np.arctan2(d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0], (d * e).sum(axis=1))
        expected_turn = expected[arc] * path.sweep[i]
        turned = expected_turn + (turned - expected_turn + np.pi) % (2 * np.pi) - np.pi
        share[arc] = np.clip(turned / path.sweep[i], 0.0, 1.0)
    return share


def torque_comparison(measured: FloatArray, simulated: FloatArray) -> dict[str, float]:
    """Return how a simulated torque agrees with a measured one at the same instants: rms of the difference, its share of
    the measured rms, correlation, and the ratio of the peaks.

    Examples
    --------
    >>> round(torque_comparison([1.0, -2.0, 3.0], [1.1, -2.2, 3.3])["peak ratio"], 6)
    1.1
    """
    m, s = floats("measured", measured), floats("simulated", simulated)
    if m.shape != s.shape:
        fail("simulated", f"shape {s.shape}", f"must be that of the measured, {m.shape}", remedy="resample one of them")
    rms = float(np.sqrt(((m - s) ** 2).mean()))
    return {"rms difference": rms, "relative": rms / float(np.sqrt((m**2).mean())),
            "correlation": float(np.corrcoef(m.ravel(), s.ravel())[0, 1]),
            "peak ratio": float(np.abs(s).max() / np.abs(m).max())}
