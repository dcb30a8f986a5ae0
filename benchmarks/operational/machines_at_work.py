"""Random machines at work and their records: the ground under benchmarks/operational/random_records.py.

The modes are those of a random machine of benchmarks/joint_identification/joint_machines.py (three to eight of its lowest,
damping ratios drawn within 0.3 to 4 %). Two to four independent random forces act at random places, white or coloured; motors
add one to four harmonics of one rotating frequency, one of them within 1 % of a mode. Every mode obeys its exact recursion, so
the truth has no step error. Noise of every channel: 5 % of its rms.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy import signal

from benchmarks.joint_identification import joint_machines as jm
from toolpoint.machine import assemble
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Record, eigen

DURATION_S = 600.0
RATE_RATIO = 2.56 * 1.3  # sample rate over the highest frequency
NOISE_FRACTION = 0.05
MIN_SEPARATION = 0.03  # of neighbouring modes, relative; closer ones are drawn again
MODE_PARTICIPATION_MIN = 0.1  # rms of a mode over that of the strongest: weaker ones are not in the record


@dataclass(frozen=True, eq=False)
class Work:
    """A machine at work: its record, its true modes (Hz, ratio, shapes at the channels) and the frequencies of its
    harmonics."""

    record: Record
    frequency: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray
    harmonics: np.ndarray
    is_coloured: bool


def random_work(seed: int, duration: float = DURATION_S) -> Work:
    """Return the work of a seed."""
    rng = np.random.default_rng([seed, 33])
    while True:
        work = _attempt(rng, int(rng.integers(10**6)), duration)
        if work is not None:
            return work


def _attempt(rng: np.random.Generator, machine_seed: int, duration: float) -> Work | None:
    case = jm.random_case(machine_seed)
    machine = with_measured_points(case.machine, case.points.coordinates, case.points.components)
    names = [str(name) for name in case.points.coordinates]
    dofs = [f"{name}:{way}" for name in rng.choice(names, min(8, len(names)), replace=False) for way in ("+x", "+y", "+z")]
    chosen = sorted(rng.choice(len(dofs), int(rng.integers(5, 13)), replace=False).tolist())
    modes = eigen.solve_undamped(assemble(machine, outputs=dofs, inputs=dofs))
    count = int(rng.integers(3, 9))
    frequency = modes.frequency[:count]
    if modes.count < count or frequency[0] < 1 or (np.diff(frequency) < MIN_SEPARATION * frequency[:-1]).any():
        return None
    zeta = np.exp(rng.uniform(np.log(0.003), np.log(0.04), count))
    shape = modes.shape_at([dofs[i] for i in chosen])[:, :count]
    places = rng.choice(len(dofs), int(rng.integers(2, 5)), replace=False)
    push = modes.shape_at([dofs[i] for i in places])[:, :count]
    rate = RATE_RATIO * float(frequency[-1])
    samples = int(duration * rate)
    is_coloured = bool(rng.random() < 0.5)
    forces = rng.standard_normal((samples, len(places)))
    if is_coloured:
        forces = _coloured(forces, rng, rate, frequency)
    power = ((shape**2).mean(axis=0) * (push**2).sum(axis=0) / (4 * zeta * (2 * np.pi * frequency) ** 3))
    if (power < MODE_PARTICIPATION_MIN**2 * power.max()).any():
        push = push * np.sqrt(np.maximum(1.0, MODE_PARTICIPATION_MIN**2 * power.max() / power))
    motion = _modal_accelerations(forces @ push, frequency, zeta, rate)
    values = motion @ shape.T
    turning, numbers = _harmonics(rng, frequency)
    values = values + _harmonic_motion(rng, values, turning, numbers, rate)
    values = values + NOISE_FRACTION * values.std(axis=0) * rng.standard_normal(values.shape)
    record = Record(values, rate, [dofs[i] for i in chosen], "acceleration")
    return Work(record, frequency, zeta, shape, turning * numbers, is_coloured)


def _coloured(forces: np.ndarray, rng: np.random.Generator, rate: float, frequency: np.ndarray) -> np.ndarray:
    """Return forces through a slope and a broad hump (ratio 0.3 to 0.6) within the band of the modes."""
    pole = np.exp(-2 * np.pi * rng.uniform(0.3, 1.0) * frequency[-1] / rate)
    sloped = signal.lfilter([1 - pole], [1, -pole], forces, axis=0)
    centre, ratio = rng.uniform(frequency[0], frequency[-1]), rng.uniform(0.3, 0.6)
    root = np.exp(2 * np.pi * centre / rate * (-ratio + 1j * np.sqrt(1 - ratio**2)))
    hump = signal.lfilter([1.0], [1, -2 * root.real, abs(root) ** 2], forces, axis=0)
    return sloped / sloped.std() + hump / hump.std()


def _modal_accelerations(forces: np.ndarray, frequency: np.ndarray, zeta: np.ndarray, rate: float) -> np.ndarray:
    """Return modal accelerations, forces held between samples (exact for them)."""
    motion = np.empty_like(forces)
    for r in range(frequency.size):
        omega = 2 * np.pi * frequency[r]
        plant = signal.cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * zeta[r] * omega, omega**2]), 1 / rate, "zoh")
        start = signal.lfilter(plant[0].ravel(), plant[1], np.concatenate([forces[-4096 * 4:, r], forces[:, r]]))
        motion[:, r] = start[-forces.shape[0]:]
    return motion


def _harmonics(rng: np.random.Generator, frequency: np.ndarray) -> tuple[float, np.ndarray]:
    """Return a rotating frequency and the numbers of its harmonics; one of them lies within 1 % of a mode."""
    mode = float(frequency[rng.integers(frequency.size)])
    first = int(rng.integers(1, 5))
    turning = mode * (1 + rng.uniform(-0.01, 0.01)) / first
    others = rng.choice(np.arange(1, 9), int(rng.integers(0, 4)), replace=False)
    numbers = np.array(sorted({first, *map(int, others)}))
    return turning, numbers[turning * numbers < 1.2 * frequency[-1]]


def _harmonic_motion(rng: np.random.Generator, values: np.ndarray, turning: float, numbers: np.ndarray,
                     rate: float) -> np.ndarray:
    """Return the motion by the harmonics: rms 0.3 to 3 times that of the channels, the speed within 0 to 2e-4 of its mean."""
    time = np.arange(values.shape[0]) / rate
    wander = float(rng.choice([0.0, 2e-5, 2e-4]))
    memory = np.exp(-1 / (8 * rate))
    speed = signal.lfilter([np.sqrt(1 - memory**2)], [1, -memory], rng.standard_normal(time.size)) * wander
    angle = 2 * np.pi * turning * (time + np.cumsum(speed) / rate)
    total = np.zeros_like(values)
    for k in numbers:
        size = values.std(axis=0).mean() * np.exp(rng.uniform(np.log(0.3), np.log(3)))
        amplitude = size * rng.standard_normal((2, values.shape[1]))
        total += np.cos(k * angle)[:, None] * amplitude[0] + np.sin(k * angle)[:, None] * amplitude[1]
    return total
