"""Record player: a device that delivers recorded samples in real time, faster, or as fast as they are read; with faults."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint._doubt import Doubt
from toolpoint.acquisition.device import DeviceFault, SampleBlock
from toolpoint.acquisition.sample_clock import SampleClock

PLAYED_BLOCK_SECONDS = 0.01  # s of samples in a block


@dataclass(frozen=True)
class PlayerFaults:
    """Faults that a player shows: samples after which the device goes away, and samples that are lost, told or not.

    unplugged_at : sample, None never; lost_at, lost_count : sample and number of samples that are left out; is_told : whether
    the driver says so.
    """

    unplugged_at: int | None = None
    lost_at: int | None = None
    lost_count: int = 0
    is_told: bool = True


class RecordPlayer:
    """Plays records one behind the other.

    Parameters
    ----------
    records : sequence of (n, n_channels) floats
        V.
    rate : float
        Hz.
    speed : float, optional
        1 is real time; None delivers as fast as it is read, with the times that real time would have.
    names, units : sequence of str, optional
    limit : float, optional
        Largest value that the device can show.
    faults : PlayerFaults, optional

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.acquisition import RecordPlayer
    >>> player = RecordPlayer([np.ones((1000, 2))], 1000.0, speed=None)
    >>> player.open()
    >>> block = player.read(1.0)
    >>> block.samples.shape, block.stop
    ((10, 2), 10)
    """

    def __init__(self, records: Sequence[FloatArray], rate: float, *, speed: float | None = 1.0, names: Sequence[str] = (),
                 units: Sequence[str] = (), limit: float | None = None, faults: PlayerFaults | None = None) -> None:
        if not records:
            fail("records", "none", "must be at least one")
        columns = floats("records", records[0], (None, None)).shape[1]
        self._samples = np.concatenate([floats("records", record, (None, columns)) for record in records])
        self.rate, self._speed = positive("rate", rate), None if speed is None else positive("speed", speed)
        self.names = tuple(names) or tuple(f"channel {k + 1}" for k in range(columns))
        self.units = tuple(units) or ("",) * columns
        self.ranges: tuple[float | None, ...] = (limit,) * columns
        self.doubts: tuple[Doubt, ...] = ()
        self._faults = faults or PlayerFaults()
        self._place, self._delivered, self._begun = 0, 0, 0.0
        self._clock = SampleClock(self.rate)

    def open(self) -> None:
        """Begin with the first sample."""
        self._place, self._delivered, self._begun = 0, 0, time.monotonic()

    def close(self) -> None:
        """Stop."""

    def read(self, timeout: float) -> SampleBlock | None:
        """Return the next ten milliseconds of samples, when they are due."""
        faults = self._faults
        if faults.unplugged_at is not None and self._place >= faults.unplugged_at:
            raise DeviceFault("device: the player's device went away, as it was told to")
        if self._place >= self._samples.shape[0]:
            raise StopIteration
        size = max(round(PLAYED_BLOCK_SECONDS * self.rate), 1)
        skipped = faults.lost_count if faults.lost_at is not None and self._place <= faults.lost_at < self._place + size else 0
        self._place += skipped
        samples = self._samples[self._place:self._place + size]
        self._place += samples.shape[0]
        arrival = self._wait_until_due(self._place / self.rate)
        if bool(skipped) and faults.is_told:
            self._clock.accept_gap()
        lost_count = self._clock.count(samples.shape[0], arrival)
        block = SampleBlock(samples, self._delivered, arrival, bool(skipped) and faults.is_told, lost_count,
                            self._clock.lost_since)
        self._delivered = block.stop
        return block

    def _wait_until_due(self, seconds: float) -> float:
        """Return the time at which a sample is due, after waiting for it."""
        if self._speed is None:
            return self._begun + seconds
        due = self._begun + seconds / self._speed
        time.sleep(max(due - time.monotonic(), 0.0))
        # Played faster, the clock of the records counts, else every block would seem to come too soon.
        return self._begun + (time.monotonic() - self._begun) * self._speed
