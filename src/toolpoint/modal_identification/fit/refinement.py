r"""Refinement of poles by variable projection: the maximum-likelihood modes with their covariance.

Common poles and participation factors are the non-linear unknowns; shapes and all terms outside the band are linear and
are eliminated in every step. With basis columns B and their derivatives D the Gauss-Newton matrix of the eliminated
problem is :math:`J^T P_\perp J`, :math:`P_\perp = I - B (B^T B)^{-1} B^T`, and as every derivative column is a basis
function times a shape it is the Hadamard product of a small Gram matrix of basis functions and a small Gram matrix of
shapes: its cost does not grow with the number of responses. With weights one over the standard deviation of the noise
its inverse is the covariance of the poles.

Source: Golub, Pereyra, SIAM J. Numerical Analysis 10 (1973) 413; Kaufman, BIT 15 (1975) 49; for the maximum-likelihood
frame in modal analysis: Guillaume, Verboven, Vanlanduit, ISMA 23 (1998); El-Kafafy, De Troyer, Peeters, Guillaume, MSSP
37 (2013) 192.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointError
from toolpoint.modal_identification.basis import (
    factor,
    laplace,
    outside_terms,
    pole_slopes,
    pole_terms,
    real_rows,
)
from toolpoint.vibration.frf import Frf

MAX_REFINEMENT_STEPS = 30
NEGLIGIBLE_GAIN_RATIO = 0.1  # predicted gain of a step over the tolerance: below, the step is not taken


@dataclass(frozen=True, eq=False)
class Data:
    """Measured responses as real rows with the terms outside the band projected away, in units of the top of the band.

    `values` (2 n_f, n_outputs, n_inputs) are the raw rows times the line weight, `outside` (2 n_f, q) is an orthonormal
    basis of the terms outside the band, `power` the squared norms of the projected responses.
    """

    frf: Frf
    scale: float
    p: ComplexArray
    factor: ComplexArray
    line_weight: FloatArray
    values: FloatArray
    outside: FloatArray
    power: FloatArray

    @classmethod
    def of(cls, frf: Frf, line_weight: FloatArray | None = None) -> Data:
        """Return the data of one pose, cut to the band; `line_weight` (n_f,): one over the relative noise of a line."""
        # Poles in units of the top of the band are of order one: the normal matrix mixes them with participations, which are
        # too.
        scale = float(frf.omega[-1])
        weight = np.ones(frf.frequency.size) if line_weight is None else line_weight
        lines = weight.size
        values = np.empty((2 * lines, *frf.values.shape[1:]))  # filled in place: the largest array of all
        np.multiply(frf.values.real, weight[:, None, None], out=values[:lines])
        np.multiply(frf.values.imag, weight[:, None, None], out=values[lines:])
        outside = real_rows(outside_terms(frf) * (factor(frf) * weight)[:, None])
        # Terms outside the band are nearly dependent: an orthonormal basis of what differs is taken off once, and no fit
        # sees them again.
        outside_basis, singular, _ = np.linalg.svd(outside, full_matrices=False)
        # Residual terms of a narrow band are nearly alike: a direction of rounding would get any size.
        outside_basis = np.ascontiguousarray(outside_basis[:, singular > 1e-10 * singular[0]])
        flat = values.reshape(values.shape[0], -1)
        power = np.einsum("fk,fk->k", flat, flat) - ((outside_basis.T @ flat) ** 2).sum(axis=0)
        return cls(frf, scale, laplace(frf) / scale, factor(frf) * weight, weight, values, outside_basis,
                   np.maximum(power, 0.0).reshape(values.shape[1:]))

    def columns(self, terms: ComplexArray) -> FloatArray:
        """Return complex terms (n_f, n, 2) as real projected columns (2 n_f, 2 n)."""
        rows = real_rows((terms * self.factor[:, None, None]).reshape(self.p.size, -1))
        return rows - self.outside @ (self.outside.T @ rows)


class Indistinguishable(ToolpointError):
    """Error: the responses within the band do not distinguish the shapes of the modes."""


@dataclass(frozen=True, eq=False)
class PoleFit:
    """Poles (in units of `Data.scale`), participation (n_inputs, n_modes), shapes, and the residuals of their fit.

    `weight` (n_outputs, n_inputs) is sqrt(2) over the standard deviation of the noise, `squares` the sum of squared
    residuals of each response, `information` the Gauss-Newton matrix of (Re s, Im s, Re l_i, Im l_i ..) of each mode,
    `gradient` minus the slope of the cost, `shape_covariance` (n_outputs, 2 n_modes, 2 n_modes) that of the real and
    imaginary parts of the shapes at fixed poles, `scores` (n_outputs, n_modes, 2) the part of each output in the gradient
    by Re s and Im s.
    """

    poles: ComplexArray
    participation: ComplexArray
    weight: FloatArray
    shape: ComplexArray
    squares: FloatArray
    information: FloatArray
    gradient: FloatArray
    shape_covariance: FloatArray
    scores: FloatArray

    @property
    def cost(self) -> float:
        """Half of the weighted sum of squared residuals."""
        return 0.5 * float((self.weight**2 * self.squares).sum())

    @property
    def significance(self) -> FloatArray:
        """Wald statistic of every mode: chi-squared with 2 n_outputs degrees of freedom if there were no such mode."""
        count = self.poles.size
        blocks = self.shape_covariance.reshape(-1, count, 2, count, 2)
        variance = np.linalg.inv(blocks[:, np.arange(count), :, np.arange(count), :])  # (mode, output, 2, 2)
        vector = np.stack([self.shape.real, self.shape.imag], axis=-1).transpose(1, 0, 2)[..., None]
        return (np.swapaxes(vector, -1, -2) @ variance @ vector).sum(axis=(1, 2, 3))


def evaluate(data: Data, poles: ComplexArray, participation: ComplexArray, *, weight: FloatArray) -> PoleFit:
    """Return the best shapes for these poles and participations, with the Gauss-Newton matrix and gradient there.

    Raises Indistinguishable where the responses do not distinguish the shapes of the modes.
    """
    try:
        return _evaluate(data, poles, participation, weight=weight)
    except np.linalg.LinAlgError:
        lines = data.frf.frequency
        raise Indistinguishable(
            f"band: {lines[0]:.4g} to {lines[-1]:.4g} Hz, {lines.size} lines; the responses within it do not tell the shapes "
            f"of {poles.size} modes apart (their normal matrix is singular); take a wider band, finer lines or another "
            "reference"
        ) from None


def _evaluate(data: Data, poles: ComplexArray, participation: ComplexArray, *, weight: FloatArray) -> PoleFit:
    """Return the fit of `evaluate`; raises LinAlgError for a singular normal matrix."""
    m, (outputs, inputs) = poles.size, weight.shape
    base, slope = data.columns(pole_terms(data.p, poles)), data.columns(pole_slopes(data.p, poles))
    columns = np.concatenate([base, slope], axis=1)
    gram = columns.T @ columns
    moments = (columns.T @ data.values.reshape(columns.shape[0], -1)).reshape(-1, outputs, inputs)
    moments = np.ascontiguousarray(moments.transpose(2, 1, 0))  # (input, output, column)
    participation_matrices, weight_squared = _participation_matrices(participation), weight**2
    gram_rows = _apply_participation(participation_matrices, gram[:2 * m])
    shape_grams = _apply_participation(participation_matrices, gram_rows[:, :, :2 * m].transpose(0, 2, 1))
    shape_information = np.tensordot(weight_squared, shape_grams, axes=(1, 0))
    right_sides = np.stack([weight_squared[:, i, None] * (moments[i, :, :2 * m] @ _block_diagonal(participation_matrices[i]))
                            for i in range(inputs)])
    inverse = np.asarray(np.linalg.inv(shape_information), float)
    shape = (inverse @ right_sides.sum(axis=0)[:, :, None])[..., 0]
    residues = shape @ np.stack([_block_diagonal(block).T for block in participation_matrices])  # (input, output, 2 n_modes)
    residual_moments = moments - residues @ gram[:2 * m]
    explained = (residues * (moments + residual_moments)[:, :, :2 * m]).sum(axis=-1).T
    parts = _NormalParts(gram, gram_rows, residual_moments, _tangents(residues, shape), weight_squared, inverse)
    information, slopes = _gauss_newton(parts)
    scores = slopes.reshape(outputs, m, -1)[:, :, :2]
    return PoleFit(poles, participation, weight, shape[:, ::2] + 1j * shape[:, 1::2],
               # The difference of two large numbers where the fit is good: rounding may take it below zero.
               np.maximum(data.power - explained, 0.0), information, slopes.sum(axis=0), inverse, scores)


def try_evaluate(data: Data, poles: ComplexArray, participation: ComplexArray, *, weight: FloatArray) -> PoleFit | None:
    """Return the fit of `evaluate`, or None where the responses do not distinguish the shapes of two modes."""
    try:
        return evaluate(data, poles, participation, weight=weight)
    except Indistinguishable:
        return None


def _apply_participation(matrices: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return diag(turn_i)^T times the (2 n_modes, n) rows of `matrix`, (n_inputs, 2 n_modes, n)."""
    rows = matrix.reshape(*matrix.shape[:-2], matrices.shape[1], 2, matrix.shape[-1])
    return (np.swapaxes(matrices, -1, -2) @ rows).reshape(matrices.shape[0], matrix.shape[-2], matrix.shape[-1])


