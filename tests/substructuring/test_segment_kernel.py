"""Compiled kernels of shaft segments against the equations of their docstrings in NumPy."""

import numpy as np
import pytest
from scipy.linalg import expm

from toolpoint.substructuring import SegmentDescription, segment_kernel


def transfer_matrix(omega, row):
    """Return exp(Z h) of a whole segment: w' = t + V/(kappa G A), t' = M/(E I), V' = -rho A w^2 w, M' = -rho I w^2 t - V."""
    density, modulus, shear, area, second, length, _ = row
    z = np.zeros((4, 4), complex)
    z[0, 1], z[0, 2], z[1, 3], z[2, 0] = 1, 1 / (shear * area), 1 / (modulus * second), -density * area * omega**2
    z[3, 1], z[3, 2] = -density * second * omega**2, -1
    return expm(z * length)


@pytest.fixture
def row():
    return SegmentDescription(0.1, 0.03, loss_factor=0.01).row


OMEGA = 2 * np.pi * np.array([10.0, 2000.0, 2e4])


def test_receptances_pass_a_segment_by_the_transfer_matrix(row):
    rng = np.random.default_rng(1)
    base = 1e-6 * (rng.normal(size=(3, 2, 2, 2)) + 1j * rng.normal(size=(3, 2, 2, 2)))
    tip, sway = np.empty_like(base), np.empty_like(base)
    segment_kernel.carry_receptances(OMEGA, row[None], base, tip, sway)
    for line, omega in enumerate(OMEGA):
        t = transfer_matrix(omega, row)
        t11, t12, t21, t22 = t[:2, :2], t[:2, 2:], t[2:, :2], t[2:, 2:]
        inverse = np.linalg.inv(t21 @ base[line] + t22)
        np.testing.assert_allclose(sway[line], inverse, rtol=1e-8, atol=1e-8 * np.abs(inverse).max())
        np.testing.assert_allclose(tip[line], (t11 @ base[line] + t12) @ inverse, rtol=1e-8)


def test_stiffness_of_a_segment_follows_from_its_transfer_matrix(row):
    stiffness = np.empty((3, 4, 4), complex)
    segment_kernel.segment_stiffness(OMEGA, row, stiffness)
    for line, omega in enumerate(OMEGA):
        t = transfer_matrix(omega, row)
        t11, t12, t21, t22 = t[:2, :2], t[:2, 2:], t[2:, :2], t[2:, 2:]
        start = np.hstack([-np.linalg.solve(t12, t11), np.linalg.inv(t12)])  # (V, M) at the start, over (u, u')
        end = np.hstack([t21, np.zeros((2, 2))]) + t22 @ start
        exact = np.vstack([-start, end])
        assert np.abs(stiffness[line] - exact).max() < 1e-8 * np.abs(exact).max()
