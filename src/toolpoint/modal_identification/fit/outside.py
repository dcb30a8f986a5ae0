r"""Terms outside the band, reduced to those that all responses share.

The terms of `basis.outside_terms` can follow any modes out there, separately in every response, and cost the modes near
the ends of the band much of their certainty. The true contribution is shared: a few functions of frequency, for any
number of responses. Written in units of the noise, the coefficients C (n_terms, n_responses) of all responses are
such a part of low rank plus noise of unit variance, whose singular values end at :math:`\sqrt{n_r} + \sqrt{n_t}`. The
left singular vectors above that are kept and the others removed, unless the modes then move by more than their gain in
variance allows (the specification test of Hausman): in that case one more is kept, and so on.

Where a response pattern of the part outside resembles that of a mode, reduction gains this mode nothing, and its
covariance says so.

Source: Marchenko, Pastur, Mathematics of the USSR Sbornik 1 (1967) 457; Hausman, Econometrica 46 (1978) 1251.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from toolpoint._check import FloatArray
from toolpoint.modal_identification.basis import pole_terms, real_rows
from toolpoint.modal_identification.fit.refinement import Data, PoleFit, free_parameters, refine_poles, scale_unknowns

MIN_RESPONSES_PER_TERM = 4  # below, noise and shared functions cannot be separated
NOISE_EDGE_MARGIN = 1.1  # on the largest singular value of pure noise
HAUSMAN_LEVEL = 0.01  # probability of refusing a correct reduction, over all modes
MAX_REDUCTION_TRIALS = 3
REDUCED_FIT_TOLERANCE = 1e-2  # gain of half a chi-squared at which refinement ends


@dataclass(frozen=True, eq=False)
class _OutsidePart:
    """Singular vectors of the part outside: `functions` (n_terms, n), `sizes` (n,), `patterns` (n, n_responses)."""

    coefficients: FloatArray
    functions: FloatArray
    sizes: FloatArray
    patterns: FloatArray


def reduce_outside_terms(data: Data, fit: PoleFit, spread: float) -> tuple[Data, PoleFit, FloatArray]:
    """Return data, fit and information with as few terms outside the band as the responses show; unchanged where none can go.

    The information is that of the poles, less than the fit's where modes look like the part outside. `spread`: as many
    neighbouring lines share their noise (1: none).
    """
    terms, responses = data.outside.shape[1], fit.weight.size
    if responses < MIN_RESPONSES_PER_TERM * terms:
        return data, fit, fit.information
    part = _decompose_outside(data, fit)
    noise_edge = NOISE_EDGE_MARGIN * np.sqrt(spread) * (np.sqrt(responses) + np.sqrt(terms))
    min_count = max(int((part.sizes > noise_edge).sum()), 1)
    for kept_count in range(min_count, min(min_count + MAX_REDUCTION_TRIALS, terms // 2)):
        reduced_data = _project_out(data, fit, part, kept_count)
        trial = refine_poles(reduced_data, fit.poles * data.scale, fit.participation, weight=fit.weight,
                             tolerance=REDUCED_FIT_TOLERANCE)
        information = _blend_information(trial, fit, part.patterns[:kept_count])
        if _agree(fit, replace(trial, information=information), spread):
            return reduced_data, trial, information
    return data, fit, fit.information


def _decompose_outside(data: Data, fit: PoleFit) -> _OutsidePart:
    """Return the singular value decomposition of the outside coefficients in units of the noise."""
    terms = (pole_terms(data.p, fit.poles) * data.factor[:, None, None]).reshape(data.p.size, -1)
    coefficients = data.outside.T @ data.values.reshape(data.values.shape[0], -1)
    coefficients = coefficients - (data.outside.T @ real_rows(terms)) @ _residues(fit)
    left_vectors, sizes, patterns = np.linalg.svd(coefficients * fit.weight.reshape(-1), full_matrices=False)
    return _OutsidePart(coefficients, left_vectors, sizes, patterns)


def _residues(fit: PoleFit) -> FloatArray:
    """Return the real and imaginary parts of all residues, (2 n_modes, n_responses)."""
    residue = fit.shape[:, None, :] * fit.participation
    return np.stack([residue.real, residue.imag], axis=-1).reshape(-1, 2 * fit.poles.size).T


def _project_out(data: Data, fit: PoleFit, part: _OutsidePart, kept_count: int) -> Data:
    """Return the data with the first functions only; the power of the others goes back to the responses."""
    removed = part.functions[:, kept_count:]
    removed_power = ((removed.T @ (data.outside.T @ data.values.reshape(data.values.shape[0], -1))) ** 2).sum(axis=0)
    return replace(data, outside=data.outside @ part.functions[:, :kept_count],
                   power=data.power + removed_power.reshape(data.power.shape))


def _blend_information(trial: PoleFit, full: PoleFit, patterns: FloatArray) -> FloatArray:
    """Return the information of the reduced fit, less the gain of modes whose response pattern the outside part shares."""
    weighted = _residues(trial) * trial.weight.reshape(-1)
    energy = (weighted**2).sum(axis=1).reshape(-1, 2).sum(axis=1)
    common = ((weighted @ patterns.T) ** 2).sum(axis=1).reshape(-1, 2).sum(axis=1) / energy
    fraction = np.repeat(np.clip(common, 0.0, 1.0), trial.information.shape[0] // trial.poles.size)
    root_distinct, root_common = np.sqrt(1 - fraction), np.sqrt(fraction)
    return trial.information * np.outer(root_distinct, root_distinct) + full.information * np.outer(root_common, root_common)


def _agree(full: PoleFit, trial: PoleFit, spread: float) -> bool:
    """Whether no mode has moved by more than its gain in variance allows."""
    variance_full, variance_trial = spread * pole_covariance(full), spread * pole_covariance(trial)
    change = np.stack([(trial.poles - full.poles).real, (trial.poles - full.poles).imag], axis=-1)
    # The covariance of a tiny gain is rounding error: two per cent of the full covariance bound it from below.
    eigenvalues, vectors = np.linalg.eigh(variance_full - variance_trial + 0.02 * variance_full)
    floor = 0.02 * np.linalg.eigvalsh(variance_full).min(axis=1, keepdims=True)
    rotated = np.einsum("rij,ri->rj", vectors, change)
    statistic = (rotated**2 / np.maximum(eigenvalues, floor)).sum(axis=1)
    return bool(statistic.max() < chdtri(2, HAUSMAN_LEVEL / full.poles.size))


def pole_covariance(fit: PoleFit) -> FloatArray:
    """Return the covariance of (Re s, Im s) of every mode in units of `Data.scale`, (n_modes, 2, 2)."""
    free = free_parameters(fit)
    matrix = fit.information[np.ix_(free, free)]
    diagonal = scale_unknowns(matrix)
    inverse: FloatArray = np.zeros(fit.information.shape)
    inverse[np.ix_(free, free)] = np.linalg.pinv(matrix / diagonal[:, None] / diagonal, rcond=1e-12, hermitian=True) / (
        diagonal[:, None] * diagonal)
    unknowns_per_mode = fit.information.shape[0] // fit.poles.size
    return np.stack([inverse[i:i + 2, i:i + 2] for i in range(0, inverse.shape[0], unknowns_per_mode)])
