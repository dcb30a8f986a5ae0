"""Poles and motions as they were measured, whitened by their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from toolpoint._check import Array, ComplexArray, FloatArray

# Least standard deviations, whatever the noise: of ln(frequency); of a damping ratio, over that ratio; of a motion, over the
# largest motion of its mode. No structure has exactly viscous modes, and no component is exactly rigid.
FREQUENCY_FLOOR, DAMPING_FLOOR, RIGIDITY_FLOOR = 1e-5, 6e-4, 1e-5
_MAC_NOISE_PROBABILITY = 1e-3  # probability that noise alone costs more MAC than `mac_noise` states


@dataclass(frozen=True, eq=False)
class ModalData:
    """Measured modes of c rigid components, k modes, with their noise.

    Parameters
    ----------
    motions : (c, 6, k) real or complex
        Rigid-body motion of every component in every mode: translation, rotation.
    roots : c arrays (6 m, 6 m)
        Inverse Cholesky factor of the covariance of each component's motions, mode by mode; m = k, or 2 k of complex shapes
        (real parts, then imaginary parts).
    grams : (c, 6, 6)
        Gram matrix of the rigid-body motion over the measured points of a component: ``v^H gram v`` is the sum of squared
        motions of its points, by which shapes are compared.
    frequency, ratio : (k,)
        Hz; damping ratio.
    spread : (k, 2, 2)
        Inverse Cholesky factors of the covariance of (ln frequency, ratio).
    scale : (k,), optional
        Standard deviation of the logarithm of the squared scale, None where shapes have no scale.
    calibration : float, optional
        Standard deviation of the logarithm of the test's gain, None where none is stated.
    mixing : (k, k), optional
        Correction of shape r by the shapes s for each rad/s of error of pole s (`mode_mixing`), None where unknown.
    mixing_deviation : (k, k), optional
        Standard deviation of the share of shape s in shape r that the correction leaves open, zero for modes apart.
    gain_errors : (n, c, 6, k), optional
        Change of the motions by one standard deviation of each independent combination of the sensor's gains.
    """

    motions: Array
    roots: tuple[FloatArray, ...]
    grams: FloatArray
    frequency: FloatArray
    ratio: FloatArray
    spread: FloatArray
    scale: FloatArray | None = None
    calibration: float | None = None
    mixing: ComplexArray | None = None
    mixing_deviation: FloatArray | None = None
    gain_errors: Array | None = None

    @cached_property
    def shares(self) -> FloatArray:
        """Whitened motions by one standard deviation of what is linear and not determined, (sum of 6 m, n).

        Two columns for each pair of modes that mix, as a share is complex, and one for each combination of the sensor's gains.
        """
        deviation = np.zeros((0, 0)) if self.mixing_deviation is None else self.mixing_deviation
        columns = [] if self.gain_errors is None else [self.whitened(part) for part in self.gain_errors]
        for r, s in np.argwhere(deviation > 0).tolist():
            for turn in (1.0, 1j):
                part = np.zeros_like(self.motions)
                part[..., r] = deviation[r, s] * turn * self.motions[..., s]
                columns.append(self.whitened(part))
        return np.stack(columns, axis=1) if columns else np.zeros((sum(len(root) for root in self.roots), 0))

    def whitened(self, motions: Array) -> FloatArray:
        """Return whitened motions (c, 6, k) of all components as one vector, (sum of 6 m,): unit variance each."""
        parts = []
        for motion, root in zip(motions, self.roots, strict=True):
            columns = np.concatenate([motion.real, motion.imag], axis=1) if self.is_complex else motion
            parts.append(root @ columns.T.ravel())
        return np.concatenate(parts)

    @property
    def poles(self) -> ComplexArray:
        """Measured poles (k,), rad/s."""
        size = 2 * np.pi * self.frequency
        return np.asarray(size * (-self.ratio + 1j * np.sqrt(np.maximum(1 - self.ratio**2, 0.0))), complex)

    def unmixed(self, poles: ComplexArray) -> Array:
        """Return the motions (c, 6, k) as they would have been identified with these poles, (k,) rad/s."""
        return self.motions if self.mixing is None else self.motions + self.mixed_by(self.poles - poles)

    def mixed_by(self, errors: ComplexArray) -> ComplexArray:
        """Return the correction of the motions, (..., c, 6, k), for errors (..., k) of the poles, measured less true, rad/s."""
        assert self.mixing is not None
        return np.einsum("cis,rs,...s->...cir", self.motions, self.mixing, errors, optimize=True)

    @property
    def tells_masses(self) -> bool:
        """Whether the data determine the common factor of all masses: some mode has a scale, and a calibration is stated."""
        return self.scale is not None and self.calibration is not None and bool(np.isfinite(self.scale).any())

    @property
    def is_complex(self) -> bool:
        """Whether the shapes are complex."""
        return bool(np.iscomplexobj(self.motions))


def pole_spread(frequency: FloatArray, ratio: FloatArray, covariance: FloatArray | None) -> FloatArray:
    """Return inverse Cholesky factors (k, 2, 2) of the covariance of (ln frequency, damping ratio), with the floors.

    frequency : (k,) Hz; ratio : (k,); covariance : (k, 2, 2) of (Hz, ratio), or None: then 1e-6 and 1e-4 are assumed.
    """
    result = np.zeros((len(frequency), 2, 2))
    for r, f in enumerate(frequency):
        # Without stated intervals: a millionth of frequency and 1e-4 of damping, so that poles count fully beside shapes.
        covariance_of_pole = np.diag([1e-6, 1e-4]) ** 2 if covariance is None else covariance[r] / np.array([[f * f, f],
                                                                                                             [f, 1.0]])
        # Not a covariance, by few groups or by rounding: the variances are kept, the correlation is dropped.
        if np.linalg.eigvalsh(covariance_of_pole)[0] < 0:
            covariance_of_pole = np.diag(np.maximum(np.diag(covariance_of_pole), 1e-12))
        floor = np.array([FREQUENCY_FLOOR, DAMPING_FLOOR * max(abs(float(ratio[r])), 1e-3)])
        result[r] = np.linalg.inv(np.linalg.cholesky(covariance_of_pole + np.diag(floor) ** 2))
    return result


def covariance_roots(covariances: Sequence[FloatArray], grams: FloatArray, motions: Array) -> tuple[FloatArray, ...]:
    """Return the inverse Cholesky factors, (6 m, 6 m) a component, of covariances (m, 6, m, 6) with the floor of the shapes.

    grams : (c, 6, 6); motions : (c, 6, k). No casting is perfectly rigid: `RIGIDITY_FLOOR` times the largest motion of any
    component in a mode is added to the standard deviation of each.
    """
    result = []
    power = np.einsum("cik,cij,cjk->ck", motions.conj(), grams, motions, optimize=True).real
    size = power.max(axis=0)
    for covariance, gram in zip(covariances, grams, strict=True):
        flat = covariance.reshape(6 * len(covariance), -1)
        floor = RIGIDITY_FLOOR**2 * np.kron(np.diag(np.tile(size, len(covariance) // len(size))), np.linalg.inv(gram))
        flat = (flat + flat.T) / 2 + (floor + floor.T) / 2
        # Columns and units of very different size: scaled to ones before the factor is taken.
        scale = np.sqrt(np.maximum(np.diag(flat), 1e-300))
        # The root of a covariance needs it positive: rounding leaves eigenvalues of either sign about nought.
        unit = flat / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
        result.append(np.linalg.inv(np.linalg.cholesky(unit)) / scale)
    return tuple(result)


def mac_noise(data: ModalData) -> FloatArray:
    """Return the loss (k,) of MAC of a measured shape with the true one by noise alone, exceeded with a probability of 0.1 %.

    Its mean is the power of the noise over that of the motion. It is spread as chi-squared, with 6 degrees of freedom for each
    component (12 of complex shapes), less those of the scale, which MAC does not see.
    """
    k = len(data.frequency)
    noise = np.zeros(k)
    for root, gram in zip(data.roots, data.grams, strict=True):
        factor = np.linalg.inv(root)
        blocks = (factor @ factor.T).reshape(len(root) // 6, 6, len(root) // 6, 6)
        for column in range(len(root) // 6):
            noise[column % k] += float(np.trace(gram @ blocks[column, :, column]))
    power = np.einsum("cik,cij,cjk->k", data.motions.conj(), data.grams, data.motions, optimize=True).real
    freedom = len(data.grams) * (12 if data.is_complex else 6) - (2 if data.is_complex else 1)
    return np.asarray(noise / power * stats.chi2.isf(_MAC_NOISE_PROBABILITY, freedom) / freedom)
