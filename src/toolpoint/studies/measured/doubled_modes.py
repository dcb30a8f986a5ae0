"""Modes that a test holds twice: two poles of one shape, a hair apart, of which joints take one."""

from __future__ import annotations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.vibration.correlation import mac
from toolpoint.vibration.modes import Modes

MIN_DOUBLED_MAC, MAX_DOUBLED_SPAN = 0.99, 0.005  # correlation and relative distance of the frequencies of one mode found twice


def leave_doubled_out(modes: Modes) -> tuple[Modes, list[Doubt]]:
    """Return the modes without those that repeat another one, and a doubt for each.

    Two poles a hair apart with one shape are one mode whose frequency moved within the test: by a sensor that was carried from
    point to point, or by a machine that warmed up. Of the two the one that moves its responses more stays. Two modes of a
    structure that look alike at all points would tell its joints one motion only, too.

    Shapes that are the same to the last digit are no measurement: they stay, to be refused.

    Examples
    --------
    >>> shape = np.array([[1.0, 1.0, 0.2], [0.5, 0.49, -1.0], [-0.3, -0.3, 0.4]]) * [2.0, 1.0, 1.0]
    >>> modes = Modes(np.array([45.74, 45.87, 80.0]), np.full(3, 0.02), shape, ("1:+x", "2:+x", "3:+x"))
    >>> kept, doubts = leave_doubled_out(modes)
    >>> kept.frequency.tolist(), len(doubts)
    ([45.74, 80.0], 1)
    """
    correlation = mac(modes.shape, modes.shape)
    size = np.linalg.norm(modes.shape, axis=0)
    left_out, doubts = set[int](), list[Doubt]()
    for i in range(modes.count):
        for j in range(i):
            span = abs(modes.frequency[i] - modes.frequency[j]) / max(modes.frequency[i], modes.frequency[j], 1e-300)
            is_doubled = MIN_DOUBLED_MAC <= correlation[i, j] <= 1 - 1e-9 and span <= MAX_DOUBLED_SPAN
            if not is_doubled or {i, j} & left_out:
                continue
            weaker = i if size[i] <= size[j] else j
            left_out.add(weaker)
            doubts.append(Doubt(
                f"modes {j + 1} and {i + 1} ({modes.frequency[j]:.4g} and {modes.frequency[i]:.4g} Hz)",
                f"have the same shape (MAC {correlation[i, j]:.4f}): they count as one mode found twice, and the one of "
                f"{modes.frequency[weaker]:.4g} Hz is left out",
                "identify the modes again (toolpoint identify): a sensor that was moved, or a machine that warms up, shows one "
                "mode twice", figure=float(correlation[i, j])))
    return (modes.selected([k for k in range(modes.count) if k not in left_out]), doubts) if left_out else (modes, [])
