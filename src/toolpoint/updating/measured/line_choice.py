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

MIN_CHOSEN_LINES = 240
# Standard deviations by which a step must stand above those of noise; share of the mean size below which turning means little.
MIN_SIGNAL_DEVIATIONS, MAX_WEAK_SHARE = 4.0, 0.1


def choose_lines(targets: Targets, count_max: int = MIN_CHOSEN_LINES) -> IndexArray:
    """Return the indices (at most `count_max`, increasing) of lines that carry the responses of targets."""
    frf = targets.frf
    assert frf is not None
    count = frf.frequency.size
    if count <= count_max:
        return np.arange(count)
    step = np.linalg.norm(np.diff(frf.values, axis=0).reshape(count - 1, -1), axis=1)
    size = np.linalg.norm(frf.values.reshape(count, -1), axis=1)
    # Of a step of noise alone, n^2 of both its lines by its mean, the square scatters by the root of the number of responses.
    isolated = (targets.noise_of_lines() ** 2).reshape(count, -1).sum(axis=1)
    clear = step**2 > (isolated[1:] + isolated[:-1]) * (1 + MIN_SIGNAL_DEVIATIONS / np.sqrt(frf.values[0].size))
    lower = np.maximum((size[1:] + size[:-1]) / 2, MAX_WEAK_SHARE * float(np.sqrt((size**2).mean())))
    turning = np.where(clear, step / np.maximum(lower, 1e-300), 0.0)
    # Each line's share of all that is to be told; equal shares are cut from the sum.
    share = 1 / (count - 1) + (turning / turning.sum() if turning.sum() > 0 else 0.0)
    total = np.concatenate([[0.0], np.cumsum(share)])
    chosen: IndexArray = np.unique(np.searchsorted(total, np.linspace(0, total[-1], count_max), side="left").clip(0, count - 1))
    return chosen


def on_chosen_lines(targets: Targets, count_max: int = MIN_CHOSEN_LINES) -> Targets:
    """Return targets whose responses stand on the lines that carry them; the same object where they are few anyway."""
    frf = targets.frf
    if frf is None or frf.frequency.size <= count_max:
        return targets
    positions = choose_lines(targets, count_max)
    noise = None if targets.frf_noise is None else targets.frf_noise[positions]
    return replace(targets, frf=_at_lines(frf, positions), frf_noise=noise,
                   line_correlation=None if targets.line_correlation is None
                   else targets.line_correlation[np.ix_(positions, positions)])


def _at_lines(frf: Frf, positions: IndexArray) -> Frf:
    def part(array: FloatArray | None) -> FloatArray | None:
        return None if array is None else array[positions]

    return replace(frf, frequency=frf.frequency[positions], values=frf.values[positions], coherence=part(frf.coherence),
                   variance=part(frf.variance), draws=None)
