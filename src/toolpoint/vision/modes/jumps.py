r"""Frames that are missing, doubled, or another blow: a decay breaks where linear prediction from its past fails.

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
from toolpoint.vision.modes.decay import MIN_DECAY_FRAMES, FreeDecay

# Strongest components that are predicted, frames of their past, and share of worst frames that the second fit leaves out.
PREDICTED_COMPONENTS, PREDICTION_ORDER, WORST_FRAME_FRACTION = 4, 8, 0.1
# Frames for every number of the recurrence.
FRAMES_PER_COEFFICIENT = 7
# A prediction error this many times the scale of those of the frames around it, and frames around it.
CLEAR_JUMP_RATIO, NEIGHBOUR_FRAMES = 6.0, 24
# The same where a shift by whole frames explains this share of what follows.
EXPLAINED_JUMP_RATIO, EXPLAINED_JUMP_FRACTION = 4.0, 0.85
# Share of a jump's prediction error that a shift by whole frames must explain to be named.
NAMED_JUMP_FRACTION = 0.5
FRAME_SHIFTS = (-2, -1, 1, 2, 3)  # whole frames that may be doubled (negative) or missing
# Share of a clear error that must be left in the frames after it.
MIN_LASTING_FRACTION = 0.3
# Frames by which a jump may be seen late.
MAX_JUMP_DELAY = 4
MAX_JUMPS = 8


@dataclass(frozen=True)
class Jump:
    """Break in a decay.

    frame : the first one that does not follow from those before; missing_frames : frames that are missing before it (negative:
    doubled ones), 0 where a shift explains nothing; size : prediction error over the scale of those around it.
    """

    frame: int
    missing_frames: int
    size: float


def find_jump(decay: FreeDecay) -> Jump | None:
    """Return the first frame at which a decay does not go on as its past says, None where there is none."""
    values = decay.components[:, :PREDICTED_COMPONENTS]
    frames, channels = values.shape
    if frames < FRAMES_PER_COEFFICIENT * PREDICTION_ORDER * channels:
        values = values[:, :max(1, frames // (FRAMES_PER_COEFFICIENT * PREDICTION_ORDER))]
    past = np.concatenate([values[PREDICTION_ORDER - j:frames - j] for j in range(1, PREDICTION_ORDER + 1)], axis=1)
    if len(past) < FRAMES_PER_COEFFICIENT * past.shape[1] - PREDICTION_ORDER:
        return None
    recurrence, error = _fit_recurrence(past, values[PREDICTION_ORDER:])
    error_size = np.sqrt((error**2).mean(axis=1))
    scale = _scale_around(error_size)
    for place in np.flatnonzero(error_size > EXPLAINED_JUMP_RATIO * scale).tolist():
        if PREDICTION_ORDER + place + PREDICTION_ORDER > frames:
            break
        shift_errors = _shifted_errors(values, recurrence, PREDICTION_ORDER + place)
        # What goes on as it was a frame later is no break: a flash of the light.
        if shift_errors[0] > (MIN_LASTING_FRACTION * CLEAR_JUMP_RATIO * scale[place]) ** 2:
            best_shift = min(shift_errors, key=lambda shift: shift_errors[shift])
            if (error_size[place] < CLEAR_JUMP_RATIO * scale[place]
                    and shift_errors[best_shift] > (1 - EXPLAINED_JUMP_FRACTION) * shift_errors[0]):
                continue
            missing_frames = best_shift if shift_errors[best_shift] < (1 - NAMED_JUMP_FRACTION) * shift_errors[0] else 0
            return Jump(decay.first + _first_frame(values, recurrence, PREDICTION_ORDER + place, missing_frames),
                        missing_frames, float(error_size[place] / scale[place]))
    return None


def find_unbroken(find: Callable[[float | None, float | None], FreeDecay], start: float | None = None,
                  stop: float | None = None, *, smoothed: bool = False) -> tuple[FreeDecay, tuple[Jump, ...]]:
    """Return the decay that tells most without a jump in it, and the jumps of the whole one, the first one first.

    find : the decay between two times (s); smoothed : the frames were compressed so much that key frames break every decay, and
    no jump is looked for.
    """
    whole_decay = find(start, stop)
    jumps: list[Jump] = []
    best, pending = None, [whole_decay]
    while pending and len(jumps) < MAX_JUMPS:
        part = pending.pop()
        jump = None if smoothed else find_jump(part)
        if jump is None:
            best = part if best is None or _information_of(part) > _information_of(best) else best
            continue
        jumps.append(jump)
        for first_frame, end_frame in ((part.first, jump.frame), (jump.frame, part.stop)):
            if end_frame - first_frame >= MIN_DECAY_FRAMES:
                with suppress(ToolpointError):  # nothing stands out of the noise there
                    pending.append(find(first_frame / whole_decay.frame_rate, end_frame / whole_decay.frame_rate))
    return best or whole_decay, tuple(sorted(jumps, key=lambda jump: jump.frame))


def _information_of(part: FreeDecay) -> float:
    """Return what a part of a decay tells of its poles: power times the square of its length."""
    return float((part.components**2).sum()) * len(part.components) ** 2


def _fit_recurrence(past: FloatArray, now: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the recurrence, (order * channels, channels), and the errors of its predictions."""
    # Noise of one in every sample: the recurrence of noisy samples is regularised by as much.
    keep = np.ones(len(past), bool)
    for last in (False, True):
        gram = past[keep].T @ past[keep] + keep.sum() * 1e-3 * np.eye(past.shape[1])
        rule = np.linalg.solve(gram, past[keep].T @ now[keep])
        error = now - past @ rule
        if not last:
            size = (error**2).sum(axis=1)
            keep = size <= np.quantile(size, 1 - WORST_FRAME_FRACTION)
    return rule, error


