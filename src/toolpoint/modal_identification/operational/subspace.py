r"""Stochastic subspace identification (SSI) from correlations, all orders from one decomposition, with exact first-order
covariance.

The block-Hankel matrix of the correlations, :math:`H_{ij} = R_{1+i+j}`, is the product of observability and controllability
matrices. Its n leading left singular vectors U span the observability of order n, and with U without its last block row
(:math:`U_\uparrow`) and without its first (:math:`U_\downarrow`),

.. math:: A = (U_\uparrow^T U_\uparrow)^{-1} U_\uparrow^T U_\downarrow, \qquad A \psi = \mu \psi, \qquad s = \ln \mu / \Delta t,
          \qquad \phi = U_1 \psi.

A change of the correlations moves U by :math:`(I - U U^T)\, \delta H\, V S^{-1}` (what it does within the span of U is a
change of basis and moves no pole), so with left and right eigenvectors every pole's change is a sum over lags,
:math:`\delta s = \sum_l \langle G_l, \delta R_l \rangle`: G is computed once a pole, and the scatter of the blocks gives its
covariance. The rotation that singular values left out cause is neglected: at the order of the modes it is none, at orders
above, where vectors of noise stand beside vectors of noise, a single deviation is right to its size (a third). What the
orders differ by is therefore added to the variance of a mode (`mode_selection`), and benchmarks/operational/random_records.py
holds the intervals.

Sources: Peeters, De Roeck, MSSP 13 (1999) 855 (SSI with references); Van Overschee, De Moor, Subspace Identification (1996)
(weights); Reynders, Pintelon, De Roeck, MSSP 22 (2008) 948, and Doehler, Mevel, MSSP 38 (2013) 346 (covariance).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import fft

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification.operational.correlations import Correlations
from toolpoint.modal_identification.poles.stabilization import Diagram

MAX_ORDER_SHARE = 0.4  # of the rank of the Hankel matrix
PAST_EIGENVALUE_FLOOR = 1e-10  # of the covariance of the past, over its largest eigenvalue: below, rounding


@dataclass(frozen=True, eq=False)
class SubspacePoles(NotebookText):
    """Poles of all orders, and how each block of the record moves them.

    Parameters
    ----------
    diagram : Diagram
        Poles (rad/s) with shapes at the channels as participation.
    deviations : (n_blocks, n_poles) complex
        First-order change of each pole for the deviation of each block's correlations from their mean, rad/s.
    """

    diagram: Diagram
    deviations: ComplexArray

    def __repr__(self) -> str:
        return f"SubspacePoles({self.diagram!r}, {self.deviations.shape[0]} blocks)"


@dataclass(frozen=True, eq=False)
class _SingularBasis:
    """Singular vectors of the Hankel matrix, and the products of their shifted parts."""

    left: FloatArray  # (rows n_channels, n)
    right: FloatArray  # (rows n_references, n), scaled to V S^-1
    gram: FloatArray  # U_up^T U_up
    shifted: FloatArray  # U_up^T U_down
    channels: int
    rows: int


def subspace_poles(correlations: Correlations, order: int, *, omega_range: tuple[float, float], weight_past: bool = False,
                   step: int = 2) -> SubspacePoles:
    """Return the poles of the orders `step`, 2 `step`, .. `order` within the range of |s| (rad/s), with their block deviations.

    weight_past : divide by the covariance of the past, as data-driven SSI does (the projection of the future on the past spans
    the same space); plain covariance-driven SSI otherwise. The weight of the past changes no pole to first order, so it
    needs no term in the deviations.
    """
    basis = _decompose(correlations, order, weight_past)
    deviations = correlations.deviations
    entries = []
    gradients: list[ComplexArray] = []
    for size in range(step, basis.left.shape[1] + 1, step):
        matrix = np.linalg.solve(basis.gram[:size, :size], basis.shifted[:size, :size])
        roots, left, right = scipy.linalg.eig(matrix, left=True, right=True, check_finite=False)
        with np.errstate(divide="ignore"):
            poles = np.log(roots) / correlations.interval
        kept = np.flatnonzero(Diagram.is_physical(poles, omega_range))
        shapes = basis.left[:basis.channels, :size] @ right[:, kept]
        entries.append((size, poles[kept], shapes))
        gradients += [_pole_gradient(basis, size, roots[k], left[:, k], right[:, k]) / (roots[k] * correlations.interval)
                      for k in kept]
    diagram = Diagram.collected(entries, omega_range)
    lag_count = correlations.blocks.shape[1]
    flat = deviations.reshape(deviations.shape[0], lag_count, -1)[:, 1:2 * basis.rows].reshape(deviations.shape[0], -1)
    pole_changes = flat @ np.array(gradients).T if gradients else np.zeros((deviations.shape[0], 0), complex)
    return SubspacePoles(diagram, pole_changes)


def _decompose(correlations: Correlations, order: int, weight_past: bool) -> _SingularBasis:
    """Return the singular vectors of the Hankel matrix of the mean correlations."""
    mean = correlations.mean
    lags, channels, references = mean.shape
    rows = lags // 2
    hankel = np.empty((rows, channels, rows, references))
    for i in range(rows):
        hankel[i] = mean[1 + i:1 + i + rows].transpose(1, 0, 2)
    flat = hankel.reshape(rows * channels, rows * references)
    if weight_past:
        flat = flat @ _past_weight(correlations, rows)
    left, size, right = np.linalg.svd(flat, full_matrices=False)
    # The deviations live in the directions that the order leaves out: an order near the rank has none, and no covariance.
    count = int(min(order, MAX_ORDER_SHARE * min(flat.shape), (size > np.finfo(float).eps * size[0] * max(flat.shape)).sum()))
    upper, lower = left[:-channels, :count], left[channels:, :count]
    scaled = right[:count].T / size[:count]
    if weight_past:
        # delta H acts before the weight: V S^-1 is led back through it.
        scaled = _past_weight(correlations, rows) @ scaled
    return _SingularBasis(left[:, :count], scaled, upper.T @ upper, upper.T @ lower, channels, rows)


def _past_weight(correlations: Correlations, rows: int) -> FloatArray:
    r"""Return :math:`\Sigma^{-1/2}` of the past, the covariance of the references at the lags of the Hankel columns."""
    mean = correlations.mean
    references = mean.shape[2]
    square = mean[:, list(correlations.references), :]
    covariance = np.empty((rows, references, rows, references))
    for i in range(rows):
        for j in range(rows):
            lag = j - i
            covariance[i, :, j, :] = square[lag] if lag >= 0 else square[-lag].T
    flat = covariance.reshape(rows * references, -1)
    values, vectors = np.linalg.eigh((flat + flat.T) / 2)
    values = np.maximum(values, PAST_EIGENVALUE_FLOOR * values[-1])
    return vectors / np.sqrt(values) @ vectors.T


def _pole_gradient(basis: _SingularBasis, size: int, root: complex, left: ComplexArray, right: ComplexArray) -> ComplexArray:
    r"""Return the gradient of a discrete pole by the correlations at lags 1 .. 2 rows - 1, flat.

    With :math:`\xi^H = \chi^H (U_\uparrow^T U_\uparrow)^{-1} / \chi^H \psi` and the residual :math:`e = (U_\downarrow - \mu
    U_\uparrow) \psi`, :math:`\delta \mu = \xi^H U_\uparrow^T (\delta U_\downarrow - \mu\, \delta U_\uparrow) \psi + \xi^H
    \delta U_\uparrow^T e`.
    """
    vectors, channels = basis.left[:, :size], basis.channels
    conjugate = np.linalg.solve(basis.gram[:size, :size], left.conj()) / (left.conj() @ right)
    lead, zeros = vectors[:-channels] @ conjugate, np.zeros(channels)
    first = np.concatenate([zeros, lead]) - root * np.concatenate([lead, zeros])
    residual = np.concatenate([(vectors[channels:] - root * vectors[:-channels]) @ right, zeros])
    scaled = basis.right[:, :size]
    return (_lag_sums(basis, first - vectors @ (vectors.T @ first), scaled @ right)
            + _lag_sums(basis, residual - vectors @ (vectors.T @ residual), scaled @ conjugate)).ravel()


def _lag_sums(basis: _SingularBasis, row: ComplexArray, column: ComplexArray) -> ComplexArray:
    """Return the sums of row_i column_j^T over i + j = l, l = 0 .. 2 rows - 2: what multiplies each lag in row^T H column."""
    size = 2 * basis.rows
    rows = fft.fft(row.reshape(basis.rows, -1), size, axis=0)
    columns = fft.fft(column.reshape(basis.rows, -1), size, axis=0)
    return np.asarray(fft.ifft(rows[:, :, None] * columns[:, None, :], axis=0)[:size - 1])
