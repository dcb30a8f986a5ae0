"""Roving sensors whose mass moves the modes: are modes that are seen once a set-up named, joined and corrected, true pairs not?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/signals/sensor_groups.py [--structures 60] [--first 0] [--case mass]

Structures of three to eight modes of random shapes, 8 to 40 points in one to three directions, one or two references, two or
three set-ups of random points, each sensor with a mass that moves the modes by 0.3 to 3 % in the mean, noise of 0.05 to 1 %.
The modes of a set-up are those of the eigenvalue problem with its sensors' mass, solved here. Cases:

    mass     every set-up with its sensors
    ratio    half of the points with all frequencies lower by one ratio of 0.3 to 3 %
    pairs    no sensor; true pairs of close modes with random shapes: none may be named
    planes   no sensor; modes in pairs, one along x and one along y
    twins    no sensor; two bodies that hardly feel each other, one softer by a ratio, a reference on each
The last line is the figure.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint._check import ToolpointError
from toolpoint.studies import identify_modes
from toolpoint.vibration import Frf

CASES = ("mass", "ratio", "pairs", "planes", "twins")


@dataclass(frozen=True)
class Test:
    """Responses, the true frequencies without sensors (Hz), the mass of a sensor (kg, 0 for none) and set-ups of the rows."""

    frf: Frf
    frequency: np.ndarray
    mass: float
    setup: np.ndarray


def responses(frequency: np.ndarray, damping: np.ndarray, shape: np.ndarray, references: np.ndarray, lines: np.ndarray
              ) -> np.ndarray:
    """Return accelerances (lines, rows, references) of real modes of unit modal mass."""
    w, w_r = 2 * np.pi * lines[:, None], 2 * np.pi * frequency
    modal = -(w**2) / (w_r**2 - w**2 + 2j * damping * w_r * w)
    return np.asarray(np.einsum("fr,pr,qr->fpq", modal, shape, shape[references]))


def loaded(frequency: np.ndarray, shape: np.ndarray, rows: np.ndarray, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and shapes with sensors of a mass on some rows."""
    stiffness = np.diag((2 * np.pi * frequency) ** 2)
    root = np.linalg.cholesky(np.eye(frequency.size) + mass * shape[rows].T @ shape[rows])
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return np.sqrt(values) / (2 * np.pi), shape @ inverse.T @ vectors


def random_test(rng: np.random.Generator, case: str) -> Test:
    """Return one test of a case."""
    count, points, directions = int(rng.integers(3, 9)), int(rng.integers(8, 41)), int(rng.integers(1, 4))
    if case == "planes":
        directions = 2
    rows = points * directions
    frequency = 60 * np.cumprod(1 + rng.uniform(0.12, 0.5, count))
    shape = rng.normal(size=(rows, count)) / np.sqrt(rng.uniform(20, 200))
    setup, mass, ratio = np.zeros(rows, int), 0.0, np.ones(1)
    references = rng.choice(rows, int(rng.integers(1, 3)), replace=False)
    if case in ("mass", "ratio"):
        number = int(rng.integers(2, 4)) if case == "mass" else 2
        of_point = rng.permutation(np.arange(points) % number)
        setup = np.repeat(of_point, directions)
        if case == "mass":
            mass = rng.uniform(0.006, 0.06) * 2 / (shape[setup == 0] ** 2).sum(axis=0).mean() / 2
        else:
            ratio = np.array([1.0, 1 - rng.uniform(0.003, 0.03)])
    elif case == "pairs":
        frequency = np.sort(np.concatenate([frequency, frequency * (1 + rng.uniform(0.003, 0.03, count))]))
        shape = rng.normal(size=(rows, 2 * count)) / np.sqrt(rng.uniform(20, 200))
    else:
        ratio_of_pair = 1 + rng.uniform(0.005, 0.03)
        side = np.arange(rows) % 2 if case == "planes" else np.repeat(np.arange(points) % 2, directions)
        one, other = shape * (side == 0)[:, None], shape * (side == 1)[:, None]
        mix = rng.uniform(0, 0.02)
        shape = np.concatenate([one + mix * other, other - mix * one], axis=1)
        frequency = np.concatenate([frequency, ratio_of_pair * frequency])
        references = np.array([int(rng.choice(np.flatnonzero(side == k))) for k in (0, 1)])
    damping = np.exp(rng.uniform(np.log(0.002), np.log(0.006), frequency.size))
    if case != "pairs":
        damping[:] = np.exp(rng.uniform(np.log(0.0015), np.log(0.004)))
    top = 1.15 * frequency.max()
    lines = np.arange(0.8 * frequency.min(), top, max(0.3 * damping.min() * frequency.min(), (top - 40) / 9000))
    exact = np.empty((lines.size, rows, references.size), complex)
    for k in range(setup.max() + 1):
        there = np.flatnonzero(setup == k)
        at, seen = loaded(frequency, shape, there, mass)
        at = at * (ratio[k] if case == "ratio" else 1.0)
        exact[:, there] = responses(at, damping, seen, references, lines)[:, there]
    sd = np.exp(rng.uniform(np.log(5e-4), np.log(1e-2))) * np.sqrt((np.abs(exact) ** 2).mean(axis=0) / 2)
    noise = sd * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape))
    labels = [f"{r // directions + 1}:+{'xyz'[r % directions]}" for r in range(rows)]
    return Test(Frf(lines, exact + noise, labels, [labels[r] for r in references], "accelerance"), np.sort(frequency), mass,
                setup)


