r"""Terms outside the band, reduced to those that the responses show together.

The terms of `basis.outside_terms` can follow any modes out there, separately in every response, and cost the modes near
the ends of the band much of their certainty. What is really out there is shared: a few functions of frequency, whatever
the number of responses. Written in units of the noise, the coefficients C (n_terms, n_responses) of all responses are
such a part of low rank plus noise of unit variance, whose singular values end at :math:`\sqrt{n_r} + \sqrt{n_t}`. The
left singular vectors above that are kept, the others taken out, unless the modes then move by more than the certainty
they have gained allows (the specification test of Hausman): in that case one more is kept, and so on.

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
from toolpoint.modal_identification.fit.refinement import Data, PoleFit, free_parameters, informative, refine_poles

RESPONSES_PER_TERM = 4
MARGIN = 1.1
LEVEL = 0.01
MOST_TRIALS = 3
TOLERANCE = 1e-2


@dataclass(frozen=True, eq=False)
class _Shared:
    """Singular vectors of the part outside: `functions` (n_terms, n), `sizes` (n,), `patterns` (n, n_responses)."""

    coefficients: FloatArray
    functions: FloatArray
    sizes: FloatArray
    patterns: FloatArray


def economical(data: Data, fit: PoleFit, spread: float) -> tuple[Data, PoleFit, FloatArray]:
    """Return data, fit and information with as few terms outside the band as the responses show; unchanged where none can go.

    The information is that of the poles, less than the fit's where modes look like the part outside. `spread`: as many
    neighbouring lines share their noise (1: none).
    """
    terms, responses = data.outside.shape[1], fit.weight.size
    if responses < RESPONSES_PER_TERM * terms:
        return data, fit, fit.information
    shared = _shared(data, fit)
    edge = MARGIN * np.sqrt(spread) * (np.sqrt(responses) + np.sqrt(terms))
    fewest = max(int((shared.sizes > edge).sum()), 1)
    for kept in range(fewest, min(fewest + MOST_TRIALS, terms // 2)):
        smaller = _reduced(data, fit, shared, kept)
        trial = refine_poles(smaller, fit.poles * data.scale, fit.participation, weight=fit.weight, tolerance=TOLERANCE)
        information = _blended(trial, fit, shared.patterns[:kept])
        if _agree(fit, replace(trial, information=information), spread):
            return smaller, trial, information
    return data, fit, fit.information


def _shared(data: Data, fit: PoleFit) -> _Shared:
    terms = (pole_terms(data.p, fit.poles) * data.factor[:, None, None]).reshape(data.p.size, -1)
    inner = data.outside.T @ data.values.reshape(data.values.shape[0], -1)
    inner = inner - (data.outside.T @ real_rows(terms)) @ _residues(fit)
    left, size, right = np.linalg.svd(inner * fit.weight.reshape(-1), full_matrices=False)
    return _Shared(inner, left, size, right)


def _residues(fit: PoleFit) -> FloatArray:
    """Return the real and imaginary parts of all residues, (2 n_modes, n_responses)."""
    residue = fit.shape[:, None, :] * fit.participation
    return np.stack([residue.real, residue.imag], axis=-1).reshape(-1, 2 * fit.poles.size).T


def _reduced(data: Data, fit: PoleFit, shared: _Shared, kept: int) -> Data:
    free = shared.functions[:, kept:]
    gone = ((free.T @ (data.outside.T @ data.values.reshape(data.values.shape[0], -1))) ** 2).sum(axis=0)
    return replace(data, outside=data.outside @ shared.functions[:, :kept], power=data.power + gone.reshape(data.power.shape))


def _blended(trial: PoleFit, full: PoleFit, patterns: FloatArray) -> FloatArray:
    """Return the information of the reduced fit, less what modes of the same response pattern as the rest cannot gain."""
    weighted = _residues(trial) * trial.weight.reshape(-1)
    energy = (weighted**2).sum(axis=1).reshape(-1, 2).sum(axis=1)
    common = ((weighted @ patterns.T) ** 2).sum(axis=1).reshape(-1, 2).sum(axis=1) / energy
    part = np.repeat(np.clip(common, 0.0, 1.0), trial.information.shape[0] // trial.poles.size)
    apart, alike = np.sqrt(1 - part), np.sqrt(part)
    return trial.information * np.outer(apart, apart) + full.information * np.outer(alike, alike)


def _agree(full: PoleFit, trial: PoleFit, spread: float) -> bool:
    """Return whether no mode has moved by more than its gain in certainty allows."""
    wide, narrow = spread * pole_covariance(full), spread * pole_covariance(trial)
    moved = np.stack([(trial.poles - full.poles).real, (trial.poles - full.poles).imag], axis=-1)
    # A gain of next to nothing has a covariance of rounding errors: two per cent of the whole bound it from below.
    size, vectors = np.linalg.eigh(wide - narrow + 0.02 * wide)
    least = 0.02 * np.linalg.eigvalsh(wide).min(axis=1, keepdims=True)
    turned = np.einsum("rij,ri->rj", vectors, moved)
    statistic = (turned**2 / np.maximum(size, least)).sum(axis=1)
    return bool(statistic.max() < chdtri(2, LEVEL / full.poles.size))


def pole_covariance(fit: PoleFit) -> FloatArray:
    """Return the covariance of (Re s, Im s) of every mode in units of `Data.scale`, (n_modes, 2, 2)."""
    free = free_parameters(fit)
    matrix = fit.information[np.ix_(free, free)]
    diagonal = informative(matrix)
    inverse: FloatArray = np.zeros(fit.information.shape)
    inverse[np.ix_(free, free)] = np.linalg.pinv(matrix / diagonal[:, None] / diagonal, rcond=1e-12, hermitian=True) / (
        diagonal[:, None] * diagonal)
    each = fit.information.shape[0] // fit.poles.size
    return np.stack([inverse[i:i + 2, i:i + 2] for i in range(0, inverse.shape[0], each)])
