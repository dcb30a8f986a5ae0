"""The response as modes alone, and their state: what methods that march in time start from."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem


def modal_plane(plane: PlaneDynamics) -> PlaneDynamics:
    """Return the plane as modes alone, which methods that march in time need; refuse a measured FRF."""
    if not plane.is_modal:
        fail("dynamics", "a measured FRF", "this method needs modes",
             remedy="identify modes, or use HillDeterminant() (--method hill)")
    return plane.with_modal_residual()


def plane_with_static(problem: MillingProblem, speed: float | None = None) -> PlaneDynamics:
    """Return modes with the static part beside them, for methods in which what answers at once has a place.

    Process damping follows the velocity, which a static part has none of: there it is given by modes (`modal_plane`).
    """
    plane = problem.plane if speed is None else problem.plane_at(speed)
    return modal_plane(plane) if problem.process_damping > 0 or not plane.is_modal else plane


class ModalState:
    """Complex modal state: r = 2 Re(sum_m L_m z_m), z' = s z + R_m^T F, from residues of rank one or two."""

    def __init__(self, plane: PlaneDynamics) -> None:
        left, right, poles = [], [], []
        for s, residue in zip(plane.poles, plane.residues):
            u, size, v = np.linalg.svd(residue)
            for i in range(size.size):
                if size[i] > 1e-13 * size[0]:
                    left.append(u[:, i] * size[i])
                    right.append(v[i])
                    poles.append(s)
        self.left, self.right, self.poles = np.array(left).T, np.array(right), np.array(poles)

    def kernel(self, dt: FloatArray, order: int = 0) -> FloatArray:
        """Return the impulse response (or its rate) at these times, shape (..., d, d)."""
        factor = np.exp(dt[..., None] * self.poles) * self.poles**order
        return 2 * np.einsum("am,...m,mb->...ab", self.left, factor, self.right).real

    def rows(self, dt: FloatArray, order: int = 0) -> FloatArray:
        """Return the displacement (or velocity) after dt from the real state (Re z, Im z), shape (n, d, 2m)."""
        part = 2 * self.left[None] * (np.exp(dt[:, None] * self.poles) * self.poles**order)[:, None, :]
        return np.concatenate([part.real, -part.imag], axis=-1)

    def drive(self, dt: FloatArray) -> FloatArray:
        """Return the state after dt from a unit impulse, shape (n, 2m, d)."""
        part = np.exp(dt[:, None] * self.poles)[..., None] * self.right[None]
        return np.concatenate([part.real, part.imag], axis=1)

    def step(self, dt: float) -> FloatArray:
        """Return the state transition over dt, shape (2m, 2m)."""
        e = np.exp(self.poles * dt)
        return np.block([[np.diag(e.real), -np.diag(e.imag)], [np.diag(e.imag), np.diag(e.real)]])
