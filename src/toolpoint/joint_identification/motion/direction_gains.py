r"""Gains of the directions of a sensor that is moved: told by all rigid components together.

A sensor of three directions with exchanged or wrong sensitivities has the same fault at every point, so no single channel is
out of line. With factors :math:`g` of the directions, what is left of all modes beside rigid motions is :math:`g^T Q g`, of
:math:`g^T N g` in all: the factors that leave the least share are a generalised eigenvector. Only their ratios are determined.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.measured import Component, about

MIN_GAIN_MISFIT_RATIO = 4.0  # share beside rigid motions as measured, over that with the factors
MIN_GAIN_DEVIATION = 0.1  # of a ratio of factors from one
MIN_ALONG_AXIS = 0.999  # of a unit direction
AXES = "xyz"


def question_gains(parts: Mapping[str, Component]) -> list[Doubt]:
    """Return the doubt that directions of the sensors have wrong gains at all points; none where the components do not show it,
    or where directions lie off the axes.
    """
    left, total = np.zeros((3, 3)), np.zeros((3, 3))
    for part in parts.values():
        axes = (np.abs(part.ways) > MIN_ALONG_AXIS).astype(float)
        if (axes.sum(axis=1) != 1).any():
            return []
        for part_left, part_total in _squares_of_modes(part, axes):
            left, total = left + part_left, total + part_total
    used = np.flatnonzero(np.diag(total) > 1e-9 * np.diag(total).max()) if total.any() else np.zeros(0, int)
    if used.size < 2:
        return []
    left, total = (matrix[np.ix_(used, used)] for matrix in (left, total))
    shares, vectors = eigh(left, total)
    as_measured = float(left.sum() / total.sum())
    factors = vectors[:, 0] / np.median(vectors[:, 0])
    ratio = as_measured / max(float(shares[0]), 1e-12 * as_measured, 1e-300)
    if ratio < MIN_GAIN_MISFIT_RATIO or np.abs(factors - 1).max() < MIN_GAIN_DEVIATION:
        return []
    words = ", ".join(f"{AXES[k]} by {factor:.3g}" for k, factor in zip(used, factors, strict=True) if abs(factor - 1) > 0.5
                      * MIN_GAIN_DEVIATION)
    return [Doubt("sensitivities of the directions", f"with all channels along {words} multiplied, the components move as "
                  f"rigid bodies {ratio:.2g} times better: the sensitivity of a direction is wrong at every point, or two are "
                  "exchanged",
                  "compare the calibration of each channel of the moved sensor with its entry", figure=ratio, grave=True)]


def _squares_of_modes(part: Component, axes: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return for every mode the squares beside rigid motions and in all, (3, 3) by the factors of the directions.

    A mode counts by its variance where that is known, so that false ones and noise count least; else all count alike.
    """
    local = part.rows @ about(part.centre, part.size)
    q = np.linalg.qr(local)[0]
    result = []
    for k, column in enumerate(part.values.T):
        size = float(np.linalg.norm(column) if part.variance is None else np.sqrt(part.variance[:, k].mean()))
        if size > 0 and len(local) > local.shape[1]:
            spread = axes * (column / size)[:, None]
            outside = spread - q @ (q.T @ spread)
            result.append((outside.T @ outside, spread.T @ spread))
    return result
