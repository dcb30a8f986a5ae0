r"""Complexity of a mode shape, and its real shape: MPC, MPD, MCF.

Sources: Juang, Pappa, J. Guidance 8 (1985) 620 (modal phase collinearity); Heylen, Lammens, Sas, Modal Analysis Theory
and Testing, section A.5 (mean phase, mean phase deviation); Imregun, Ewins, IMAC 13 (1995) (complexity, as an area);
Niedbal, IMAC 2 (1984) (real shapes).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, complexes, fail
from toolpoint.vibration.modes import Modes


def phase_collinearity(shape: Array) -> FloatArray:
    r"""Return the modal phase collinearity (MPC) of every mode: 1 for a real (or turned real) shape, down to 0.

    With the eigenvalues :math:`\lambda_1, \lambda_2` of the 2 x 2 matrix of the sums of squares of the two parts:
    :math:`MPC = ((\lambda_1 - \lambda_2)/(\lambda_1 + \lambda_2))^2`.

    `shape`: (n_dofs, n_modes).

    Examples
    --------
    >>> phase_collinearity(np.array([[1.0, 1.0], [-2.0, 1j]])).round(9).tolist()  # a standing and a travelling shape
    [1.0, 0.0]
    """
    major, minor = _principal(_shapes(shape))
    return ((major - minor) / (major + minor)) ** 2


def mean_phase(shape: Array) -> FloatArray:
    """Return the angle (rad, within +-pi/2) of the straight line that fits every shape best in the complex plane."""
    phi = _shapes(shape)
    return 0.5 * np.angle((phi**2).sum(axis=0))


def mean_phase_deviation(shape: Array) -> FloatArray:
    """Return the mean phase deviation (MPD) of each mode, degrees, each Dof weighted by its size; 0 for real shapes.

    Examples
    --------
    >>> mean_phase_deviation(np.array([[1j], [-2j]])).round(9).tolist()  # real, turned by 90 degrees
    [0.0]
    """
    phi = _shapes(shape) * np.exp(-1j * mean_phase(shape))
    angle = np.arctan2(np.abs(phi.imag), np.abs(phi.real))
    size = np.abs(phi)
    return np.degrees((size * angle).sum(axis=0) / size.sum(axis=0))


def complexity_factor(shape: Array) -> FloatArray:
    r"""Return the modal complexity factor (MCF) of every mode: 0 for a real shape, 1 for a travelling wave.

    :math:`MCF = 1 - MPC`, MPC from :math:`|\phi^T \phi|^2 / (\phi^H \phi)^2`, which is free of the mean phase.

    Examples
    --------
    >>> complexity_factor(np.array([[1.0, 1.0], [-2.0, 1j]])).round(9).tolist()
    [0.0, 1.0]
    """
    phi = _shapes(shape)
    return 1 - np.abs((phi**2).sum(axis=0)) ** 2 / (np.abs(phi) ** 2).sum(axis=0) ** 2


def real_modes(modes: Modes) -> Modes:
    r"""Return the real modes nearest to complex ones, mass-normalised where the scale is known.

    A mode of modal A scaling becomes :math:`\psi = \Re(\phi \sqrt{2 i \omega_d})`, exact for proportional damping; an
    unscaled one is turned to its mean phase. The notes name the modes whose phase collinearity is below 0.9.

    Examples
    --------
    >>> turned = Modes([50.0], [0.02], np.array([[1.0], [0.5]]) * np.exp(0.3j), ["tip:+x", "tip:+y"], scaling="unscaled")
    >>> float(abs(real_modes(turned).shape[1, 0] / real_modes(turned).shape[0, 0]).round(9))
    0.5
    """
    if modes.frequency.ndim > 1:
        fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use at_pose(i)")
    if not np.iscomplexobj(modes.shape):
        return modes
    is_scaled = modes.scaling == "modal A"
    phase_factor = np.sqrt(2j * modes.poles.imag) if is_scaled else np.exp(-1j * mean_phase(modes.shape))
    shape = (modes.shape * phase_factor).real
    participation = None
    if modes.participation is not None:
        # The residue is shape times participation: the phase taken from one goes to the other.
        participation = (modes.participation * phase_factor).real if is_scaled else modes.participation / phase_factor
    complex_modes = np.flatnonzero(phase_collinearity(modes.shape) < 0.9) + 1
    notes = [f"mode {i}: phase collinearity below 0.9, its real shape is an approximation" for i in complex_modes]
    variance = None if modes.shape_variance is None else modes.shape_variance * np.abs(phase_factor) ** 2 / 2
    return replace(modes, shape=shape, participation=participation, scaling="unit modal mass" if is_scaled else "unscaled",
                   shape_variance=variance, lower_residual=_real(modes.lower_residual),
                   upper_residual=_real(modes.upper_residual), notes=(*modes.notes, *notes))


def _real(residual: ComplexArray | None) -> ComplexArray | None:
    """Return the real part of a residual as complex."""
    return None if residual is None else residual.real.astype(complex)


def _shapes(shape: Array) -> ComplexArray:
    """Return shapes as complex, after checking that each moves."""
    phi = complexes("shape", shape, (None, None))
    if (np.abs(phi).sum(axis=0) == 0).any():
        fail("shape", "a mode that is zero at all Dofs", "must move somewhere")
    return phi


def _principal(phi: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the eigenvalues of the 2 x 2 matrix of sums of squares, larger first."""
    xx, yy, xy = (phi.real**2).sum(axis=0), (phi.imag**2).sum(axis=0), (phi.real * phi.imag).sum(axis=0)
    mean, half_difference = (xx + yy) / 2, np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
    return mean + half_difference, mean - half_difference
