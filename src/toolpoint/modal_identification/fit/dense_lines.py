"""Trial poles on very many lines: lines averaged in blocks far narrower than a resonance, each trial on the lines about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.modal_identification.basis import pole_terms, real_rows
from toolpoint.modal_identification.fit.refinement import Data

DENSE = 6000  # lines above which they are averaged
PARTS = 4  # averaged lines to a half width
REACH = 15.0  # half widths to either side of a trial pole that it is looked at over
TOGETHER = 40  # trial poles worked on at once


@dataclass(frozen=True, eq=False)
class AveragedLines:
    """Blocks of lines: p and weight of each (the square root of its lines, times the factor), the residual as real rows, and an
    orthonormal basis of what other modes and outside terms explain."""

    p: ComplexArray
    weight: ComplexArray
    rows: FloatArray
    known: FloatArray

    @classmethod
    def of(cls, data: Data, poles: ComplexArray, left: ComplexArray, *, ratio: float) -> AveragedLines:
        """Return the lines of `data` averaged in blocks of a quarter of the half width that damping `ratio` gives there."""
        starts = _starts(data, ratio)
        size = np.diff(np.append(starts, data.p.size))

        def mean(values: Array) -> Array:
            shape = (-1, *([1] * (values.ndim - 1)))
            return np.add.reduceat(values, starts, axis=0) / size.reshape(shape)

        root = np.sqrt(size)
        rows = real_rows(mean(left.reshape(left.shape[0], -1)) * root[:, None])
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
        for first in range(0, trial.size, TOGETHER):
            some = np.abs(trial[first:first + TOGETHER])
            inside = np.flatnonzero((lines >= some[0] * (1 - REACH * ratio)) & (lines <= some[-1] * (1 + REACH * ratio)))
            if inside.size == 0:  # trials below the first averaged line of a band that begins near 0 Hz
                inside = np.array([int(np.argmin(np.abs(lines - some.mean())))])
            yield slice(first, first + TOGETHER), inside

    def _part(self, trial: ComplexArray, inside: Array) -> tuple[FloatArray, FloatArray]:
        count = trial.size
        terms = pole_terms(self.p[inside], trial) * self.weight[inside, None, None]
        columns = real_rows(terms.reshape(inside.size, -1))
        rows = np.concatenate([inside, self.p.size + inside])
        shared = self.known[rows].T @ columns
        moments = columns.T @ self.rows[rows] - shared.T @ (self.known.T @ self.rows)
        pairs, seen = columns.reshape(-1, count, 2), shared.reshape(-1, count, 2)
        gram = np.einsum("fga,fgb->gab", pairs, pairs) - np.einsum("fga,fgb->gab", seen, seen)
        return gram, moments.reshape(count, 2, -1)


def _starts(data: Data, ratio: float) -> Array:
    """Return the first line of every block."""
    omega = data.p.imag
    step = float(omega[-1] - omega[0]) / (omega.size - 1)
    size = np.maximum(1, (ratio * omega / step / PARTS).astype(int))
    starts = [0]
    while starts[-1] + size[starts[-1]] < omega.size:
        starts.append(int(starts[-1] + size[starts[-1]]))
    return np.array(starts)
