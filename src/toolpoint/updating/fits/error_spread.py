r"""Scatter of parameters where the deviations of the data are assumed: by what the residuals themselves show.

With :math:`B = J^T J` the covariance of the parameters is :math:`B^{-1} M B^{-1}`, M that of :math:`J^T r`. Where deviations
are measured M = B. Where they are assumed, residuals r of unlike size say what they are: of responses M is the sum of
:math:`g g^T` over bands of neighbouring lines, :math:`g = J^T r` of one band with all its responses, so that errors may be
larger at some lines than at others, and alike at neighbours. A single factor (reduced chi-square) would take the mean over
lines where the fit is decided and lines where nothing happens. A band that decides a parameter alone has no residual left for
it: g is taken at the parameters that the other bands give (the jackknife), :math:`B (B - B_b)^{-1} g`, and M is in no direction
less than what the noise of the lines alone makes of it. Numbers of modes are too few for all that: theirs is B times their mean
square.

Sources: White, Econometrica 48 (1980); Liang, Zeger, Biometrika 73 (1986); Bell, McCaffrey, Survey Methodology 28 (2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.residuals import Residuals

# Bands of lines; fewer than so many for each parameter tell no covariance.
MAX_LINE_BANDS, MIN_LINES_PER_PARAMETER = 200, 5


def has_assumed_responses(targets: Sequence[Targets]) -> bool:
    """Whether responses whose deviations are assumed are among the targets."""
    return any(part.frf is not None and part.frf.variance is None for part in targets)


def spread_of_gradient(targets: Sequence[Targets], residuals: Residuals) -> FloatArray:
    """Return M, (n_parameters, n_parameters), of residuals with their Jacobian."""
    jacobian = residuals.jacobian
    assert jacobian is not None
    count = jacobian.shape[1]
    gram = jacobian.T @ jacobian
    spread, modal, first_row = np.zeros((count, count)), [], 0
    sets = iter(part for part in targets if part.frf is not None)
    for name, size in residuals.blocks:
        rows = slice(first_row, first_row + size)
        first_row += size
        if name.endswith("frf"):
            spread += _line_spread(next(sets), residuals.values[rows], jacobian[rows], gram)
        else:
            modal.append(rows)
    if not modal:
        return spread
    values, rows_of_modes = (np.concatenate([part[rows] for rows in modal]) for part in (residuals.values, jacobian))
    square = float((values**2).sum()) / max(values.size - count, 1)
    # Deviations that were measured are not made less by a good agreement.
    return spread + rows_of_modes.T @ rows_of_modes * (max(square, 1.0) if any(t.measured for t in targets) else square)


def _line_spread(targets: Targets, values: FloatArray, jacobian: FloatArray, gram: FloatArray) -> FloatArray:
    """Return the part of M of the responses of one set; `gram` is B of all data."""
    assert targets.frf is not None
    lines, count = targets.frf.frequency.size, jacobian.shape[1]
    if targets.frf.variance is not None:
        return jacobian.T @ jacobian
    if lines < MIN_LINES_PER_PARAMETER * count:
        return jacobian.T @ jacobian * float((values**2).mean())
    # Rows are lines times responses, real parts above imaginary ones.
    noise = np.tile((targets.noise_of_lines() / np.sqrt(2) / targets.frf_deviation()).ravel(), 2)
    noise_spread = jacobian.T @ (jacobian * (noise**2)[:, None])
    parts, errors = jacobian.reshape(2, lines, -1, count), values.reshape(2, lines, -1)
    edges = np.arange(min(lines, MAX_LINE_BANDS) + 1) * lines // min(lines, MAX_LINE_BANDS)
    spread = np.zeros((count, count))
    for begin, end in pairwise(edges):
        rows = parts[:, begin:end].reshape(-1, count)
        other_gram = gram - rows.T @ rows
        gradient = gram @ np.linalg.lstsq(other_gram, rows.T @ errors[:, begin:end].ravel(), rcond=1e-12)[0]
        spread += np.outer(gradient, gradient)
    # The factor of the jackknife for n bands, (n - 1)/n.
    return _raised_to(spread * (len(edges) - 2) / (len(edges) - 1), noise_spread)


def _raised_to(matrix: FloatArray, lower_bound: FloatArray) -> FloatArray:
    """Return a positive matrix that is in no direction less than another: eigenvalues of the pencil below one are made one."""
    # In the coordinates where the bound is the identity, raising is a maximum with one.
    root = np.linalg.cholesky(lower_bound + 1e-12 * np.trace(lower_bound) * np.eye(len(lower_bound)))
    inverse_root = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse_root @ matrix @ inverse_root.T)
    turned = root @ vectors
    return (turned * np.maximum(values, 1.0)) @ turned.T
