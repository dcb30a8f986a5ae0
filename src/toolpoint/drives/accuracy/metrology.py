"""Tests of machine tools: circular test of ISO 230-4, quadrant peaks, positioning of ISO 230-2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray, fail, floats, one_of, positive
from toolpoint._notebook import NotebookText


@dataclass(frozen=True)
class CircularTest(NotebookText):
    """Circular test: centre (m), circular deviation G, radial deviations F_max and F_min from the nominal circle, m."""

    center: tuple[float, float]
    radius: float
    deviation: float
    radial_max: float
    radial_min: float
    method: str

    def __repr__(self) -> str:
        return (f"CircularTest(G {1e6 * self.deviation:.4g} µm, F_max {1e6 * self.radial_max:.4g} µm, "
                f"F_min {1e6 * self.radial_min:.4g} µm; {self.method})")


def circular_test(points: FloatArray, radius: float, center: tuple[float, float] = (0.0, 0.0),
                  *, method: str = "least squares") -> CircularTest:
    """Return the quantities of a circular test.

    Parameters
    ----------
    points : (n, 2) floats
        Actual path of at least one turn, m.
    radius, center : float
        Nominal, m; the radial deviations are taken from them, start-up included as given.
    method : str
        Centre for G: ``least squares`` or ``minimum zone`` (smallest radial separation of two concentric circles).

    Source: ISO 230-4:2022, 3.3 (circular deviation G) and 3.5 (radial deviation F).

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    >>> points = np.stack([50e-3 * np.cos(angle), 50.004e-3 * np.sin(angle)], axis=1)
    >>> print(f"{1e6 * circular_test(points, 50e-3).deviation:.2f} um")
    4.00 um
    """
    one_of("method", method, ("least squares", "minimum zone"))
    p = floats("points", points, (None, 2))
    # About their middle: from far away, the sums of squares below would lose the micrometres asked for.
    start = p.mean(axis=0)
    q = p - start
    fit = np.linalg.lstsq(np.column_stack([2 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)[0]
    middle, offset = fit[:2], fit[-1]

    def separation(c: FloatArray) -> float:
        r = np.hypot(*(q - c).T)
        return float(r.max() - r.min())

    if method == "minimum zone":
        # In units of the separation itself, so that the tolerances of the search mean the same for any circle.
        scale = max(separation(middle), 1e-12)
        narrowest = scipy.optimize.minimize(lambda u: separation(middle + scale * u) / scale, np.zeros(2),
                             method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 4000})
        middle = middle + scale * narrowest.x
    nominal = np.hypot(*(p - np.asarray(center)).T) - positive("radius", radius)
    fitted_center = middle + start
    return CircularTest((float(fitted_center[0]), float(fitted_center[1])), float(np.sqrt(offset + fit[:2] @ fit[:2])),
                        separation(middle), float(nominal.max()), float(nominal.min()), method)


def circular_hysteresis(forward: FloatArray, backward: FloatArray, center: tuple[float, float] = (0.0, 0.0)) -> float:
    """Return the circular hysteresis H: largest radial difference of the two directions at the same angle, m.

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    >>> circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    >>> print(f"{1e6 * circular_hysteresis(50.002e-3 * circle, 50e-3 * circle):.2f} um")
    2.00 um
    """
    radii = []
    grid = np.linspace(-np.pi, np.pi, 3600, endpoint=False)
    for points in (forward, backward):
        d = floats("points", points, (None, 2)) - np.asarray(center)
        angle = np.arctan2(d[:, 1], d[:, 0])
        order = np.argsort(angle)
        # Both directions at the same angles: samples of two runs never fall on each other.
        radii.append(np.interp(grid, angle[order], np.hypot(*d.T)[order], period=2 * np.pi))
    return float(np.abs(radii[0] - radii[1]).max())


def quadrant_peaks(points: FloatArray, radius: float, center: tuple[float, float] = (0.0, 0.0), *, half_width: float = 20.0
                   ) -> FloatArray:
    """Return the quadrant peaks at 0, 90, 180, 270 deg, m: outward excess of the radius within `half_width` deg of the
    reversal over the median of the whole turn (positive outward).

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.linspace(0, 2 * np.pi, 3600, endpoint=False)
    >>> radius = 50e-3 + 3e-6 * (np.abs(np.degrees(angle) - 90) < 2)
    >>> points = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    >>> (1e6 * quadrant_peaks(points, 50e-3)).round(6).tolist()
    [0.0, 3.0, 0.0, 0.0]
    """
    d = floats("points", points, (None, 2)) - np.asarray(center)
    r, angle = np.hypot(*d.T) - positive("radius", radius), np.degrees(np.arctan2(d[:, 1], d[:, 0]))
    # The median, as a mean would hold part of the peaks that are asked for.
    base, peaks = float(np.median(r)), []
    for q in (0.0, 90.0, 180.0, 270.0):
        # Differences of angles go round: half a turn lies at both ends of the range.
        in_quadrant = np.abs((angle - q + 180) % 360 - 180) <= half_width
        if not in_quadrant.any():
            fail("points", f"none within {half_width:g} deg of {q:g} deg", "must hold a whole turn")
        peaks.append(float(r[in_quadrant].max() - base))
    return np.array(peaks)


@dataclass(frozen=True)
class Positioning(NotebookText):
    """Positioning of ISO 230-2, m: A accuracy, E systematic deviation, R repeatability, B reversal, M mean deviation."""

    accuracy: float
    accuracy_forward: float
    accuracy_backward: float
    systematic: float
    systematic_forward: float
    systematic_backward: float
    repeatability: float
    repeatability_forward: float
    repeatability_backward: float
    reversal: float
    mean_reversal: float
    mean_deviation: float

    def table(self) -> str:
        """Return the quantities in micrometres."""
        rows = [("A", self.accuracy), ("A+", self.accuracy_forward), ("A-", self.accuracy_backward),
                ("E", self.systematic), ("E+", self.systematic_forward), ("E-", self.systematic_backward),
                ("R", self.repeatability), ("R+", self.repeatability_forward), ("R-", self.repeatability_backward),
                ("B", self.reversal), ("mean B", self.mean_reversal), ("M", self.mean_deviation)]
        return "\n".join(f"{name:7s} {1e6 * value:9.3f} µm" for name, value in rows)


def positioning(forward: FloatArray, backward: FloatArray) -> Positioning:
    """Return the positioning of an axis from deviations (actual - target) at m targets, n approaches each way, (m, n), m.

    ``R_i = max(2 s+_i + 2 s-_i + |B_i|, 4 s+_i, 4 s-_i)``, and R is the largest R_i: the bidirectional repeatability is at
    least each unidirectional one. Source: ISO 230-2:2014, section 3 and annex.

    Examples
    --------
    >>> result = positioning([[0.0, 2e-6], [1e-6, 3e-6]], [[4e-6, 6e-6], [5e-6, 7e-6]])
    >>> print(f"B {1e6 * result.reversal:.1f} um, M {1e6 * result.mean_deviation:.1f} um")
    B 4.0 um, M 1.0 um
    """
    up = floats("forward", forward, (None, None))
    down = floats("backward", backward, up.shape)
    if up.shape[1] < 2:
        fail("forward", f"{up.shape[1]} approach", "must be at least two; the standard asks for five")
    mean_up, mean_down = up.mean(axis=1), down.mean(axis=1)
    s_up, s_down = up.std(axis=1, ddof=1), down.std(axis=1, ddof=1)
    b, middle = mean_up - mean_down, (mean_up + mean_down) / 2
    each = np.max([2 * s_up + 2 * s_down + np.abs(b), 4 * s_up, 4 * s_down], axis=0)
    both = np.concatenate([mean_up, mean_down])
    upper, lower = np.concatenate([mean_up + 2 * s_up, mean_down + 2 * s_down]), np.concatenate(
        [mean_up - 2 * s_up, mean_down - 2 * s_down])
    n = len(mean_up)
    span = lambda a, c: float(a.max() - c.min())
    return Positioning(span(upper, lower), span(upper[:n], lower[:n]), span(upper[n:], lower[n:]), span(both, both),
                       span(mean_up, mean_up), span(mean_down, mean_down), float(each.max()), 4 * float(s_up.max()),
                       4 * float(s_down.max()), float(np.abs(b).max()), float(b.mean()), span(middle, middle))
