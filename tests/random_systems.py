"""Random systems with known properties, for laws."""

from __future__ import annotations

import numpy as np

from toolpoint.vibration import SecondOrderSystem


def random_system(rng: np.random.Generator, n: int = 6, poses: tuple[int, ...] = (), damped: bool = True):
    """A positive definite system with viscous damping of a few per cent that is not proportional."""
    def spd(low: float) -> np.ndarray:
        a = rng.normal(size=(*poses, n, n))
        return a @ np.swapaxes(a, -1, -2) + low * np.eye(n)

    mass, stiffness = spd(n), 1e5 * spd(n)
    damping = None
    if damped:
        d = rng.normal(size=(n, n))
        damping = 0.2 * np.sqrt(1e5) * (d @ d.T) / n + 1e-4 * stiffness
    return SecondOrderSystem(mass, stiffness, damping)
