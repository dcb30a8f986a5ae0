r"""Frames that are missing, doubled, or another blow: where a decay does not go on as its own past says.

Sums of damped exponentials obey one linear recurrence, :math:`x_t = \sum_j A_j x_{t-j}`, whatever their poles. It is fitted to
all frames twice, the second time without those that it predicts worst; a frame that is missing breaks it at that very frame.
Source: Kay, Modern Spectral Estimation, 1988, ch. 6 (linear prediction).
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.vision.modes.decay import FEWEST_FRAMES, FreeDecay

# Strongest components that are predicted, frames of their past, and share of worst frames that the second fit leaves out.
COMPONENTS, ORDER, WORST = 4, 8, 0.1
# Frames for every number of the recurrence.
PAST = 7
# A prediction error this many times the scale of those of the frames around it, and frames around it.
CLEAR, AROUND = 6.0, 24
# The same where a shift by whole frames explains this share of what follows.
FAIR, CERTAIN = 4.0, 0.85
# Share of a jump's prediction error that a shift by whole frames must explain to be named.
EXPLAINED = 0.5
SHIFTS = (-2, -1, 1, 2, 3)
# Share of a clear error that must be left in the frames after it.
FLASH = 0.3
# Frames by which a jump may be seen late.
EARLIER = 4
MOST_JUMPS = 8


@dataclass(frozen=True)
class Jump:
    """Where a decay breaks.

    frame : the first one that does not follow from those before; missing : frames that are missing before it (negative:
    doubled ones), 0 where a shift explains nothing; size : prediction error over the scale of those around it.
    """

    frame: int
    missing: int
    size: float


def find_jump(decay: FreeDecay) -> Jump | None:
    """Return the first frame at which a decay does not go on as its past says, None where there is none."""
    values = decay.components[:, :COMPONENTS]
    frames, channels = values.shape
    if frames < PAST * ORDER * channels:
        values = values[:, :max(1, frames // (PAST * ORDER))]
    past = np.concatenate([values[ORDER - j:frames - j] for j in range(1, ORDER + 1)], axis=1)
    if len(past) < PAST * past.shape[1] - ORDER:
        return None
    rule, error = _predicted(past, values[ORDER:])
    size = np.sqrt((error**2).mean(axis=1))
    scale = _scale_around(size)
    for at in np.flatnonzero(size > FAIR * scale).tolist():
        if ORDER + at + ORDER > frames:
            break
        apart = _shifted_errors(values, rule, ORDER + at)
        # What goes on as it was a frame later is no break: a flash of the light.
        if apart[0] > (FLASH * CLEAR * scale[at]) ** 2:
            best = min(apart, key=lambda shift: apart[shift])
            if size[at] < CLEAR * scale[at] and apart[best] > (1 - CERTAIN) * apart[0]:
                continue
            missing = best if apart[best] < (1 - EXPLAINED) * apart[0] else 0
            return Jump(decay.first + _first_frame(values, rule, ORDER + at, missing), missing, float(size[at] / scale[at]))
    return None


def find_unbroken(find: Callable[[float | None, float | None], FreeDecay], start: float | None = None,
                  stop: float | None = None, *, smoothed: bool = False) -> tuple[FreeDecay, tuple[Jump, ...]]:
    """Return the decay that tells most without a jump in it, and the jumps of the whole one, the first one first.

    find : the decay between two times (s); smoothed : the frames were compressed so much that key frames break every decay, and
    no jump is looked for.
    """
    whole = find(start, stop)
    jumps: list[Jump] = []
    best, todo = None, [whole]
    while todo and len(jumps) < MOST_JUMPS:
        part = todo.pop()
        jump = None if smoothed else find_jump(part)
        if jump is None:
            best = part if best is None or _worth(part) > _worth(best) else best
            continue
        jumps.append(jump)
        for low, high in ((part.first, jump.frame), (jump.frame, part.stop)):
            if high - low >= FEWEST_FRAMES:
                with suppress(ToolpointError):  # nothing stands out of the noise there
                    todo.append(find(low / whole.frame_rate, high / whole.frame_rate))
    return best or whole, tuple(sorted(jumps, key=lambda jump: jump.frame))


def _worth(part: FreeDecay) -> float:
    """Return what a part of a decay tells of its poles: power times the square of its length."""
    return float((part.components**2).sum()) * len(part.components) ** 2


def _predicted(past: FloatArray, now: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the recurrence, (order * channels, channels), and the errors of its predictions."""
    # Noise of one in every sample: the recurrence of noisy samples is regularised by as much.
    keep = np.ones(len(past), bool)
    for last in (False, True):
        gram = past[keep].T @ past[keep] + keep.sum() * 1e-3 * np.eye(past.shape[1])
        rule = np.linalg.solve(gram, past[keep].T @ now[keep])
        error = now - past @ rule
        if not last:
            size = (error**2).sum(axis=1)
            keep = size <= np.quantile(size, 1 - WORST)
    return rule, error


def _scale_around(size: FloatArray) -> FloatArray:
    """Return the median of errors in the frames around each, at least half of that of all."""
    n = len(size)
    around = np.array([np.median(size[max(0, k - AROUND):k + AROUND + 1]) for k in range(n)])
    return np.maximum(around, 0.5 * np.median(size))


def _first_frame(values: FloatArray, rule: FloatArray, at: int, missing: int) -> int:
    """Return the frame from which a shift by `missing` frames explains the samples best: noise hides a jump for some frames."""
    begin = at - EARLIER
    if missing == 0 or begin < ORDER:
        return at
    going = list(values[begin - ORDER:begin])
    for _ in range(EARLIER + ORDER + abs(missing)):
        going.append(np.concatenate(going[:-ORDER - 1:-1]) @ rule)
    predicted, true = np.array(going), values[begin:at + ORDER]
    n = len(true)
    before = ((true - predicted[ORDER:ORDER + n]) ** 2).sum(axis=1)
    after = ((true - predicted[ORDER + missing:ORDER + missing + n]) ** 2).sum(axis=1)
    return begin + int(np.argmin([before[:k].sum() + after[k:].sum() for k in range(EARLIER + 1)]))


def _shifted_errors(values: FloatArray, rule: FloatArray, at: int) -> dict[int, float]:
    """Return the mean square by which the samples after `at` differ from what the recurrence says of as many frames later."""
    going = list(values[at - ORDER:at])
    for _ in range(max(SHIFTS) + ORDER):
        going.append(np.concatenate(going[:-ORDER - 1:-1]) @ rule)
    predicted, true = np.array(going), values[at + 1:at + ORDER]
    return {shift: float(((predicted[ORDER + 1 + shift:ORDER + 1 + shift + len(true)] - true) ** 2).mean())
            for shift in (0, *SHIFTS)}
