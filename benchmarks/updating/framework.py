"""Updating of a frame of 12 uncertain stiffnesses by three modes at 43 places: starts that reach the optimum, CPU s a start.

The frame is our own, of the size of the open reference's, whose model is not at hand: two storeys, two bays, floors; about 2200
coordinates, 12 groups of members, start values between 0.4 and 1.9 times the nominal stiffness. The measured modes are those of
a frame of other stiffnesses, with noise where asked for; every start must end at the same optimum, with a covariance.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.sparse import csc_array, csr_array

from benchmarks.frame import CommandLine
from toolpoint.bodies.beam import BeamSection, beam_element, rectangle
from toolpoint.updating import Parameter, Problem, Targets, fit
from toolpoint.updating.models.sparse_model import SparseModel
from toolpoint.vibration import Dof, Modes

# Bays along x and y, storeys (m); pieces of a column, of a bay along x and along y.
BAY_X, BAY_Y, STOREY = 7.0, 6.0, 4.0
UP = np.array([0.0, 0.0, 1.0])
COLUMN_PIECES, PIECES_X, PIECES_Y = 8, 6, 10
PLACES, MEASURED = 43, 3
# Noise: of frequencies, and of entries of shapes as share of their rms.
NOISE = (1e-3, 0.01)


class Frame:
    """Nodes and members of the frame; nodes that lie together are one."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[int, int, int], int] = {}
        self.parts: dict[str, tuple[list[np.ndarray], list[np.ndarray]]] = {}
        self.mass: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])

    def node(self, at: np.ndarray) -> int:
        """Return the number of the node at a place, m."""
        x, y, z = (round(1e4 * v) for v in at)
        return self.nodes.setdefault((x, y, z), len(self.nodes))

    def member(self, group: str, ends: tuple[np.ndarray, np.ndarray], pieces: int, section: BeamSection) -> None:
        """Add a straight member of equal pieces to a group."""
        a, b = ends
        along = (b - a) / np.linalg.norm(b - a)
        side = np.cross([0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [0.0, 1.0, 0.0], along)
        turn = np.array([along, side / np.linalg.norm(side), np.cross(along, side / np.linalg.norm(side))])
        turns = np.kron(np.eye(4), turn)
        mass, stiffness, _ = beam_element(section.slender, float(np.linalg.norm(b - a)) / pieces)
        places = [a + (b - a) * i / pieces for i in range(pieces + 1)]
        for first, second in pairwise(places):
            rows = np.concatenate([6 * self.node(p) + np.arange(6) for p in (first, second)])
            held = self.parts.setdefault(group, ([], []))
            held[0].append(rows)
            held[1].append(turns.T @ stiffness @ turns)
            self.mass[0].append(rows)
            self.mass[1].append(turns.T @ mass @ turns)

    def matrices(self) -> tuple[dict[str, csc_array], csc_array, np.ndarray]:
        """Return stiffness of every group, mass, and places of rows, without the coordinates of the feet."""
        size = 6 * len(self.nodes)
        places = np.repeat(1e-4 * np.array(list(self.nodes), float), 6, axis=0)
        free = np.flatnonzero(places[:, 2] > 0)

        def summed(rows: list[np.ndarray], blocks: list[np.ndarray]) -> csc_array:
            r = np.array(rows)
            i, j = np.repeat(r, 12, axis=1).ravel(), np.tile(r, (1, 12)).ravel()
            return csc_array(csr_array((np.array(blocks).ravel(), (i, j)), shape=(size, size))[free][:, free])

        return {name: summed(*part) for name, part in self.parts.items()}, summed(*self.mass), places[free]


def build_frame() -> Frame:
    """Return two storeys of two bays by one: columns, beams and floors as grids of strips."""
    frame = Frame()
    column, beam = rectangle(0.4, 0.4, 30e9, density=2400), rectangle(0.3, 0.5, 30e9, density=2400)
    for storey in (1, 2):
        low, high = STOREY * (storey - 1), STOREY * storey
        for x in (0, 1, 2):
            for y in (0, 1):
                at = np.array([x * BAY_X, y * BAY_Y, 0.0])
                kind = "inner" if x == 1 else "outer"
                frame.member(f"{kind} columns {storey}", (at + low * UP, at + high * UP), COLUMN_PIECES, column)
        xs, ys = np.linspace(0, 2 * BAY_X, 2 * PIECES_X + 1), np.linspace(0, BAY_Y, PIECES_Y + 1)
        for j, y in enumerate(ys):
            edge = j in (0, PIECES_Y)
            strip = rectangle(ys[1] - ys[0], 0.15, 30e9, density=1200)
            frame.member(f"{'beams' if edge else 'floor'} along x {storey}",
                         (np.array([0, y, high]), np.array([2 * BAY_X, y, high])), 2 * PIECES_X, beam if edge else strip)
        for i, x in enumerate(xs):
            edge = i in (0, PIECES_X, 2 * PIECES_X)
            strip = rectangle(xs[1] - xs[0], 0.15, 30e9, density=1200)
            frame.member(f"{'beams' if edge else 'floor'} along y {storey}",
                         (np.array([x, 0, high]), np.array([x, BAY_Y, high])), PIECES_Y, beam if edge else strip)
    return frame


def noisy(modes: Modes, rng: np.random.Generator, noise: tuple[float, float]) -> Modes:
    """Return modes as a test gives them, with their deviations."""
    level = np.sqrt((modes.shape**2).mean(axis=0))
    shape = modes.shape + noise[1] * level * rng.normal(size=modes.shape.shape)
    covariance = np.array([np.diag([(noise[0] * f) ** 2, 1e-6]) for f in modes.frequency])
    return Modes(modes.frequency * (1 + noise[0] * rng.normal(size=modes.count)), 0.01, shape, modes.dofs, "unscaled",
                 covariance=covariance, shape_variance=np.broadcast_to((noise[1] * level) ** 2, shape.shape))


def main() -> None:
    """Print how many starts reach the optimum, and the CPU time of one."""
    parser = CommandLine(__doc__)
    parser.cases("starts", 100)
    parser.add_argument("--noise", action="store_true")
    options = parser.parse_args()
    rng = np.random.default_rng(7)
    parts, mass, places = build_frame().matrices()
    size = mass.shape[0]
    at = np.sort(rng.choice(np.flatnonzero(np.arange(size) % 6 < 3), PLACES, replace=False))
    dofs = tuple(Dof(int(i) // 6 + 1, "+" + "xyz"[int(i) % 6]) for i in at)
    motion = csc_array((np.ones(PLACES), (at, range(PLACES))), shape=(size, PLACES))
    model = SparseModel(csc_array((size, size)), mass, motion, dofs, 2 * MEASURED, parts, coordinates=places)
    true = dict(zip(parts, 1 + rng.uniform(-0.4, 0.6, len(parts)), strict=True))
    modes = model(true).modes.selected(range(MEASURED))
    print(f"{size} coordinates, {len(parts)} groups, measured {', '.join(f'{f:.3f}' for f in modes.frequency)} Hz at {PLACES}")
    measured = noisy(modes, rng, NOISE) if options.noise else noisy(modes, rng, (1e-8, 1e-8))
    targets = Targets(Modes(measured.frequency, 0.01, measured.shape, dofs, "unscaled") if not options.noise else measured,
                      shape=True, frequency_sd=NOISE[0], shape_sd=NOISE[1])
    costs, seconds, ends = [], [], []
    for number in range(options.starts):
        start = 1 + rng.uniform(-0.6, 0.9, len(parts))
        problem = Problem(model, [Parameter(name, float(v), 0.1, 5.0) for name, v in zip(parts, start, strict=True)], targets)
        begin = time.process_time()
        result = fit(problem, limit=None)
        seconds.append(time.process_time() - begin)
        costs.append(result.chi_square)
        ends.append([result.values[name] for name in parts])
        if number < 5 or not result.converged:
            error = max(abs(result.values[name] / true[name] - 1) for name in parts)
            print(f"start {number}: {result.evaluations} evaluations, {seconds[-1]:.2f} CPU s, chi-square {costs[-1]:.4g}, "
                  f"farthest from the truth {100 * error:.3g} %: {result.status[:60]}")
    best = np.array(ends)[int(np.argmin(costs))]
    same = (np.abs(np.array(ends) / best - 1).max(axis=1) < 1e-3).sum()
    sd = np.sqrt(np.diag(result.covariance))
    pulls = np.log(best / np.array(list(true.values()))) / sd if options.noise else np.zeros(1)
    print(f"relative standard errors {100 * sd.min():.2g} .. {100 * sd.max():.2g} %, largest pull {np.abs(pulls).max():.2f}")
    print(f"{same} of {options.starts} starts at the optimum; CPU s a start: median {np.median(seconds):.2f}, "
          f"largest {np.max(seconds):.2f} (bar 3)")


if __name__ == "__main__":
    main()
