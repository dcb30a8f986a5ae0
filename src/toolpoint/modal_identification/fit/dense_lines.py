"""Trial poles on very many lines: lines averaged in blocks far narrower than a resonance, each trial on the lines about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.modal_identification.basis import pole_terms, real_rows
from toolpoint.modal_identification.fit.refinement import Data

MAX_UNAVERAGED_LINES = 6000  # above, lines are averaged
BLOCKS_PER_HALF_WIDTH = 4
TRIAL_HALF_WIDTHS = 15.0  # to either side of a trial pole, whose lines are used for it
TRIALS_AT_ONCE = 40  # trial poles whose moments are computed together


@dataclass(frozen=True, eq=False)
class AveragedLines:
    """Blocks of lines: p and weight of each (the square root of its lines, times the factor), the residual as real rows, and an
    orthonormal basis of what other modes and outside terms explain."""

    p: ComplexArray
    weight: ComplexArray
    rows: FloatArray
    explained: FloatArray

    @classmethod
    def of(cls, data: Data, poles: ComplexArray, residual: ComplexArray, *, ratio: float) -> AveragedLines:
        """Return the lines of `data` averaged in blocks of a quarter of the half width that damping `ratio` gives there."""
        starts = _starts(data, ratio)
        size = np.diff(np.append(starts, data.p.size))

        def mean(values: Array) -> Array:
            shape = (-1, *([1] * (values.ndim - 1)))
            return np.add.reduceat(values, starts, axis=0) / size.reshape(shape)

        root = np.sqrt(size)
        rows = real_rows(mean(residual.reshape(residual.shape[0], -1)) * root[:, None])
        p, weight = mean(data.p), mean(data.factor) * root
        outside = mean(data.outside[:data.p.size] + 1j * data.outside[data.p.size:]) * root[:, None]
        modes = (pole_terms(p, poles) * weight[:, None, None]).reshape(p.size, -1)
        return cls(p, weight, rows, np.linalg.qr(real_rows(np.concatenate([outside, modes], axis=1)))[0])

    def moments(self, trial: ComplexArray, ratio: float) -> tuple[FloatArray, FloatArray]:
        """Return of every trial pole its Gram matrix (n, 2, 2) and moments with the residual (n, 2, n_rows), less what is
        known."""
        parts = [self._part(trial[places], window) for places, window in self._windows(trial, ratio)]
        return np.concatenate([gram for gram, _ in parts]), np.concatenate([moments for _, moments in parts])

    def _windows(self, trial: ComplexArray, ratio: float) -> Iterator[tuple[slice, Array]]:
        """Trials in turn, and the rows about them."""
        lines = self.p.imag
        for first in range(0, trial.size, TRIALS_AT_ONCE):
            sizes = np.abs(trial[first:first + TRIALS_AT_ONCE])
            inside = np.flatnonzero((lines >= sizes[0] * (1 - TRIAL_HALF_WIDTHS * ratio))
                                    & (lines <= sizes[-1] * (1 + TRIAL_HALF_WIDTHS * ratio)))
            if inside.size == 0:  # trials below the first averaged line of a band that begins near 0 Hz
                inside = np.array([int(np.argmin(np.abs(lines - sizes.mean())))])
            yield slice(first, first + TRIALS_AT_ONCE), inside

    def _part(self, trial: ComplexArray, inside: Array) -> tuple[FloatArray, FloatArray]:
        count = trial.size
        terms = pole_terms(self.p[inside], trial) * self.weight[inside, None, None]
        columns = real_rows(terms.reshape(inside.size, -1))
        rows = np.concatenate([inside, self.p.size + inside])
        shared = self.explained[rows].T @ columns
        moments = columns.T @ self.rows[rows] - shared.T @ (self.explained.T @ self.rows)
        pairs, shared_pairs = columns.reshape(-1, count, 2), shared.reshape(-1, count, 2)
        gram = np.einsum("fga,fgb->gab", pairs, pairs) - np.einsum("fga,fgb->gab", shared_pairs, shared_pairs)
        return gram, moments.reshape(count, 2, -1)


def _starts(data: Data, ratio: float) -> Array:
    """Return the first line of every block."""
    omega = data.p.imag
    step = float(omega[-1] - omega[0]) / (omega.size - 1)
    size = np.maximum(1, (ratio * omega / step / BLOCKS_PER_HALF_WIDTH).astype(int))
    starts = [0]
    while starts[-1] + size[starts[-1]] < omega.size:
        starts.append(int(starts[-1] + size[starts[-1]]))
    return np.array(starts)