def _block_diagonal(turn: FloatArray) -> FloatArray:
    """Return the (n_modes, 2, 2) matrices as one block-diagonal matrix."""
    m = turn.shape[0]
    block = np.zeros((m, 2, m, 2))
    block[np.arange(m), :, np.arange(m), :] = turn
    return block.reshape(2 * m, 2 * m)


def _participation_matrices(participation: ComplexArray) -> FloatArray:
    """Return multiplication by each participation factor as real 2 x 2 matrices, (n_inputs, n_modes, 2, 2)."""
    re, im = participation.real, participation.imag
    return np.stack([np.stack([re, -im], axis=-1), np.stack([im, re], axis=-1)], axis=-2)


def _tangents(residues: FloatArray, shape: FloatArray) -> FloatArray:
    """Return d(residual coefficients) by (Re s, Im s, Re l, Im l), shape (n_inputs, n_outputs, n_modes, 4, 2).

    The first two multiply the slope functions, the last two the pole functions.
    """
    def pair(z: FloatArray) -> FloatArray:
        z = z.reshape(*z.shape[:-1], -1, 2)
        return np.stack([z, np.stack([-z[..., 1], z[..., 0]], axis=-1)], axis=-2)

    first = pair(residues)
    return np.concatenate([first, np.broadcast_to(pair(shape), first.shape)], axis=-2)


