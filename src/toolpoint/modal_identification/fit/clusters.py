"""Noise that the responses of one point share, or that is smooth along the lines: its factor on the covariance.

The covariance of a fit takes the noise of all responses and lines to be independent. That of a hammer's force is not: it
enters all responses of one record alike, and a force window makes it smooth along the lines, so that the fit of each
response follows it and the residual looks innocent. But all responses must share their poles: the part of each output in
the slope of the cost by a pole (its score) keeps what the output's own noise would have moved the pole by. Scores of
different points are independent, so the sum of their squares over the expected one, the sandwich of White with points as
clusters, is the factor on the covariance.

Source: White, Econometrica 48 (1980) 817; Liang, Zeger, Biometrika 73 (1986) 13.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.modal_identification.fit.refinement import PoleFit
from toolpoint.vibration.dof import Dof

MIN_CLUSTER_POINTS = 10  # below, the sum over points is too uncertain
MIN_WIDENING_DEVIATIONS = 3.0  # standard deviations of the factor under independent noise, above which it counts


def widening(fit: PoleFit, outputs: Sequence[Dof]) -> FloatArray:
    """Return the factor on the covariance of every pole, at least 1, (n_modes,); 1 where points are few or show nothing."""
    names = {point: i for i, point in enumerate(dict.fromkeys(dof.point for dof in outputs))}
    if len(names) < MIN_CLUSTER_POINTS:
        return np.ones(fit.poles.size)
    point_index = np.array([names[dof.point] for dof in outputs])
    scores = np.zeros((len(names), *fit.scores.shape[1:]))
    np.add.at(scores, point_index, fit.scores)
    unknowns_per_mode = fit.information.shape[0] // fit.poles.size
    information = np.stack([fit.information[i:i + 2, i:i + 2] for i in range(0, fit.information.shape[0], unknowns_per_mode)])
    squares = np.einsum("cra,rab,crb->cr", scores, np.linalg.pinv(information, hermitian=True), scores) / 2
    # Under independent noise a sum of n squares of two numbers each scatters by 1/sqrt(n) about one.
    factor = squares.sum(axis=0)
    return np.where(factor > 1 + MIN_WIDENING_DEVIATIONS / np.sqrt(len(names)), factor, 1.0)
