r"""Lines that carry a measurement: many where responses turn, few where nothing resonates.

A fit far from its end needs no more lines than tell where the resonances are; all of them count at the end. Half of the chosen
lines lie evenly over the band, half where the responses :math:`H(f)` of all points together turn,
:math:`s_f = \|H_{f+1} - H_f\| / \|H\|`, where that is more than noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.updating.measured.targets import Targets
from toolpoint.vibration import Frf

ENOUGH = 240
# Standard deviations by which a step must stand above those of noise; share of the mean size below which turning means little.
_SURE, _WEAK = 4.0, 0.1


def choose_lines(targets: Targets, most: int = ENOUGH) -> IndexArray:
    """Return the indices (at most `most`, increasing) of lines that carry the responses of targets."""
    frf = targets.frf
    assert frf is not None
    count = frf.frequency.size
    if count <= most:
        return np.arange(count)
    step = np.linalg.norm(np.diff(frf.values, axis=0).reshape(count - 1, -1), axis=1)
    size = np.linalg.norm(frf.values.reshape(count, -1), axis=1)
    # Of a step of noise alone, n^2 of both its lines by its mean, the square scatters by the root of the number of responses.
    alone = (targets.noise_of_lines() ** 2).reshape(count, -1).sum(axis=1)
    clear = step**2 > (alone[1:] + alone[:-1]) * (1 + _SURE / np.sqrt(frf.values[0].size))
    low = np.maximum((size[1:] + size[:-1]) / 2, _WEAK * float(np.sqrt((size**2).mean())))
    turning = np.where(clear, step / np.maximum(low, 1e-300), 0.0)
    # Each line's share of all that is to be told; equal shares are cut from the sum.
    share = 1 / (count - 1) + (turning / turning.sum() if turning.sum() > 0 else 0.0)
    total = np.concatenate([[0.0], np.cumsum(share)])
    chosen: IndexArray = np.unique(np.searchsorted(total, np.linspace(0, total[-1], most), side="left").clip(0, count - 1))
    return chosen


def on_chosen_lines(targets: Targets, most: int = ENOUGH) -> Targets:
    """Return targets whose responses stand on the lines that carry them; the same object where they are few anyway."""
    frf = targets.frf
    if frf is None or frf.frequency.size <= most:
        return targets
    at = choose_lines(targets, most)
    return replace(targets, frf=_at_lines(frf, at), frf_noise=None if targets.frf_noise is None else targets.frf_noise[at],
                   line_correlation=None if targets.line_correlation is None
                   else targets.line_correlation[np.ix_(at, at)])


def _at_lines(frf: Frf, at: IndexArray) -> Frf:
    def part(array: FloatArray | None) -> FloatArray | None:
        return None if array is None else array[at]

    return replace(frf, frequency=frf.frequency[at], values=frf.values[at], coherence=part(frf.coherence),
                   variance=part(frf.variance))
