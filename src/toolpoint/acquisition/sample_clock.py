"""Lost samples by the clock: samples that should have come against samples that came.

Drivers do not always say that they lost samples (the ALSA device of PulseAudio never does). Blocks come late and in bursts, so
the deficit of a single moment says nothing; the least deficit over a second does: some block is always on time.
"""

from __future__ import annotations

from collections import deque
from statistics import median

from toolpoint._check import positive

WINDOW_SECONDS = 1.0  # s over which the least deficit is taken
# A step of the least deficit is a loss beyond ten times its median step, and beyond these ends, s of samples: two quartz clocks
# differ by 0.2 ms a second; a machine that is busy with other work is late by some milliseconds for a second.
LOSS_STEP_RATIO, LOSS_STEP_RANGE = 10.0, (0.002, 0.008)
STEP_COUNT = 30  # steps whose median is taken
MIN_WINDOW_BLOCKS = 10  # blocks of a window: a burst behind a pause holds the first of them late


class SampleClock:
    """Finds samples that were lost, within three windows of a second.

    Parameters
    ----------
    rate : float
        Nominal samples per second, Hz; the true one may differ by a few tenths of a per mille.

    Examples
    --------
    >>> from toolpoint.acquisition import SampleClock
    >>> clock = SampleClock(1000.0)
    >>> [clock.count(10, 0.01 * k) for k in range(1, 300)][-1]  # ten samples every 10 ms
    0
    >>> sum(clock.count(10, 0.05 + 0.01 * k) for k in range(300, 600))  # 50 ms went away
    50
    """

    def __init__(self, rate: float) -> None:
        self.rate = positive("rate", rate)
        self.received = 0
        self._first: float | None = None
        self._reference: float | None = None
        self._window = deque[float]()
        self._deficits = deque[float](maxlen=2)
        self._steps = deque[float](maxlen=STEP_COUNT)
        self._uncounted_step = 0.0  # samples, of the windows before
        self._window_start, self._checked = 0.0, deque[int]([0], maxlen=4)
        self.lost_since = 0

    def accept_gap(self) -> None:
        """Begin anew behind a gap that the driver has told of: the clock would find it again, without its place."""
        self._first, self._reference = None, None
        self._window.clear()
        self._deficits.clear()

    def count(self, samples: int, arrival: float) -> int:
        """Count a block that arrived at a time (s); return the samples found lost with it, between `lost_since` and now."""
        self.received += samples
        if self._first is None:
            self._first = arrival - self.received / self.rate
            self._window_start = arrival
        self._window.append((arrival - self._first) * self.rate - self.received)
        if arrival - self._window_start < WINDOW_SECONDS or len(self._window) < MIN_WINDOW_BLOCKS:
            return 0
        return self._close_window(arrival)

    def _close_window(self, arrival: float) -> int:
        """Compare the least deficit of the last two windows with that of those before."""
        # One window alone may be late as a whole, behind a pause of the program; samples that are late come, lost ones do not.
        self._deficits.append(min(self._window))
        self._checked.append(self.received)
        self._window.clear()
        self._window_start = arrival
        if len(self._deficits) < 2:
            return 0
        reference, self._reference = self._reference, min(self._deficits)
        step = 0.0 if reference is None else self._reference - reference
        low_end, high_end = LOSS_STEP_RANGE
        usual = median(self._steps) / self.rate if len(self._steps) == STEP_COUNT else high_end
        self._steps.append(abs(step))
        uncounted_step, self._uncounted_step = self._uncounted_step, step
        if step <= min(max(LOSS_STEP_RATIO * usual, low_end), high_end) * self.rate:
            return 0
        self._uncounted_step = 0.0
        # The loss may lie in the last block of the window before these two.
        self.lost_since = self._checked[0]
        # Where all blocks of a window before its loss came late, part of the loss was a step too small to be one by itself.
        return round(step + (uncounted_step if uncounted_step > low_end * self.rate else 0.0))
