r"""TurnedForces: samples of force records by the angle of the revolution at which they were taken, and their mean turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, fail
from toolpoint.vibration import Record

MAX_TURN_BINS = 720  # bins of a revolution
MIN_SCATTER_TURNS = 3  # turns from which the scatter of their means is known


@dataclass(frozen=True, eq=False)
class TurnedForces:
    """Samples of whole revolutions of one record, and their means in narrow bins of the rotation.

    Parameters
    ----------
    angle : (n,) floats
        Mean rotation from the first sample of the samples in each bin that holds any, rad.
    force : (n, d) floats
        Their mean force, N.
    count : (n,) floats
        Their number.
    per : float
        Samples of a revolution.
    spacing : float
        Rotation from one sample to the next, or the width of a bin where that is more, rad.
    samples : (m, d) floats
        Every sample, N; `bin` (m,) and `turn` (m,) say where it belongs.
    """

    angle: FloatArray
    force: FloatArray
    count: FloatArray
    per: float
    spacing: float
    samples: FloatArray
    bin: Array
    turn: Array

    @property
    def turns(self) -> int:
        """Whole revolutions."""
        return int(self.turn[-1]) + 1

    def mean_turn(self) -> tuple[FloatArray, FloatArray]:
        """Return the mean force over all revolutions (d,) and its standard deviation (d,), N: by their scatter, and by jumps.

        A turn holds a sample more or less than the next: turns are weighed by the angle that each sample stands for. Where
        every turn is sampled at the same angles, a jump of height J lies anywhere between two of n: J / (n sqrt(12)).
        """
        index = np.arange(self.samples.shape[0] + 1.0)
        total = np.concatenate([np.zeros((1, self.samples.shape[1])), np.cumsum(self.samples, axis=0)])
        ends = np.linspace(0.0, min(self.turns * self.per, index[-1]), self.turns + 1)
        courses = np.stack([np.diff(np.interp(ends, index, column)) for column in total.T], axis=1) / np.diff(ends)[:, None]
        if self.turns < MIN_SCATTER_TURNS:
            return courses.mean(axis=0), np.full(courses.shape[1], np.nan)
        return courses.mean(axis=0), np.sqrt(courses.var(axis=0, ddof=1) / self.turns + self._jump_variance())

    def _jump_variance(self) -> FloatArray:
        """Return the variance (d,) of the mean by jumps between samples; a jump shows in two second differences."""
        second = self.force - (np.roll(self.force, 1, axis=0) + np.roll(self.force, -1, axis=0)) / 2
        within = self.mean((self.samples - self.force[self.bin])**2) / np.maximum(self.count - 1, 1)[:, None]
        jumps = np.sum(4 * second**2 - 6 * within, axis=0)
        return np.asarray(np.maximum(jumps, 0.0) / (24 * self.angle.size**2))

    def mean(self, values: Array) -> FloatArray:
        """Return the means (n, k) over each bin of values (m, k) of the samples."""
        sums = [np.bincount(self.bin, column, self.angle.size) for column in values.T]
        return np.asarray(np.stack(sums, axis=1) / self.count[:, None], float)


def turn_forces(record: Record, speed: float) -> TurnedForces:
    """Return the samples of a force record by the rotation at which they were taken, at a constant speed in rev/min."""
    per = record.sample_rate * 60 / speed
    turn_count = int(record.samples.shape[0] / per + 1e-9)
    if turn_count < 1:
        fail("record", f"{record.samples.shape[0]} samples", f"must hold a revolution ({per:.0f} samples)")
    size = min(int(np.ceil(turn_count * per - 1e-9)), record.samples.shape[0])
    turned = np.arange(size) / per
    # A sample just at the end of a turn belongs to the next one, however its quotient rounds.
    turn = np.minimum((turned + 1e-9).astype(int), turn_count - 1)
    angle = 2 * np.pi * np.maximum(turned - turn, 0.0)
    bins = int(min(MAX_TURN_BINS, max(per, size // 4)))
    place = np.minimum((angle / (2 * np.pi) * bins + 1e-6).astype(int), bins - 1)
    count = np.bincount(place, minlength=bins)
    held = count > 0
    index = (np.cumsum(held) - 1)[place]
    values = np.column_stack([angle, record.samples[:size]])
    sums = np.stack([np.bincount(index, column, int(held.sum())) for column in values.T], axis=1)
    means = sums / count[held][:, None]
    return TurnedForces(means[:, 0], means[:, 1:], count[held].astype(float), per,
                        2 * np.pi / min(per, bins), np.asarray(record.samples[:size], float), index, turn)
