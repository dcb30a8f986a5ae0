"""Twins: poles that share one mode, told from repeated roots by the rank of their joint residue."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray
from toolpoint.modal_identification.fit.refinement import PoleFit

NEAR = 0.3
WEAK = 0.1


def without_twins(fit: PoleFit) -> tuple[ComplexArray, ComplexArray]:
    """Return poles and participation with every group of nearly equal poles reduced to the rank of its residue.

    Poles within 0.3 half widths form a group. The singular values of the sum of their residues say how many modes there
    are (those above a tenth of the largest); their right singular vectors are the participations.
    """
    left = list(np.argsort(np.abs(fit.poles), kind="stable"))
    poles, vectors = [], []
    while left:
        group = [left.pop(0)]
        for i in list(left):
            if any(abs(fit.poles[i] - fit.poles[j]) < NEAR * abs(fit.poles[j].real) for j in group):
                group.append(i)
                left.remove(i)
        if len(group) == 1:
            poles.append(fit.poles[group[0]])
            vectors.append(fit.participation[:, group[0]])
            continue
        residue = fit.shape[:, group] @ fit.participation[:, group].T
        size, right = np.linalg.svd(residue, full_matrices=False)[1:]
        share = np.linalg.norm(fit.shape[:, group], axis=0) * np.linalg.norm(fit.participation[:, group], axis=0)
        centre = complex((fit.poles[group] * share).sum() / share.sum())
        for k in range(min(int((size > WEAK * size[0]).sum()), len(group))):
            poles.append(centre)
            vectors.append(right[k])
    return np.array(poles), np.stack(vectors, axis=1)
