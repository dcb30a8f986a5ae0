"""Reduction of random ribbed boxes on random springs and masses: the error estimate against the truth, and automatic sizes.

Run: python benchmarks/bodies/reduced_boxes.py [--boxes 20]
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.sparse import block_array, csc_array
from scipy.sparse import block_diag as sparse_diagonal

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Patch, SolidModel
from toolpoint.substructuring.estimate import Surroundings, couple_reduced, reduce_automatically
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reach import MIN_TRUSTED_REACH_RATIO
from toolpoint.substructuring.reduction import span
from toolpoint.vibration.sparse import modes

COUNT = 10


def box(seed: int) -> tuple[SolidModel, np.ndarray, Surroundings]:
    """A ribbed box with 2 to 4 patches, each on springs to a mass of its own; some masses on springs to the ground."""
    rng = np.random.default_rng(seed)
    size, wall = rng.uniform([0.5, 0.4, 0.8], [0.8, 0.6, 1.4]), rng.uniform(0.008, 0.016)
    parts = [Cuboid([0, 0, 0], size), Cuboid([wall] * 3, size - wall, is_window=True)]
    for _ in range(rng.integers(1, 4)):
        z = rng.uniform(0.2, 0.8) * size[2]
        parts.append(Cuboid([wall, wall, z], [size[0] - wall, size[1] - wall, z + wall]))
    model = Casting(tuple(parts), {"body": CAST_IRON}).meshed(0.16)
    x, y, z = size
    patches = [Patch([0, y / 2, rng.uniform(0.2, 0.8) * z], [0, 1, 0], [0, 0, -1], 0.1, 0.08),
               Patch([x, y / 2, rng.uniform(0.2, 0.8) * z], [0, 1, 0], [0, 0, 1], 0.1, 0.08),
               Patch([x / 2, y / 2, 0], [1, 0, 0], [0, -1, 0], 0.15, 0.1),
               Patch([x / 2, y / 2, z], [1, 0, 0], [0, 1, 0], 0.1, 0.1)]
    patches = patches[:rng.integers(2, 5)]
    loads = np.hstack([patch.averages(model).toarray() for patch in patches])
    n = loads.shape[1]
    stiffness, mass = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))

    def spring() -> np.ndarray:
        return np.diag(np.r_[10 ** rng.uniform(8, 9.5, 3), 10 ** rng.uniform(6, 7.5, 3)])

    for i in range(len(patches)):
        k, at, other = spring(), slice(6 * i, 6 * i + 6), slice(n + 6 * i, n + 6 * i + 6)
        stiffness[at, at] += k
        stiffness[other, other] += k
        stiffness[at, other] -= k
        stiffness[other, at] -= k
        kg = rng.uniform(20, 300)
        mass[other, other] = np.diag(np.r_[kg, kg, kg, kg * rng.uniform(0.01, 0.05, 3)])
        if i == 0 or rng.random() < 0.4:
            stiffness[other, other] += spring()
    return model, loads, Surroundings(stiffness, mass)


def full(model: SolidModel, loads: np.ndarray, around: Surroundings) -> np.ndarray:
    """Coupled frequencies of the whole, counted."""
    n, w = loads.shape[1], csc_array(loads)
    k = csc_array(around.stiffness)
    stiffness = block_array([[model.stiffness() + w @ k[:n, :n] @ w.T, w @ k[:n, n:]], [k[n:, :n] @ w.T, k[n:, n:]]]).tocsc()
    mass = sparse_diagonal([model.mass(), csc_array(around.mass[n:, n:])]).tocsc()
    return modes(csc_array(stiffness), csc_array(mass), COUNT).frequency[:COUNT]


def oracle(body: LargeBody, around: Surroundings, truth: np.ndarray, error: float) -> int:
    """The fewest shapes of any reach whose true error is within the bound: what nobody can know beforehand."""
    best = 10**6
    for reach in (0.5, 0.7, 0.85, 1.0, 1.2, MIN_TRUSTED_REACH_RATIO):
        shapes = span(body, ActingLoads(truth[-1], reach))
        for size in range(shapes.kept, min(shapes.largest, best) + 1):
            if np.max(couple_reduced(shapes.reduced(size), around, COUNT).frequency / truth - 1) <= error:
                best = min(best, size)
                break
    return best


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("boxes", 20)
    parser.add_argument("--oracle", type=int, default=1, help="0: without the fewest shapes possible, which take long")
    given = parser.parse_args()
    worst_of: list[tuple[float, float]] = []
    ratios, below, met, shares = [], 0, {1e-3: 0, 1e-4: 0}, []
    for seed in range(given.boxes):
        model, loads, around = box(seed)
        truth = full(model, loads, around)
        weights = np.sqrt(np.diag(around.stiffness)[:loads.shape[1]])
        body = LargeBody(model.stiffness(), model.mass(), csc_array(loads), model.rigid_motion(), weights)
        shapes = span(body, ActingLoads(truth[-1], MIN_TRUSTED_REACH_RATIO * 1.02))
        for size in range(shapes.kept + 1, shapes.largest + 1):
            solved = couple_reduced(shapes.reduced(size), around, COUNT)
            error = solved.frequency / truth - 1
            if solved.is_sure:
                seen = error > 1e-8  # the truth's own digits
                ratios += list(solved.error[seen] / error[seen])
                below += int((solved.error[seen] < error[seen]).sum())
                worst_of += [(float(r), float(e)) for r, e in zip(solved.error[seen] / error[seen], error[seen])]
        line = f"box {seed}: {model.size} DOF, {len(weights) // 6} interfaces, {truth[0]:.0f}..{truth[-1]:.0f} Hz;"
        for error in met:
            reduction, solved = reduce_automatically(body, around, COUNT, band=truth[-1], error=error)
            reached = float(np.max(solved.frequency / truth - 1))
            met[error] += reached <= error
            line += f" {error:g}: {reduction.size} shapes, {reached:.1e}"
            if given.oracle:
                shares.append((reduction.size + 6) / (oracle(body, around, truth, error) + 6))
                line += f" ({shares[-1]:.2f} x oracle)"
        print(line, flush=True)
    print("least estimate over truth, and that error:", *(f"{r:.2f} of {e:.1e}" for r, e in sorted(worst_of)[:5]))
    worst = f", {max(shares):.2f} (median {np.median(shares):.2f}) x the fewest" if shares else ""
    print(f"{len(ratios)} modes: {below} estimates below the true error, median {np.median(ratios):.2f} x, at most "
          f"{max(ratios):.0f} x; automatic: 1e-3 met in {met[1e-3]}, 1e-4 in {met[1e-4]} of {given.boxes}{worst}")


if __name__ == "__main__":
    main()
