"""Synthetic structures with known modes, for the tests and benchmarks of modal identification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint.vibration import Dof, Frf, Modes
from toolpoint.vibration.frequency_response import modal

IN_BAND = np.array([35, 52, 53.1, 88, 90.2, 141, 143.5, 210, 214, 305, 309.5, 410])
ABOVE = np.array([560.0, 640, 790])
DAMPING = np.array([2.5, 2, 1.6, 1.8, 2.2, 1.5, 1.9, 1.2, 1.4, 1, 1.3, 1.7]) / 100
DAMPING_ABOVE = np.array([1.5, 1.2, 1.0]) / 100
BAND = (20.0, 490.0)
LINES = np.arange(2000) * 0.25


@dataclass(frozen=True)
class Case:
    """True modes (those in the band first) and the exact responses without noise."""

    modes: Modes
    frf: Frf
    in_band: int


def labels(points: int, ways: str = "xyz") -> list[Dof]:
    """Return `points` times directions labels."""
    return [Dof(point + 1, "+" + way) for point in range(points) for way in ways]


def structure(rng: np.random.Generator, points: int = 131, frequency: np.ndarray | None = None,
              ratio: np.ndarray | None = None) -> Modes:
    """Return modes with random orthonormal shapes, unit modal mass; those of the benchmark where none are given."""
    if frequency is None:
        frequency, ratio = np.concatenate([IN_BAND, ABOVE]), np.concatenate([DAMPING, DAMPING_ABOVE])
    shape = np.linalg.qr(rng.standard_normal((3 * points, len(frequency))))[0]
    return Modes(frequency, ratio, shape, labels(points))


def benchmark(rng: np.random.Generator, points: int = 131, references: int = 2, quantity: str = "accelerance",
              lines: np.ndarray = LINES, placed: bool = False) -> Case:
    """Return the benchmark of the project: 131 points x 3 directions x 2 references, 12 modes in the band, 3 above.

    The references are the first Dofs (wherever the random shapes put them), or `placed` where a tester would put them.
    """
    modes = structure(rng, points)
    at = placed_references(modes, lines, quantity) if placed else list(range(references))
    return Case(modes, responses(modes, at, quantity, lines), IN_BAND.size)


def placed_references(modes: Modes, lines: np.ndarray, quantity: str) -> list[int]:
    """Return the two Dofs in whose responses the least visible mode of the band has its largest share of energy.

    What a tester does who tries places with the hammer, or plans them with a model: every resonance must stand out.
    """
    power = {"receptance": 0, "mobility": 1, "accelerance": 2}[quantity]
    s = 2j * np.pi * np.maximum(lines, lines[1])[:, None]
    energy = (np.abs(s**power / (s**2 + 2 * modes.damping_ratio * modes.omega * s + modes.omega**2)) ** 2).sum(axis=0)
    size = np.abs(modes.shape) ** 2
    own = size[:, None, :] * size[None] * energy  # (output, input, mode)
    share = (own / own.sum(axis=-1, keepdims=True)).mean(axis=0)[:, :IN_BAND.size]
    least = (share[:, None] + share[None]).min(axis=2)
    return [int(i) for i in np.unravel_index(int(np.argmax(least)), least.shape)]


def responses(modes: Modes, references: int | list[int], quantity: str = "accelerance", lines: np.ndarray = LINES) -> Frf:
    """Return the responses to forces at the first Dofs, or at those given, exact also at 0 Hz."""
    inputs = [modes.dofs[i] for i in (range(references) if isinstance(references, int) else references)]
    if lines[0] > 0:
        return modal(modes, lines, None, inputs=inputs, quantity=quantity)
    above = modal(modes, lines[1:], None, inputs=inputs, quantity=quantity)
    first = modal(modes, lines[:1], None, inputs=inputs).values * (1.0 if quantity == "receptance" else 0.0)
    return Frf(lines, np.concatenate([first, above.values]), above.outputs, above.inputs, quantity)


def with_noise(frf: Frf, part: float, rng: np.random.Generator) -> Frf:
    """Return the responses with circular Gaussian noise of `part` times the rms of each."""
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    noise = rng.standard_normal((2, *frf.values.shape)) / np.sqrt(2)
    return Frf(frf.frequency, frf.values + part * rms * (noise[0] + 1j * noise[1]), frf.outputs, frf.inputs,
               frf.quantity)
