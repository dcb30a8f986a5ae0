"""Figures of a step response: delay, rise time, overshoot, settling time, steady error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats, increasing, positive
from toolpoint._notebook import NotebookText


@dataclass(frozen=True)
class StepFigures(NotebookText):
    """Rise time from 10 to 90 % and settling time (s), overshoot (share of the step), steady error (unit of the signal)."""

    rise_time: float
    settling_time: float
    overshoot: float
    peak_time: float
    steady_error: float

    def __repr__(self) -> str:
        return (f"StepFigures(rise {1e3 * self.rise_time:.4g} ms, settled after {1e3 * self.settling_time:.4g} ms, "
                f"overshoot {100 * self.overshoot:.3g} %, steady error {self.steady_error:.3g})")


def step_figures(time: FloatArray, response: FloatArray, height: float, *, start: float = 0.0, band: float = 0.02
                 ) -> StepFigures:
    """Return the figures of the response to a step of `height` given at `start` (s).

    The settling time is the first after which the response stays within `band` of the height about its last value.

    Examples
    --------
    A first-order lag of 1 ms rises from 10 to 90 % in ln(9) ms:

    >>> import numpy as np
    >>> time = np.linspace(0, 0.02, 20001)
    >>> print(f"{1e3 * step_figures(time, 1 - np.exp(-time / 1e-3), 1.0).rise_time:.3f} ms")
    2.197 ms
    """
    t = increasing("time", floats("time", time, (None,)))
    y = floats("response", response, t.shape) / height
    after = t >= start
    if after.sum() < 3:
        fail("start", f"{start:g} s", f"must leave samples before {t[-1]:g} s")
    t, y = t[after] - start, y[after]
    positive("band", band, 1.0)

    def crossing(level: float) -> float:
        k = int(np.argmax(y >= level))
        if y[k] < level:
            fail("response", f"largest {y.max():.3g} of the step", f"must reach {level:g}", remedy="simulate longer")
        return float(t[k] if k == 0 else t[k - 1] + (level - y[k - 1]) / (y[k] - y[k - 1]) * (t[k] - t[k - 1]))

    outside = np.flatnonzero(np.abs(y - y[-1]) > band)
    settled = float(t[min(outside[-1] + 1, t.size - 1)]) if outside.size else 0.0
    peak = int(y.argmax())
    return StepFigures(crossing(0.9) - crossing(0.1), settled, max(float(y[peak] - y[-1]), 0.0), float(t[peak]),
                       float((1 - y[-1]) * height))