@dataclass(frozen=True, eq=False)
class _NormalParts:
    """Parts of the Gauss-Newton matrix: `gram_rows` (input, 2 m, 4 m), `residual_moments` (input, output, column); m modes."""

    gram: FloatArray
    gram_rows: FloatArray
    residual_moments: FloatArray
    tangents: FloatArray
    weight_squared: FloatArray
    inverse: FloatArray


def _gauss_newton(parts: _NormalParts) -> tuple[FloatArray, FloatArray]:
    """Return the Gauss-Newton matrix and the part of each output in the gradient, (n_outputs, unknowns)."""
    inputs, outputs, m = parts.tangents.shape[:3]
    unknowns_per_mode = 2 + 2 * inputs
    # Columns that belong to each (mode, tangent, component): slopes for the pole, pole functions for the participation.
    slope = 2 * m + np.arange(2 * m).reshape(m, 1, 2)
    columns = np.concatenate([np.repeat(slope, 2, 1), np.repeat(slope - 2 * m, 2, 1)], axis=1)
    pairs = parts.gram[columns.reshape(-1)[:, None], columns.reshape(-1)]
    information, gradient = np.zeros((m * unknowns_per_mode, m * unknowns_per_mode)), np.zeros((outputs, m * unknowns_per_mode))
    cross = np.zeros((outputs, m, unknowns_per_mode, 2 * m))
    for i in range(inputs):
        unknowns = np.array([0, 1, 2 + 2 * i, 3 + 2 * i])
        rows_of_input = (np.arange(m)[:, None] * unknowns_per_mode + unknowns).reshape(-1)
        weighted = parts.tangents[i] * parts.weight_squared[:, i, None, None, None]
        products = weighted.reshape(outputs, -1).T @ parts.tangents[i].reshape(outputs, -1)
        information[np.ix_(rows_of_input, rows_of_input)] += (pairs * products).reshape(4 * m, 2, 4 * m, 2).sum(axis=(1, 3))
        gradient[:, rows_of_input] += (weighted * parts.residual_moments[i][:, columns]).sum(axis=-1).reshape(outputs, -1)
        for first in (0, 2):  # slope functions, then pole functions
            rows = parts.gram_rows[i][:, columns[:, first]].transpose(1, 2, 0)  # (mode, component, 2 n_modes)
            cross[:, :, unknowns[first:first + 2]] += weighted[:, :, first:first + 2] @ rows
    # Shapes are linear unknowns: their Schur complement is taken off, so the step is that of all unknowns at once (variable
    # projection) and the matrix stays as small as poles and participations.
    whitened = cross.reshape(outputs, m * unknowns_per_mode, 2 * m) @ np.linalg.cholesky(parts.inverse)
    flat = whitened.transpose(1, 0, 2).reshape(m * unknowns_per_mode, -1)
    information -= flat @ flat.T
    return (information + information.T) / 2, gradient


