"""Virtual hammer records with known truth, for the tests of the front end."""

from __future__ import annotations

import numpy as np

from toolpoint import Dof, Modes, Record
from toolpoint.vibration.frequency_response import modal
from toolpoint.vibration.simulation.time_response import modal_superposition

RATE, DURATION = 2048.0, 1.0
MODES = Modes(np.array([60.0, 140.0, 260.0]), np.array([0.03, 0.02, 0.02]),
              np.array([[1.0, 0.8, 0.6], [0.7, -0.9, 0.4], [-0.3, 0.6, 0.9]]), ["1:+x", "2:+x", "3:+x"])
BLOCK = int(RATE * DURATION)


def pulse(start: int, n: int, height: float = 100.0, width: int = 8) -> np.ndarray:
    """Return a half-sine pulse."""
    force = np.zeros(n)
    force[start:start + width] = height * np.sin(np.pi * (np.arange(width) + 0.5) / width)
    return force


def struck(heights: list[float], spacing: int = 2200, rng: np.random.Generator | None = None, noise: float = 0.0,
           extra: np.ndarray | None = None, modes: Modes = MODES, at: str = "1:+x") -> Record:
    """Return a record of hits one after the other: force, then velocities of all points."""
    n = 400 + spacing * len(heights)
    force = sum(pulse(200 + i * spacing, n, height) for i, height in enumerate(heights))
    if extra is not None:
        force = force + extra[:n]
    forces = Record(force[:, None], RATE, [at], "force")
    velocity = modal_superposition(modes, forces, modes.dofs, kind="velocity").samples
    samples = np.column_stack([force, velocity])
    if rng is not None:
        samples = samples + noise * np.abs(samples).max(axis=0) * rng.standard_normal(samples.shape)
    return Record(samples, RATE, [Dof.parse(at), *modes.dofs], ("force", *["velocity"] * len(modes.dofs)))


def truth(frequency: np.ndarray, at: str = "1:+x", modes: Modes = MODES) -> np.ndarray:
    """Return the exact mobility, as sampled with forces that are linear between samples (the factor sinc squared)."""
    result = np.zeros((frequency.size, len(modes.dofs), 1), complex)
    result[1:] = modal(modes, frequency[1:], None, inputs=[at], quantity="mobility").values
    return result * np.sinc(frequency / RATE)[:, None, None] ** 2
