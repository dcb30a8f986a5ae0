"""Problems shared by the tests of the cutting room."""

from __future__ import annotations

import numpy as np

from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool

MASS, ZETA, HZ = 0.03993, 0.011, 922.0


def one_mode(directions: int = 1) -> Modes:
    """The common benchmark structure of the semi-discretization literature, in x or the same in x and y."""
    shape = np.eye(directions) / np.sqrt(MASS)
    return Modes(np.full(directions, HZ), np.full(directions, ZETA), shape, ("tool:+x", "tool:+y")[:directions])


def benchmark(engagement: Engagement, directions: int = 1, **more: object) -> MillingProblem:
    """N = 2, K_t 6e8, K_n 2e8 N/m^2, straight teeth."""
    tool = more.pop("tool", Tool(0.02, 2))
    return MillingProblem(tool, engagement, CuttingCoefficients(6e8, 2e8), one_mode(directions), **more)  # type: ignore


def modes_of(f: list[float], zeta: list[float], k: list[float], label: str) -> Modes:
    """Modes of one direction from frequency, damping ratio and modal stiffness."""
    w = 2 * np.pi * np.asarray(f)
    return Modes(np.asarray(f), np.asarray(zeta), (w / np.sqrt(k))[None, :], (label,))


def altintas() -> MillingProblem:
    """Two-tooth cutter after Altintas, half immersion, down."""
    x = modes_of([456.780432, 1448.889140], [0.1117053994, 0.01703700958], [7.933097e6, 1.469178e7], "tool:+x")
    y = modes_of([516.518218, 1408.448141], [0.02457963271, 0.03135760193], [9.374614e6, 1.240639e7], "tool:+y")
    return MillingProblem(Tool(0.0254, 2), Engagement.down(0.5), CuttingCoefficients(1319.4e6, 788.8e6), (x, y))


def random_problem(rng: np.random.Generator, modes: int | None = None, mu: float = 5e6) -> MillingProblem:
    """A random cut: 1-20 modes in any direction of the plane, any engagement, 1-5 teeth."""
    n = int(rng.integers(1, 21)) if modes is None else modes
    f = np.sort(rng.uniform(200, 3000, n))
    zeta = rng.uniform(0.005, 0.06, n)
    k = mu * rng.uniform(1, 20, n)
    angle = rng.uniform(0, np.pi, n)
    shape = 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)])
    start = rng.uniform(0, np.pi - 0.2)
    arc = Engagement(start, rng.uniform(start + 0.1, np.pi))
    tool = Tool(0.016, int(rng.integers(1, 6)))
    kt = rng.uniform(5e8, 2e9)
    material = CuttingCoefficients(kt, kt * rng.uniform(0.05, 0.7))
    return MillingProblem(tool, arc, material, Modes(f, zeta, shape, ("tool:+x", "tool:+y")))