def _scale_around(size: FloatArray) -> FloatArray:
    """Return the median of errors in the frames around each, at least half of that of all."""
    n = len(size)
    around = np.array([np.median(size[max(0, k - NEIGHBOUR_FRAMES):k + NEIGHBOUR_FRAMES + 1]) for k in range(n)])
    return np.maximum(around, 0.5 * np.median(size))


def _first_frame(values: FloatArray, rule: FloatArray, frame: int, missing_frames: int) -> int:
    """Return the frame from which a shift by `missing_frames` explains the samples best: noise hides a jump for some frames."""
    begin = frame - MAX_JUMP_DELAY
    if missing_frames == 0 or begin < PREDICTION_ORDER:
        return frame
    prediction = list(values[begin - PREDICTION_ORDER:begin])
    for _ in range(MAX_JUMP_DELAY + PREDICTION_ORDER + abs(missing_frames)):
        prediction.append(np.concatenate(prediction[:-PREDICTION_ORDER - 1:-1]) @ rule)
    predicted, true = np.array(prediction), values[begin:frame + PREDICTION_ORDER]
    n = len(true)
    unshifted_error = ((true - predicted[PREDICTION_ORDER:PREDICTION_ORDER + n]) ** 2).sum(axis=1)
    shifted_error = ((true
                      - predicted[PREDICTION_ORDER + missing_frames:PREDICTION_ORDER + missing_frames + n]) ** 2).sum(axis=1)
    return begin + int(np.argmin([unshifted_error[:k].sum() + shifted_error[k:].sum() for k in range(MAX_JUMP_DELAY + 1)]))


def _shifted_errors(values: FloatArray, rule: FloatArray, frame: int) -> dict[int, float]:
    """Return the mean square by which the samples after `frame` differ from the recurrence's prediction, for each shift."""
    prediction = list(values[frame - PREDICTION_ORDER:frame])
    for _ in range(max(FRAME_SHIFTS) + PREDICTION_ORDER):
        prediction.append(np.concatenate(prediction[:-PREDICTION_ORDER - 1:-1]) @ rule)
    predicted, true = np.array(prediction), values[frame + 1:frame + PREDICTION_ORDER]
    return {shift: float(((predicted[PREDICTION_ORDER + 1 + shift:PREDICTION_ORDER + 1 + shift + len(true)]
                           - true) ** 2).mean())
            for shift in (0, *FRAME_SHIFTS)}
