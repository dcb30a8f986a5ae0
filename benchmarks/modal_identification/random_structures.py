"""Modes of random structures identified as a user identifies them: do the stated intervals hold, is every mode there?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/modal_identification/random_structures.py [--seeds 60] [--first 0] [--case real]

Responses are sums over modes written here, apart from the package: one to eight modes between 50 and 2000 Hz (a third of the
structures with a close pair), damping ratios of 0.3 to 5 %, three modes above the band and sometimes a suspension below it,
one to ten points in one direction, one or two references, accelerance, mobility or receptance, two to ten lines in the
narrowest half-power width, noise of 0.1 to 3 % of the root mean square, in a third of the tests growing tenfold towards the
end of the band as under a hammer whose force fades. Cases:

    real        modes of proportional damping
    complex     a damper at one place beside, which adds up to 3 % to a mode: complex shapes
    structural  loss factors of twice the damping ratios in place of viscous damping; true are the poles of that

Counted: modes that carry more than noise and are there, those in lines that were left out for their noise (and said so)
apart; modes that are not in the structure and are not marked doubtful; 95 % intervals of frequency and damping of the modes
that are not doubtful. The last line is the figure.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint._check import ToolpointError
from toolpoint.modal_identification import Identification
from toolpoint.studies import identify_modes
from toolpoint.vibration import Frf

CASES = ("real", "complex", "structural")
VISIBLE = 30.0  # ratio of a mode's own response to noise, over all lines and responses, from which it must be there


@dataclass(frozen=True)
class Structure:
    """Modes: frequency (Hz), damping ratio, shapes (points, modes) of modal A = 2i times the damped frequency (modal mass 1
    where they are real); the first `count` are in the band."""

    frequency: np.ndarray
    damping: np.ndarray
    shape: np.ndarray
    count: int


def random_structure(rng: np.random.Generator, case: str) -> Structure:
    """Return modes below, in and above a band."""
    count, points = int(rng.integers(1, 9)), int(rng.integers(1, 11))
    inside = np.sort(np.exp(rng.uniform(np.log(50), np.log(2000), count)))
    for k in range(1, count):  # neighbours keep a distance of two half-power widths, but for one close pair
        inside[k] = max(inside[k], inside[k - 1] * 1.06)
    if count > 1 and rng.random() < 1 / 3:
        k = int(rng.integers(1, count))
        inside[k] = inside[k - 1] * (1 + rng.uniform(0.01, 0.04))
        inside = np.sort(inside)
    above = inside[-1] * np.array([1.4, 2.0, 3.1]) * (1 + 0.1 * rng.random(3))
    below = rng.uniform(2, 8, int(rng.random() < 1 / 3))
    frequency = np.concatenate([inside, above, below])
    damping = np.exp(rng.uniform(np.log(0.003), np.log(0.05), frequency.size))
    shape = rng.normal(size=(points, frequency.size)) + 0j
    shape[0] = np.sign(shape[0].real) * np.maximum(np.abs(shape[0]), 0.3)  # the driving point sees every mode
    shape = shape / np.sqrt(rng.uniform(2, 50))
    if case == "complex":
        return with_damper(frequency, damping, shape.real, count, rng)
    if case == "structural":
        pole = frequency * np.sqrt(1 + 2j * damping)
        frequency, damping = np.abs(pole), pole.imag / np.abs(pole)
    return Structure(frequency, damping, shape, count)


def with_damper(frequency: np.ndarray, damping: np.ndarray, shape: np.ndarray, count: int, rng: np.random.Generator
                ) -> Structure:
    """Return the modes of the structure with one more damper, from its state matrix in modal coordinates."""
    w, place = 2 * np.pi * frequency, rng.normal(size=frequency.size)
    strength = 0.06 * (w / place**2)[:count].min()  # of 3 % in the mode that it damps most
    c = np.diag(2 * damping * w) + strength * np.outer(place, place)
    n = w.size
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(w**2), -c]])
    poles, vectors = np.linalg.eig(state)
    upper = np.flatnonzero(poles.imag > 0)
    upper = upper[np.argsort(np.abs(poles[upper]))]
    upper = np.concatenate([upper[(np.abs(poles[upper]) / (2 * np.pi) > 40)], upper[np.abs(poles[upper]) / (2 * np.pi) <= 40]])
    poles, vectors = poles[upper], vectors[:n, upper]
    # phi^T (2 lambda I + C) phi = 2i times the damped frequency: residues phi phi^T / (2i w_d).
    size = np.einsum("ir,ij,jr->r", vectors, c, vectors) + 2 * poles * (vectors**2).sum(axis=0)
    scaled = shape @ vectors * np.sqrt(2j * poles.imag / size)
    return Structure(np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles), scaled, count)


def parts(structure: Structure, lines: np.ndarray, case: str) -> np.ndarray:
    """Return the receptances of every mode, (modes, lines, points, points)."""
    w, w_r, zeta = 2 * np.pi * lines, 2 * np.pi * structure.frequency[:, None], structure.damping[:, None]
    product = np.einsum("ir,jr->rij", structure.shape, structure.shape)
    if case == "structural":  # w_r and zeta are those of the pole: w_r sqrt(1 - zeta^2) + i w_r zeta, squared
        return (1 / (w_r**2 * (np.sqrt(1 - zeta**2) + 1j * zeta) ** 2 - w**2))[:, :, None, None] * product[:, None]
    pole = w_r * (-zeta + 1j * np.sqrt(1 - zeta**2))
    residue = product / (2j * pole.imag[:, :, None])
    return (residue[:, None] / (1j * w - pole)[:, :, None, None]
            + residue.conj()[:, None] / (1j * w - pole.conj())[:, :, None, None])


def measure(structure: Structure, case: str, rng: np.random.Generator) -> tuple[Frf, np.ndarray]:
    """Return noisy responses, and how far every mode of the band stands above the noise."""
    width = (2 * structure.damping * structure.frequency)[:structure.count].min() / rng.uniform(2, 10)
    top = 1.15 * structure.frequency[:structure.count].max()
    lines = width * np.arange(int(0.7 * structure.frequency[:structure.count].min() / width), int(top / width))[-12000:]
    quantity = str(rng.choice(["accelerance", "accelerance", "mobility", "receptance"]))
    power = {"accelerance": 2, "mobility": 1, "receptance": 0}[quantity]
    references = min(int(rng.integers(1, 3)), structure.shape.shape[0])
    each = parts(structure, lines, case)[..., :references] * ((2j * np.pi * lines) ** power)[:, None, None]
    exact = each.sum(axis=0)
    level = np.exp(rng.uniform(np.log(0.001), np.log(0.03))) * np.sqrt((np.abs(exact) ** 2).mean(axis=0) / 2)
    fading = 10 ** ((lines - lines[0]) / (lines[-1] - lines[0])) if rng.random() < 1 / 3 else np.ones(lines.size)
    sd = level * fading[:, None, None]
    noise = sd * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape))
    above = np.sqrt((np.abs(each[:structure.count] / sd) ** 2).sum(axis=(1, 2, 3)) / 2)
    labels = [f"{k + 1}:+z" for k in range(exact.shape[1])]
    return Frf(lines, exact + noise, labels, labels[:references], quantity), above


@dataclass
class Count:
    """What all structures came to."""

    visible: int = 0
    there: int = 0
    left_out: int = 0
    false: int = 0
    doubted: int = 0
    refused: int = 0
    scores: list[np.ndarray] = field(default_factory=list)


def judge(seed: int, case: str, count: Count) -> str:
    """Identify one structure, add to the counts, and return a line on it."""
    rng = np.random.default_rng(seed)
    structure = random_structure(rng, case)
    frf, above = measure(structure, case, rng)
    truth = structure.frequency[:structure.count]
    seen = (above > VISIBLE) & (truth > frf.frequency[0]) & (truth < frf.frequency[-1])
    count.visible += int(seen.sum())
    words = f"{seed:4d}: {frf.quantity} {len(frf.outputs)}x{len(frf.inputs)} {frf.frequency.size} lines, {truth.size} modes, "
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = identify_modes(frf)
    except ToolpointError as error:
        count.refused += 1
        return f"{words}refused: {error}"
    partner = pair(result, structure)
    scores = [score(result, structure, i, k) for i, k in partner.items() if not result.doubtful[i]]
    ends = result.frf.frequency[[0, -1]]
    lost = np.array([seen[k] and k not in partner.values() for k in range(truth.size)])
    outside = lost & ((truth < ends[0]) | (truth > ends[1]))
    false = sum(i not in partner and not result.doubtful[i] for i in range(result.modes.count))
    count.there, count.left_out = count.there + int((seen & ~lost).sum()), count.left_out + int(outside.sum())
    count.false, count.doubted = count.false + false, count.doubted + bool(result.doubts)
    count.scores += scores
    worst = np.abs(scores).max(axis=0) if scores else np.zeros(2)
    return (f"{words}{int((lost & ~outside).sum())} lost, {int(outside.sum())} left out with their lines, {false} false, "
            f"{int(result.doubtful.sum())} doubtful; worst {worst[0]:.1f}, {worst[1]:.1f} sd; "
            f"{'; '.join(map(str, result.doubts))[:100]}")


def pair(result: Identification, structure: Structure) -> dict[int, int]:
    """Return the true mode of each mode that has one within its half-power width, those that are not doubtful first."""
    truth, pairs = structure.frequency[:structure.count], dict[int, int]()
    width = 2 * structure.damping[:structure.count] * truth
    for i in np.argsort(result.doubtful, kind="stable").tolist():
        away = np.abs(result.modes.frequency[i] - truth) / width
        away[list(pairs.values())] = np.inf
        if away.min() < 1:
            pairs[i] = int(away.argmin())
    return pairs


def score(result: Identification, structure: Structure, i: int, k: int) -> np.ndarray:
    """Return the errors of frequency and damping over their standard deviations."""
    modes = result.modes
    assert modes.covariance is not None
    error = [modes.frequency[i] - structure.frequency[k], modes.damping_ratio[i] - structure.damping[k]]
    return np.array(error) / np.sqrt(np.diag(modes.covariance[i]))


def main() -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 60)
    parser.part("case", default="real", choices=CASES)
    given = parser.parse_args()
    count, start = Count(), time.process_time()
    for seed in range(given.first, given.first + given.seeds):
        print(judge(seed, given.case, count), flush=True)
    held = 100 * np.mean(np.abs(count.scores) < 1.96, axis=0)
    print(f"{given.case}: {count.there} of {count.visible} visible modes are there ({count.left_out} left out with noisy "
          f"lines, said), {count.false} false ones are not marked; 95 % intervals hold {held[0]:.1f} % (frequency) and "
          f"{held[1]:.1f} % (damping) of {len(count.scores)}; {count.doubted} of {given.seeds} tests doubted, "
          f"{count.refused} refused; "
          f"{(time.process_time() - start) / given.seeds:.1f} CPU s a test")


if __name__ == "__main__":
    main()
