"""A chain of masses on springs, as a model with exact derivatives."""

from __future__ import annotations

import numpy as np

from toolpoint.updating import AffineSystem, Parameter, SystemModel
from toolpoint.vibration import SecondOrderSystem
from toolpoint.vibration.sensitivity import MatrixDerivatives

MASSES = np.array([3.0, 2.0, 1.5, 1.0])


def chain(stiffness=(4e5, 3e5, 2e5, 1e5), damping=(20.0, 15.0, 10.0, 5.0), lines=None):
    """Return (model, parameters): four masses, spring and damper i between mass i and the one before (ground for the first)."""
    n = len(MASSES)
    pattern = np.zeros((n, n, n))
    for i in range(n):
        e = np.zeros(n)
        e[i] = 1.0
        if i:
            e[i - 1] = -1.0
        pattern[i] = np.outer(e, e)
    names = tuple(f"springs.{i}.stiffness" for i in range(n)) + tuple(f"springs.{i}.damping" for i in range(n))
    zero = np.zeros_like(pattern)
    system = SecondOrderSystem(np.diag(MASSES), np.tensordot(stiffness, pattern, 1), np.tensordot(damping, pattern, 1))
    slopes = MatrixDerivatives(names, damping=np.concatenate([zero, pattern]), stiffness=np.concatenate([pattern, zero]))
    values = (*map(float, stiffness), *map(float, damping))
    outputs = system.outputs if lines is not None else ()
    model = SystemModel(AffineSystem(system, slopes, values), n, lines, outputs, system.inputs[:1] if outputs else ())
    positive = [(name, value) for name, value in zip(names, values, strict=True) if value > 0]
    return model, [Parameter(name, value, value / 100, value * 100) for name, value in positive]


def measured(model):
    """Return what the model predicts at its base."""
    return model({}, ())
