"""Clarke and Park transformations, amplitude invariant."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, floats

_CLARKE = np.array([[2 / 3, -1 / 3, -1 / 3], [0.0, 1 / np.sqrt(3), -1 / np.sqrt(3)]])
_INVERSE = np.array([[1.0, 0.0], [-0.5, np.sqrt(3) / 2], [-0.5, -np.sqrt(3) / 2]])


def clarke(phases: FloatArray) -> FloatArray:
    """Return (alpha, beta) of three phase values, shape (..., 3) -> (..., 2); the amplitude is kept."""
    return floats("phases", phases, (3,)) @ _CLARKE.T


def inverse_clarke(stator: FloatArray) -> FloatArray:
    """Return three phase values without zero sequence, shape (..., 2) -> (..., 3)."""
    return floats("stator", stator, (2,)) @ _INVERSE.T


def park(stator: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Return (d, q) of (alpha, beta) at the electrical rotor angle (rad), shapes (..., 2) and (...)."""
    a = floats("stator", stator, (2,))
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * a[..., 0] + s * a[..., 1], -s * a[..., 0] + c * a[..., 1]], axis=-1)


def inverse_park(rotor: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Return (alpha, beta) of (d, q) at the electrical rotor angle (rad), shapes (..., 2) and (...)."""
    return park(rotor, -np.asarray(angle, float))
