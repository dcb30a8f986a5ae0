"""Plain-Python twin of the kernel's step: NumPy matrices, the laws as objects, bisection-free fixed point to rounding."""

from __future__ import annotations

import numpy as np

from toolpoint.drives.axis.plant import Plant
from toolpoint.drives.friction.laws import LuGre
from toolpoint.vibration.state_space import hold_matrices


def advanced(plant: Plant, laws: list, x, z, dz, u, step):
    """Return (x, z, dz) after one exact first-order-hold step with LuGre laws, u held; z the bristles."""
    phi, g1, g2 = hold_matrices(plant.a, np.hstack([plant.b_input, plant.b_scalar]), step)
    nu = plant.b_input.shape[1]
    s = plant.scalars @ x
    w0 = scalars_to_values(plant, laws, s, z, dz)
    base = phi @ x + g1[:, :nu] @ u + g1[:, nu:] @ w0
    w1 = w0
    for _ in range(400):
        s1 = plant.scalars @ (base + g2[:, nu:] @ (w1 - w0))
        z1, dz1 = bristles(laws, s1, z, dz, step)
        after = scalars_to_values(plant, laws, s1, z1, dz1)
        if np.abs(after - w1).max() <= 1e-13 * np.abs(after).max():
            break
        w1 = 0.5 * (w1 + after)
    return base + g2[:, nu:] @ (w1 - w0), z1, dz1


def bristles(laws, s, z, dz, step):
    """Return bristle deflections and rates at the end of an implicit trapezoidal step."""
    v = s[: len(laws)]
    rate = np.array([law.stiffness * abs(v[k]) / law.level(v[k]) for k, law in enumerate(laws)])
    z1 = (z + step / 2 * (dz + v)) / (1 + step / 2 * rate)
    return z1, v - rate * z1


def scalars_to_values(plant, laws, s, z, dz):
    """Return friction without its viscous part, and the products."""
    w = np.empty(plant.b_scalar.shape[1])
    for k, law in enumerate(laws):
        assert isinstance(law, LuGre)
        w[k] = law.stiffness * z[k] + law.damping * dz[k]
    w[len(laws):] = s[plant.products[:, 0]] * s[plant.products[:, 1]]
    return w
