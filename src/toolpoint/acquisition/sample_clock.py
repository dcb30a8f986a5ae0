"""Lost samples by the clock: samples that should have come against samples that came.

Drivers do not always say that they lost samples (the ALSA device of PulseAudio never does). Blocks come late and in bursts, so the
deficit of a single moment says nothing; the least deficit over a few seconds does: some block is always on time.
"""

from __future__ import annotations

from collections import deque

from toolpoint._check import positive

WINDOW_SECONDS = 1.0  # s over which the least deficit is taken
MIN_LOSS_SECONDS = 0.008  # s of samples: a step of the least deficit beyond it is a loss; two clocks differ by 0.2 ms a second
MIN_WINDOW_BLOCKS = 10  # blocks of a window: a burst behind a pause holds the first of them late


class SampleClock:
    """Finds samples that were lost, within two windows of a second.

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
        self._window_start, self._checked = 0.0, 0
        self.lost_since = 0

    def count(self, samples: int, arrival: float) -> int:
        """Count a block that arrived at a time (s); return the samples found lost with it, between `lost_since` and now."""
        self.received += samples
        if self._first is None:
            self._first = arrival - samples / self.rate
            self._window_start = arrival
        self._window.append((arrival - self._first) * self.rate - self.received)
        if arrival - self._window_start < WINDOW_SECONDS or len(self._window) < MIN_WINDOW_BLOCKS:
            return 0
        return self._close_window(arrival)

    def _close_window(self, arrival: float) -> int:
        """Compare the least deficit of the window with that of the one before."""
        # The first quarter may still be late behind a pause; the last blocks of a burst are on time.
        deficit = min(self._window)
        reference, self._reference = self._reference, deficit
        self.lost_since, self._checked = self._checked, self.received
        self._window.clear()
        self._window_start = arrival
        step = 0.0 if reference is None else deficit - reference
        return round(step) if step > MIN_LOSS_SECONDS * self.rate else 0