def judge(test: Test) -> dict[str, float]:
    """Return what identification says of a test, as counts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = identify_modes(test.frf)
        joined = identify_modes(test.frf, sensor_mass=test.mass) if test.mass else result
    named = [doubt for doubt in result.doubts if "another mass of sensors" in doubt]
    found = {"named": float(bool(named)), "first": float(bool(named) and result.doubts[0] is named[0]),
             "modes": float(result.modes.count), "marked": float(result.doubtful.sum()), "true": float(test.frequency.size),
             "joined": float(joined.modes.count)}
    if test.mass and joined.modes.count == test.frequency.size:
        found["error"] = float(np.abs(joined.modes.frequency / test.frequency - 1).max())
        found["before"] = float(max(np.abs(result.modes.frequency / f - 1).min() for f in test.frequency))
        found["inside"] = float((np.abs(joined.modes.frequency - test.frequency) <= joined.modes.frequency_interval).mean())
    return found


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.cases("structures", 60)
    parser.seed(0, "first")
    parser.part("case", default=None, choices=CASES)
    given, start, figures = parser.parse_args(), time.process_time(), []
    for case in [given.case] if given.case else CASES:
        every = []
        for seed in range(given.first, given.first + given.structures):
            test = random_test(np.random.default_rng(seed), case)
            try:
                every.append(judge(test))
            except ToolpointError as error:
                print(f"{case} {seed}: refused: {error}", flush=True)
                continue
            print(f"{case} {seed}: {len(test.frf.outputs)}x{len(test.frf.inputs)} "
                  + ", ".join(f"{key} {value:.4g}" for key, value in every[-1].items()), flush=True)
        named = int(sum(found["named"] for found in every))
        part = f"{case}: named {named} of {len(every)}"
        whole = [found for found in every if "error" in found]
        if case == "mass":
            part += (f", joined to the true number {len(whole)}, frequencies off by "
                     f"{100 * np.median([found['error'] for found in whole]):.3f} % in the median of the worst "
                     f"({100 * np.median([found['before'] for found in whole]):.2f} % with the sensors), inside their 95 % "
                     f"interval {100 * np.mean([found['inside'] for found in whole]):.0f} %")
        figures.append(part)
    print(f"{'; '.join(figures)}; {time.process_time() - start:.0f} CPU s")


if __name__ == "__main__":
    main()
