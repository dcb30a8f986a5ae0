r"""Noise of a measured FRF in a boundary point: first-order propagation from every line to the depth.

A root moves by :math:`\mathrm{Re}\,\kappa \sum_k l_k^T \delta G(i\omega_k) p_k` where the response changes by :math:`\delta G`.
With G interpolated between lines whose noise is complex, circular and independent from line to line, of variance
:math:`\sigma_j^2 = E|\delta G_j|^2`, the variance of the depth is :math:`\tfrac12 \sum_j |c_j|^2 \sigma_j^2`, c_j the sum of
all that a line contributes.

Source: Bendat, Piersol, Random Data, 4th ed., chapter 9 (noise of frequency responses); the propagation is the usual one.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.cutting.cut.interpolation import interpolation
from toolpoint.cutting.cut.plane import PlaneDynamics

# Differences of lines, of sixth order and of fourth, over the same seven lines. A resonance four lines wide leaves 0.6 % of
# itself in the sixth.
SIXTH_DIFFERENCE = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])
FOURTH_DIFFERENCE = np.array([0.0, 1.0, -4.0, 6.0, -4.0, 1.0, 0.0])
MAX_SCATTER_RATIO = 2.0  # variance by fourth over that by sixth differences: above, they see the curve and not its noise
SCATTER_LINE_COUNT = 9  # lines over which the scatter is averaged
MAX_SCATTER_DRAWS = 20  # draws of which the scatter from line to line is taken
MIN_SCATTER_LINES = 2 * SCATTER_LINE_COUNT


def line_variance(plane: PlaneDynamics) -> FloatArray:
    """Return the noise variance ``E|noise|^2`` of every line, (n_f, d, d) (m/N)^2: stated, else by scatter of neighbours.

    Of a response with draws it is that part of their scatter which no two lines share: limits of the draws hold the rest.
    The scatter is that of sixth differences: noise that neighbouring lines share (a window) is not seen in it, and a resonance
    narrower than some four lines is taken for noise. With less than `MIN_SCATTER_LINES` lines it is zero.
    """
    if plane.draws is not None:
        return _unshared_variance(plane)
    if plane.variance is not None:
        return plane.variance
    _, values = plane.lines
    if values.shape[0] < MIN_SCATTER_LINES:
        return np.zeros(values.shape)
    variance = _scatter(values, SIXTH_DIFFERENCE)
    certain = _scatter(values, FOURTH_DIFFERENCE) <= MAX_SCATTER_RATIO * variance
    # Where the two differ the curve itself is seen: lines too far apart. Noise there is at most that of the lines elsewhere.
    return np.where(certain, variance, np.minimum(variance, variance[certain].max(initial=0.0)))


def _unshared_variance(plane: PlaneDynamics) -> FloatArray:
    """Return what draws scatter from line to line, (n_f, d, d): a change that neighbouring lines share is not in it."""
    _, values = plane.lines
    if plane.draws is None or values.shape[0] < MIN_SCATTER_LINES:
        return np.zeros(values.shape)
    some = plane.draws[:MAX_SCATTER_DRAWS]
    return np.asarray(np.mean([_scatter(draw - values, SIXTH_DIFFERENCE) for draw in some], axis=0))


def _scatter(values: ComplexArray, difference: FloatArray) -> FloatArray:
    """Return the mean power of a difference over nine neighbouring lines, (n_f, d, d), scaled to the variance of one line."""
    half = difference.size // 2
    rough = sum(c * values[k:values.shape[0] - 2 * half + k] for k, c in enumerate(difference.tolist()))
    power = np.abs(rough) ** 2 / float((difference**2).sum())
    sums = np.cumsum(np.concatenate([np.zeros((1, *power.shape[1:])), power]), axis=0)
    first = np.clip(np.arange(values.shape[0]) - half - SCATTER_LINE_COUNT // 2, 0, power.shape[0] - SCATTER_LINE_COUNT)
    return np.asarray((sums[first + SCATTER_LINE_COUNT] - sums[first]) / SCATTER_LINE_COUNT)


def depth_variance(plane: PlaneDynamics, variance: FloatArray, hz: FloatArray, *, influence: ComplexArray, factor: complex,
                   kept_lines: slice | None = None) -> float:
    """Return the variance of a root's depth, m^2, by the noise of the lines.

    variance : (n_f, d, d) of the lines; hz : (n,) frequencies of the harmonics, of either sign; influence : (n, d, d) change of
    the vanishing eigenvalue by G there; factor : kappa, see `Root.factor`; kept_lines : slice of the lines that stay where the
    others are left out. Then the variance is that of the change which leaving them out makes.
    """
    line = plane.lines[0]
    inside = (np.abs(hz) >= line[0]) & (np.abs(hz) <= line[-1])
    f, terms, negative = np.abs(hz[inside]), factor * influence[inside], hz[inside] < 0
    # A response at -f is the conjugate of that at f, and the real part is that of the conjugate too.
    terms = np.where(negative[:, None, None], terms.conj(), terms)
    total = np.zeros((line.size, *terms.shape[1:]), complex)
    _add_contributions(total, line, f, terms, slice(None), 1.0 if kept_lines is None else -1.0)
    if kept_lines is not None:
        _add_contributions(total, line, f, terms, kept_lines, 1.0)
    if np.array_equal(plane.lines[1][:, 0, 0], plane.lines[1][:, 1, 1]):  # one measurement stands for both directions
        total[:, 0, 0] += total[:, 1, 1]
        total[:, 1, 1] = 0.0
    return float(0.5 * (np.abs(total) ** 2 * variance).sum())


def _add_contributions(total: ComplexArray, line: FloatArray, f: FloatArray, terms: ComplexArray, lines: slice,
                       sign: float) -> None:
    """Add to every line its contribution through the interpolation at f (n,) from the lines of a slice only.

    total : (n_f, d, d), changed in place; line : (n_f,) Hz; terms : (n, d, d) at f.
    """
    kept = np.arange(line.size)[lines]
    indices, weight = interpolation(line[lines], f)
    np.add.at(total, kept[indices], sign * weight[:, :, None, None] * terms[:, None])
