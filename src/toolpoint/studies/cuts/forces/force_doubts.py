"""Consistency of measured forces with the stated cut: speed by harmonics, scatter between turns, tools that fit better."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray, ToolpointError
from toolpoint._doubt import Doubt, status_of
from toolpoint.cutting.force.calibration import Calibration
from toolpoint.vibration import Record

MAX_PASSING_HARMONIC = 3  # of the tooth passing
MIN_SPEED_TURNS = 3  # revolutions by which a speed is judged
MIN_SPEED_DEVIATIONS, MIN_PHASE_DRIFT = 5.0, 0.05  # errors of the speed; drift of the tooth passing over the record, rad
# residual over what the scatter between turns explains; over the size of the forces
MAX_FORCE_MISFIT, NEGLIGIBLE_RESIDUAL_RATIO = 1.5, 0.01
MAX_RIVAL_RESIDUAL_RATIO = 0.7  # residual over that of the stated tool, below which another tool is named
TRIAL_HELIX_ANGLES = (0, 10, 20, 30, 40, 50)  # degrees


@dataclass(frozen=True)
class RecordSpeed:
    """Spindle speed in a force record and its standard error, rev/min.

    drift : of the tooth passing against the stated speed over the record, rad.
    """

    speed: float
    error: float
    drift: float

    def is_other(self, stated: float) -> bool:
        """Whether the record's speed is another one than the stated, beyond its error, and far enough to smear the forces."""
        return abs(self.speed - stated) > MIN_SPEED_DEVIATIONS * self.error and abs(self.drift) > MIN_PHASE_DRIFT


def split_turns(record: Record, speed: float) -> FloatArray:
    """Return the samples of all whole revolutions at equal angles, (n_turns, n_angle, n_channels), linear between samples."""
    samples_per_turn = record.sample_rate * 60 / speed
    turn_count, n = int(record.samples.shape[0] // samples_per_turn), int(samples_per_turn)
    positions = (np.arange(n)[None, :] / n + np.arange(turn_count)[:, None]) * samples_per_turn
    index = np.arange(record.samples.shape[0])
    return np.stack([np.interp(positions, index, column) for column in record.samples.T], axis=-1)


def record_speed(turns: FloatArray, speed: float, teeth: int) -> RecordSpeed | None:
    """Return the speed at which the harmonics of the revolution keep their phase; None for too few turns.

    At another speed harmonic k turns by k dw t: dw is the weighted slope of all phases against time, refined until it stays.
    """
    if len(turns) < MIN_SPEED_TURNS:
        return None
    last = min(MAX_PASSING_HARMONIC * teeth, (turns.shape[1] - 1) // 2)
    order = np.arange(1, last + 1)
    lines = np.fft.rfft(turns, axis=1)[:, 1:last + 1] / turns.shape[1]
    place = np.arange(len(turns)) - (len(turns) - 1) / 2  # turns
    step = np.angle(np.einsum("bkd,bkd->k", lines[1:], lines[:-1].conj()))
    strength = (np.abs(lines)**2).sum(axis=(0, 2))
    strongest = int(np.argmax(strength))
    drift = float(step[strongest] / order[strongest])  # rad of the spindle a turn
    for _ in range(20):
        level = lines * np.exp(-1j * drift * order * place[:, None])[..., None]
        mean = level.mean(axis=0)
        weight = float((place**2).sum() * (order[:, None]**2 * np.abs(mean)**2).sum())
        slope = float(np.imag(np.einsum("b,k,bkd,kd->", place, order, level, mean.conj()))) / max(weight, 1e-300)
        drift += slope
        if abs(slope) < 1e-12:
            break
    spread = float(np.mean(np.abs(level - mean)**2)) / 2 * len(turns) / (len(turns) - 1)
    error = float(np.sqrt(spread / max(weight, 1e-300)))
    return RecordSpeed(speed * (1 + drift / (2 * np.pi)), speed * error / (2 * np.pi), drift * len(turns) * teeth)


def speed_doubts(records: Sequence[tuple[float, Record, str]], speed: float, teeth: int) -> list[Doubt]:
    """Return a doubt about every record whose harmonics belong to another speed."""
    lines: list[Doubt] = []
    for _, part, name in records:
        measured = record_speed(split_turns(part, speed), speed, teeth)
        if measured is not None and measured.is_other(speed):
            lines.append(Doubt(name, f"its forces repeat at {measured.speed:.6g} ± {2 * measured.error:.1g} rev/min, not at "
                                     f"{speed:g}; at "
                               "the wrong speed the mean revolution is smeared", "give that `speed`", figure=measured.drift))
    return lines


def widen_intervals(fit: Calibration, average: Calibration | None, misfit: float, *, cause: Doubt) -> Calibration:
    """Return the fit marked doubtful, its intervals widened by the misfit and by the difference to the average forces.

    The intervals hold the misfit once, as if it were noise of single samples; what all samples share does not average out.
    """
    covariance = fit.covariance * max(misfit, 1.0)**2
    if average is not None:
        other = dict(zip(average.names, average.values.tolist(), strict=True))
        difference = np.array([value - other.get(name, value) for name,
                               value in zip(fit.names, fit.values.tolist(), strict=True)])
        covariance = covariance + np.diag(difference**2)
    return replace(fit, covariance=covariance, status=status_of([cause], "converged"))


def find_better_tool(cut: Mapping[str, Any], residual_of: Callable[[Mapping[str, Any]], float],
                     target_ratio: float = 0.0) -> str | None:
    """Return the change of helix, direction or teeth with the least residual, in words, where it explains the forces better.

    The search ends where the residual over that of the stated tool is below `target_ratio`.
    """
    stated = residual_of(cut)
    trials: list[tuple[float, str]] = []
    for words, other in _other_tools(cut):
        try:
            trials.append((residual_of(other) / stated, words))
        except (ToolpointError, np.linalg.LinAlgError):
            continue
        if trials[-1][0] < target_ratio:
            break
    share, words = min(trials, default=(1.0, ""))
    return f"{words} explains them better (residual {100 * share:.0f} % of that)" if share < MAX_RIVAL_RESIDUAL_RATIO else None


def _other_tools(cut: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    teeth, helix = int(cut["teeth"]), cut.get("helix")
    if np.ndim(helix or 0.0) == 0:
        for degrees in TRIAL_HELIX_ANGLES:
            if abs(np.degrees(float(helix or 0.0)) - degrees) > 2:
                yield f"a `helix` near {degrees} degrees", {**cut, "helix": np.radians(degrees)}
    for way in ("up", "down"):
        if cut.get("direction") in ("up", "down") and cut["direction"] != way:
            yield f"`direction` {way}", {**cut, "direction": way}
    if cut.get("pitch") is None and np.ndim(helix or 0.0) == 0:
        for n in sorted(set(range(1, 9)) - {teeth}, key=lambda n: abs(n - teeth)):
            yield f"`teeth` {n}", {**cut, "teeth": n}


def resample_courses(angle: FloatArray, forces: Array, max_count: int) -> tuple[FloatArray, FloatArray]:
    """Return at most `max_count` equal steps of angle from zero, and the forces there."""
    count = min(max_count, angle.size)
    coarse = 2 * np.pi * np.arange(count) / count
    columns = [[np.interp(coarse, angle, course[:, k], period=2 * np.pi) for k in range(forces.shape[2])] for course in forces]
    return coarse, np.asarray(np.moveaxis(np.array(columns), 1, 2), float)
