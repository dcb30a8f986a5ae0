"""Doubts of a video: modes that do not stand out, decays that break, missing frames, a rolling shutter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.vibration import Modes
from toolpoint.vision.displacement.measure import Scan
from toolpoint.vision.displacement.quality import Quality
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.modes.bodies import BodyMotion
from toolpoint.vision.modes.decay import FreeDecay
from toolpoint.vision.modes.jumps import Jump
from toolpoint.vision.modes.lines import find_break
from toolpoint.vision.modes.projection import PointShapes
from toolpoint.vision.modes.rate import doubt_rate

MIN_SEEN_SIGMA = 5.0  # standard deviations, from which a mode stands out of the noise
MIN_BREAK_DEVIATIONS = 10.0  # of the gain in misfit by a break of the decay
# Windows and rows that a phase over the rows needs, and groups of neighbouring rows whose scatter is its error.
MIN_WINDOWS, MIN_ROWS, ROW_GROUPS = 12, 40, 6
# Chi-squared of a window's phase from which it counts; standard deviations of a delay, and of its difference between modes.
MIN_PHASE_CHI_SQUARED, MIN_DELAY_DEVIATIONS, MAX_DELAY_DEVIATIONS = 50.0, 6.0, 3.0
# Delay over the rows, in frames, below which no shape is wrong by it: for several modes that agree, and for one alone.
MIN_COMMON_DELAY, MIN_LONE_DELAY = 0.1, 0.25


def video_doubts(scanned: Scan, quality: Quality, field: DisplacementField, *, decay: FreeDecay, poles: Modes,
                 shapes: PointShapes, bodies: tuple[BodyMotion, ...], unseen: Sequence[int], of_record: bool,
                 jumps: tuple[Jump, ...]) -> tuple[Doubt, ...]:
    """Return the doubts about a video's modes; unseen : those that do not stand out of the noise."""
    doubts: list[Doubt] = [*quality.doubts, *scanned.clip.doubts]
    rate = doubt_rate(decay, poles.poles) if of_record else ()
    stop = decay.first + len(decay.components)
    doubts += [_jump_doubt(jump, decay.first, stop) for jump in jumps]
    if not jumps and not has_smoothed_frames(scanned, quality):
        doubts += rate or _question_break(decay, poles)  # poles that do not fit look like a break anywhere
    else:
        doubts += rate
    doubts += [text for body in bodies for text in body.doubts]
    for i in unseen:
        doubts.append(Doubt(f"mode {i + 1} at {poles.frequency[i]:.4g} Hz", "does not stand out of the noise in the video: its "
                            "shape is noise, or the motion is along the line of sight"))
    if scanned.clip.row_delay == 0:
        doubts += rolling_doubt(poles, shapes, field)
    return tuple(dict.fromkeys(doubts))


def has_smoothed_frames(scanned: Scan, quality: Quality) -> bool:
    """Return whether compression took so much that its key frames break every decay."""
    return scanned.clip.is_lossy and not quality.accepts_amplitude


def _jump_doubt(jump: Jump, first: int, stop: int) -> Doubt:
    frame_count = abs(jump.missing_frames)
    what = (f"{frame_count} frame{'s are' if frame_count > 1 else ' is'} missing before it" if jump.missing_frames > 0 else
            f"{frame_count} frame{'s are' if frame_count > 1 else ' is'} repeated before it" if jump.missing_frames < 0 else
            "the machine was struck again, or the camera changed")
    return Doubt("decay", f"the decay breaks at frame {jump.frame} (the first is 0), which does not follow from those before: "
                 f"{what}; modes are those of frames {first} to {stop - 1} alone", "export all frames of the camera, or state "
                 "start and stop", figure=jump.size)


def _question_break(decay: FreeDecay, poles: Modes) -> tuple[Doubt, ...]:
    frame, gain = find_break(decay, poles.poles)
    freedom = 2 * poles.count * decay.components.shape[1]
    if gain <= freedom + MIN_BREAK_DEVIATIONS * np.sqrt(2 * freedom) + 0.002 * float((decay.components**2).sum()):
        return ()
    return (Doubt("decay", f"the decay breaks near frame {frame}: frames were dropped or repeated there, or the machine was "
                  "struck again; damping and intervals rest on one unbroken decay", "state start and stop"),)


def rolling_doubt(poles: Modes, shapes: PointShapes, field: DisplacementField) -> list[Doubt]:
    """Return a doubt where the phase of the modes runs with the row by one delay: a rolling shutter that was not stated.

    Complex modes, close poles and windows that follow unevenly turn phases too, but not every mode by the same delay; the error
    of a delay is what groups of rows scatter.
    """
    rows = field.windows.centres[:, 1]
    delays = [d for d in (_delay(shapes, rows, mode, float(poles.frequency[mode])) for mode in range(poles.count)) if d]
    if not delays:
        return []
    value, error = np.array(delays).T
    weight = 1 / error**2
    mean, spread = float((weight * value).sum() / weight.sum()), float(1 / np.sqrt(weight.sum()))
    deviation = spread * max(1.0, float(np.sqrt((weight * (value - mean) ** 2).sum() / max(len(value) - 1, 1))))
    total = mean * float(rows.max())
    delay_min = MIN_COMMON_DELAY if len(value) > 1 and (np.abs(value - mean) < MAX_DELAY_DEVIATIONS *
                                                        np.hypot(error, spread)).all() else MIN_LONE_DELAY
    if abs(mean) < MIN_DELAY_DEVIATIONS * deviation or abs(total) < delay_min / field.frame_rate:
        return []
    return [Doubt("shutter", f"the phase of the modes runs with the row: it seems to roll by {1e6 * mean:.3g} us a row",
                  "state it (row delay), so that shapes get their true phases", figure=abs(total) * field.frame_rate)]


def _delay(shapes: PointShapes, rows: FloatArray, mode: int, frequency: float) -> tuple[float, float] | None:
    """Return the delay of a mode's phase a row and its standard error, s; None where too few windows see it."""
    values = shapes.shape[:, :, mode]
    weight = np.abs(values) ** 2 / np.maximum(shapes.deviation()[:, :, mode] ** 2, 1e-12)
    square = (weight * np.exp(2j * np.angle(values))).sum(axis=1)
    used = np.abs(square) > MIN_PHASE_CHI_SQUARED
    if used.sum() < MIN_WINDOWS or np.ptp(rows[used]) < MIN_ROWS:
        return None
    centre = np.angle(square[used].sum())
    phase = np.angle(square[used] * np.exp(-1j * centre)) / 2
    order = np.argsort(rows[used])
    x, y, sure = rows[used][order], phase[order], np.sqrt(np.abs(square[used]))[order]
    slope = _slope(x, y, sure)
    groups = np.array_split(np.arange(x.size), ROW_GROUPS)
    others = np.array([_slope(*(np.delete(part, group) for part in (x, y, sure))) for group in groups])
    error = float(np.sqrt((ROW_GROUPS - 1) * ((others - others.mean()) ** 2).mean()))
    turn = 2 * np.pi * frequency
    return slope / turn, max(error, 1e-12) / turn


def _slope(x: FloatArray, y: FloatArray, weight: FloatArray) -> float:
    design = np.stack([np.ones_like(x), x], axis=1) * weight[:, None]
    return float(np.linalg.lstsq(design, y * weight, rcond=None)[0][1])