def refine_poles(data: Data, poles: ComplexArray, participation: ComplexArray, *, weight: FloatArray,
            tolerance: float = 1e-3) -> PoleFit:
    """Return the converged fit with fixed weights: Gauss-Newton with a Levenberg-Marquardt guard.

    `poles` in rad/s; `participation` (n_inputs, n_modes) of any scale, its largest factor is kept fixed. Steps end when
    one gains less than `tolerance` in half a chi-squared (1 moves all unknowns by about one standard deviation).
    """
    # A factor moved between shape and participation changes nothing: one of the two must be held, and the largest never
    # passes zero.
    leading_factor = participation[np.argmax(np.abs(participation), axis=0), np.arange(poles.size)]
    fit = evaluate(data, poles / data.scale, participation / leading_factor, weight=weight)
    damping = 0.0
    for _ in range(MAX_REFINEMENT_STEPS):
        step = _solve_step(fit, damping)
        gain = 0.5 * float(step @ fit.information @ step)
        # Only of an undamped step: a damped one promises little because it is short, and not because it is at the end.
        if gain < NEGLIGIBLE_GAIN_RATIO * tolerance and damping == 0:
            break
        trial = _take_step(data, fit, step)
        # A rise of the last digits is rounding of a sum of squares, no failure of the step.
        if trial is None or trial.cost > fit.cost * (1 + 1e-12):
            if gain < 1e-6 or damping > 1e6:
                break
            damping = max(10 * damping, 1e-3)
            continue
        # Down by a tenth and not to zero: beside close poles the next full step often fails as the last one did.
        damping, fit = damping / 10, trial
        if gain < tolerance:
            break
    return fit


def free_parameters(fit: PoleFit) -> np.ndarray:
    """Return the indices of the non-linear unknowns less the participation factor of each mode that is held at one."""
    inputs, m = fit.participation.shape
    lead = np.argmax(np.abs(fit.participation), axis=0)
    fixed = np.arange(m) * (2 + 2 * inputs) + 2 + 2 * lead
    return np.setdiff1d(np.arange(m * (2 + 2 * inputs)), np.concatenate([fixed, fixed + 1]))


def scale_unknowns(matrix: FloatArray) -> FloatArray:
    """Return the roots of the diagonal; infinite where an unknown has no information, which takes it out of a solve."""
    square = np.diagonal(matrix)
    return np.where(square > 1e-24 * square.max(), np.sqrt(np.maximum(square, 0.0)), np.inf)


def _solve_step(fit: PoleFit, damping: float) -> FloatArray:
    """Return the Levenberg-Marquardt step of the unknowns."""
    free = free_parameters(fit)
    matrix = fit.information[np.ix_(free, free)]
    diagonal = scale_unknowns(matrix)
    scaled = matrix / diagonal[:, None] / diagonal + damping * np.eye(free.size)
    # Participations of exactly repeated poles can be combined freely: such directions carry no information and are not moved.
    eigenvalues, vectors = np.linalg.eigh(scaled)
    # What the lines do not determine stays where it is, instead of a step by the inverse of rounding.
    is_determined = eigenvalues > 1e-10 * eigenvalues[-1]
    right = vectors.T @ (fit.gradient[free] / diagonal)
    step = np.zeros(fit.gradient.size)
    step[free] = vectors @ np.where(is_determined, right / np.where(is_determined, eigenvalues, 1.0), 0.0) / diagonal
    return step


def _take_step(data: Data, fit: PoleFit, step: FloatArray) -> PoleFit | None:
    """Return the fit after a step; None where a pole leaves the band, is overdamped, or shapes are not distinguished."""
    change = step.reshape(fit.poles.size, -1)
    poles = fit.poles + change[:, 0] + 1j * change[:, 1]
    if (poles.imag <= 0).any() or (np.abs(poles.real) > 0.5 * np.abs(poles)).any():
        return None
    # A pole that runs out of the band would stand in for the outside terms, which are linear and fit better.
    if (np.abs(poles) > 1.1).any() or (np.abs(poles) < 0.9 * data.frf.omega[0] / data.scale).any():
        return None
    factors = (change[:, 2::2] + 1j * change[:, 3::2]).T
    return try_evaluate(data, poles, fit.participation + factors, weight=fit.weight)
