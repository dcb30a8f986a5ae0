r"""Smoothing of a measured response over neighbouring lines as far as its noise allows, and the noise by their scatter.

Around a resonance the dynamic stiffness 1/G is smooth, and the noise of a coupled tool is nearly normal in it; where G is
small, G itself is. A parabola is fitted over a window about every line (weighted local regression); the widest window is
taken whose residuals the noise explains, less one step, so that what is smoothed away stays below the noise. The same linear
combination is taken of every draw. Sources: Lepski, Theory Prob. Appl. 35 (1991) (choice of windows); Fan, Gijbels, Local
Polynomial Modelling and Its Applications (1996).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, IndexArray
from toolpoint.substructuring.receptance import PlaneReceptance

# weights of five lines, scaled to the noise of one line
FOURTH_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / np.sqrt(70)
WINDOW_HALF_WIDTHS = (2, 3, 5, 8, 12, 18, 27)  # lines to each side
SCATTER_HALF_WIDTH = 20  # lines to each side over which scatter is averaged
MAX_RESIDUAL_DEVIATIONS = 1.0  # standard deviations of the squared residuals above which a window is refused
NOISE_STATEMENT_FACTOR = 1.5  # squared scatter over stated variance that is still accepted
CHOICE_SPREAD_FACTOR = 1.15  # of the draws: windows are chosen by the noise that they smooth, which understates it
MIN_TAIL_DIFFERENCE = 0.15  # logarithm of a variance by which the draws of G or 1/G are further from normal
CIRCULAR_NOISE_MEDIAN = float(np.log(2))  # median of the square of circular complex noise of variance 1


def scatter_variance(values: ComplexArray) -> FloatArray:
    """Return the variance E|e|^2 of lines (n_f, ...) by the scatter of neighbours: fourth differences, median over lines."""
    size = np.abs(_differences(values)) ** 2 / CIRCULAR_NOISE_MEDIAN
    return np.stack([_running_median(column) for column in size.reshape(len(size), -1).T], axis=-1).reshape(values.shape)


def noise_over_stated(values: ComplexArray, variance: FloatArray) -> float:
    """Return the scatter of neighbouring lines over the stated standard deviation, median over all lines and responses."""
    if len(values) < 2 * SCATTER_HALF_WIDTH:
        return 1.0
    return float(np.sqrt(np.median(np.abs(_differences(values)) ** 2 / (CIRCULAR_NOISE_MEDIAN * np.maximum(variance, 1e-300)))))


def _differences(values: ComplexArray) -> ComplexArray:
    """Return fourth differences along the first axis, those of the ends repeated."""
    n = len(values)
    differences = sum(c * values[k:n - 4 + k] for k, c in enumerate(FOURTH_DIFFERENCE))
    return np.concatenate([differences[:1], differences[:1], differences, differences[-1:], differences[-1:]])


def _running_median(values: FloatArray, half_width: int = SCATTER_HALF_WIDTH) -> FloatArray:
    window_lines = np.clip(np.arange(len(values))[:, None] + np.arange(-half_width, half_width + 1), 0, len(values) - 1)
    return np.asarray(np.median(values[window_lines], axis=1))


def smooth_tip(tip: PlaneReceptance) -> PlaneReceptance:
    """Return the deflection per force with neighbouring lines taken together, values and draws; unchanged without draws."""
    if tip.draws is None or tip.frequency.size < 2 * SCATTER_HALF_WIDTH:
        return tip
    raw, drawn = tip.values[:, 0, 0], tip.draws[:, :, 0, 0]
    soft, stiff = _combination(tip.frequency, raw, drawn), _combination(tip.frequency, 1 / raw, 1 / drawn)
    heavier = _tails(1 / drawn - 1 / raw) - _tails(drawn - raw)
    by_stiffness = np.where(np.abs(heavier) > MIN_TAIL_DIFFERENCE, heavier < 0, stiff.width >= soft.width)
    values, draws = tip.values.copy(), tip.draws.copy()
    values[:, 0, 0] = np.where(by_stiffness, 1 / stiff.of(1 / raw), soft.of(raw))
    draws[:, :, 0, 0] = np.where(by_stiffness, 1 / stiff.spread(1 / raw, 1 / drawn), soft.spread(raw, drawn))
    return replace(tip, values=values, draws=draws)


def _tails(error: ComplexArray) -> FloatArray:
    """Return the mean square of draws (n, n_f) over that of normal draws of the same median, as a logarithm."""
    size = np.abs(error) ** 2
    return np.asarray(np.log(np.maximum(size.mean(axis=0), 1e-300) * CIRCULAR_NOISE_MEDIAN / np.maximum(np.median(size, axis=0),
                                                                                                        1e-300)))


@dataclass(frozen=True, eq=False)
class _Combination:
    """Lines and weights (n_f, 2 w + 1) of the widest accepted window of every line; width: w, 0 for none."""

    lines: IndexArray
    weights: FloatArray
    width: IndexArray

    def of(self, values: ComplexArray) -> ComplexArray:
        """Return values (..., n_f) smoothed."""
        result = np.zeros(values.shape, complex)
        for lines, weights in zip(self.lines.T, self.weights.T, strict=True):
            result += weights * values[..., lines]
        return result

    def spread(self, values: ComplexArray, draws: ComplexArray) -> ComplexArray:
        """Return draws (n, n_f) smoothed, farther from the smoothed values where windows were chosen."""
        middle = self.of(values)
        return middle + np.where(self.width > 0, CHOICE_SPREAD_FACTOR, 1.0) * (self.of(draws) - middle)


def _combination(frequency: FloatArray, values: ComplexArray, draws: ComplexArray) -> _Combination:
    n, half_width_max = values.size, WINDOW_HALF_WIDTHS[-1]
    variance = np.median(np.abs(_differences((draws - values).T)) ** 2, axis=1) / CIRCULAR_NOISE_MEDIAN
    variance = _running_median(variance, 5)  # weights that followed the noise of their line would bias the fit
    # Noise that was stated too large would let everything pass.
    scatter_ratio = _running_median(np.abs(_differences(values)) ** 2 / (CIRCULAR_NOISE_MEDIAN * np.maximum(variance, 1e-300)))
    variance = np.maximum(variance * np.minimum(1.0, NOISE_STATEMENT_FACTOR * scatter_ratio), 1e-300)
    lines = np.repeat(np.arange(n)[:, None], 2 * half_width_max + 1, axis=1)
    weights, width = np.zeros(lines.shape), np.zeros(n, int)
    weights[:, 0] = 1.0
    open_lines, previous = np.ones(n, bool), None
    for half_width in (w for w in WINDOW_HALF_WIDTHS if 2 * w + 1 <= n):
        window_lines, rows, residual = _local_fit(frequency, values, 1 / variance, half_width)
        freedom = 2 * half_width + 1 - 3
        # A line whose wider window was refused takes no wider one (Lepski).
        open_lines &= residual <= freedom + MAX_RESIDUAL_DEVIATIONS * np.sqrt(freedom)
        kept = (window_lines, rows, half_width) if previous is None else previous
        lines[open_lines, :kept[0].shape[1]], weights[open_lines] = kept[0][open_lines], 0.0
        weights[open_lines, :kept[1].shape[1]], width[open_lines] = kept[1][open_lines], kept[2]
        previous = (window_lines, rows, half_width)
    return _Combination(lines, weights, width)


def _local_fit(frequency: FloatArray, values: ComplexArray, weight: FloatArray, half_width: int
               ) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return lines and weights of a parabola's value in windows of `half_width` lines to each side, and the sum of squares."""
    n = values.size
    window_lines = np.clip(np.arange(n) - half_width, 0, n - 2 * half_width - 1)[:, None] + np.arange(2 * half_width + 1)
    x = frequency[window_lines] - frequency[:, None]
    design = (x / np.abs(x).max(axis=1, keepdims=True))[..., None] ** np.arange(3)
    share = weight[window_lines] / weight[window_lines].max(axis=1, keepdims=True)
    normal = np.swapaxes(design, 1, 2) @ (share[..., None] * design)
    to_fit = np.linalg.pinv(normal, hermitian=True) @ (np.swapaxes(design, 1, 2) * share[:, None, :])
    fitted = (design @ (to_fit @ values[window_lines][..., None]))[..., 0]
    return window_lines, to_fit[:, 0], (weight[window_lines] * np.abs(values[window_lines] - fitted) ** 2).sum(axis=1)
