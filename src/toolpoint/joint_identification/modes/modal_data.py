"""Poles and motions as they were measured, whitened by their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from toolpoint._check import Array, ComplexArray, FloatArray

# Poles of measured responses follow a model of viscous modes: no better than this, whatever their noise.
FREQUENCY_FLOOR, DAMPING_FLOOR, RIGIDITY_FLOOR = 1e-5, 6e-4, 1e-5
_MAC_NOISE_PROBABILITY = 1e-3  # of a larger loss of MAC by noise


@dataclass(frozen=True, eq=False)
class ModalData:
    """Measured modes of the components.

    motions : (c, 6, k), real or complex, of the components; roots : one (6 m, 6 m) a component, inverse Cholesky factors of
    the covariance of its columns (m = k, or 2 k: real parts, then imaginary parts), column by column; grams : (c, 6, 6), sums
    over the points, by which shapes are compared; frequency (k,) Hz, ratio (k,); spread : (k, 2, 2), inverse Cholesky factors
    of the covariance of (ln frequency, ratio); scale (k,): standard deviations of the logarithms of the squared scales, None
    where shapes have no scale; calibration: standard deviation of the logarithm of the test's gain, None where not told; mixing
    (k, k): what errors of the poles add to the shapes of others (`mode_mixing`), None where nothing is known of it;
    mixing_deviation (k, k): standard deviation of the share of shape s in shape r that this leaves open, zero for modes apart.
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

    @cached_property
    def shares(self) -> FloatArray:
        """Whitened columns of the shares that shapes may have of others, each times its standard deviation; none where none."""
        deviation = np.zeros((0, 0)) if self.mixing_deviation is None else self.mixing_deviation
        columns = []
        for r, s in np.argwhere(deviation > 0).tolist():
            for turn in (1.0, 1j):
                part = np.zeros_like(self.motions)
                part[..., r] = deviation[r, s] * turn * self.motions[..., s]
                columns.append(self.whitened(part))
        return np.stack(columns, axis=1) if columns else np.zeros((sum(len(root) for root in self.roots), 0))

    def whitened(self, motions: Array) -> FloatArray:
        """Return whitened motions of all components, column by column."""
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
        """Return the motions (c, 6, k) as they would have been measured with these poles, rad/s."""
        return self.motions if self.mixing is None else self.motions + self.mixed_by(self.poles - poles)

    def mixed_by(self, errors: ComplexArray) -> ComplexArray:
        """Return what errors (..., k) of the poles, rad/s, take from the motions, (..., c, 6, k)."""
        assert self.mixing is not None
        return np.einsum("cis,rs,...s->...cir", self.motions, self.mixing, errors, optimize=True)

    @property
    def tells_masses(self) -> bool:
        """Whether the common factor of all masses is told."""
        return self.scale is not None and self.calibration is not None and bool(np.isfinite(self.scale).any())

    @property
    def is_complex(self) -> bool:
        """Whether the shapes are complex."""
        return bool(np.iscomplexobj(self.motions))


def pole_spread(frequency: FloatArray, ratio: FloatArray, covariance: FloatArray | None) -> FloatArray:
    """Return inverse Cholesky factors (k, 2, 2) of the covariance of (ln frequency, damping ratio), with the floors."""
    result = np.zeros((len(frequency), 2, 2))
    for r, f in enumerate(frequency):
        covariance_of_pole = np.diag([1e-6, 1e-4]) ** 2 if covariance is None else covariance[r] / np.array([[f * f, f],
                                                                                                             [f, 1.0]])
        if np.linalg.eigvalsh(covariance_of_pole)[0] < 0:
            covariance_of_pole = np.diag(np.maximum(np.diag(covariance_of_pole), 1e-12))
        floor = np.array([FREQUENCY_FLOOR, DAMPING_FLOOR * max(abs(float(ratio[r])), 1e-3)])
        result[r] = np.linalg.inv(np.linalg.cholesky(covariance_of_pole + np.diag(floor) ** 2))
    return result


def covariance_roots(covariances: Sequence[FloatArray], grams: FloatArray, motions: Array) -> tuple[FloatArray, ...]:
    """Return the inverse Cholesky factors of covariances (m, 6, m, 6), with the floor of the shapes.

    No casting is perfectly rigid: a motion of every component of its own, by a share of the largest motion of a mode.
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
        unit = flat / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
        result.append(np.linalg.inv(np.linalg.cholesky(unit)) / scale)
    return tuple(result)


def mac_noise(data: ModalData) -> FloatArray:
    """Return the loss (k,) of MAC of a measured shape with the true one by noise alone, exceeded with a probability of 0.1 %.

    The mean is the noise's share of the motion's power, over 6 numbers a component (12 of complex shapes).
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
