"""Bodies and paths of a machine as plain arrays, as the compiled kernels take them."""

from __future__ import annotations

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint.machine.parts.model import Machine


def body_moments(machine: Machine) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return masses (n,), first (n, 3) and second moments (n, 3, 3) about the machine's origin at the reference pose."""
    links = len(machine.bodies)
    mass, first, second = np.empty(links), np.empty((links, 3)), np.empty((links, 3, 3))
    for i, body in enumerate(machine.bodies):
        r, t = machine.body_frames[i, :3, :3], machine.body_frames[i, :3, 3]
        m = body.mass[0, 0]
        h = np.array([body.mass[5, 1], body.mass[3, 2], body.mass[4, 0]])
        inertia = body.mass[3:, 3:]
        s = r @ (0.5 * np.trace(inertia) * np.eye(3) - inertia) @ r.T
        h = r @ h
        mass[i], first[i], second[i] = m, h + m * t, s + np.outer(h, t) + np.outer(t, h) + m * np.outer(t, t)
    return mass, first, second


def paths_of(machine: Machine) -> BoolArray:
    """Return whether link i is on the path to link j, shape (n_links, n_links)."""
    links = len(machine.bodies)
    on_path = np.zeros((links, links), bool)
    for i in range(links):
        on_path[list(machine.chain.path(i)), i] = True
    return on_path
