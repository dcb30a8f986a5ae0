"""Twins: poles that share one mode, distinguished from repeated roots by the rank of their joint residue."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray
from toolpoint.modal_identification.fit.refinement import PoleFit

MAX_TWIN_DISTANCE = 0.3  # half widths
MIN_RANK_RATIO = 0.1  # of the largest singular value of the joint residue: above, it is a mode


def merge_twins(fit: PoleFit) -> tuple[ComplexArray, ComplexArray]:
    """Return poles and participation with every group of nearly equal poles reduced to the rank of its residue.

    Poles within 0.3 half widths form a group. The singular values of the sum of their residues say how many modes there
    are (those above a tenth of the largest); their right singular vectors are the participations.
    """
    remaining = list(np.argsort(np.abs(fit.poles), kind="stable"))
    poles, vectors = [], []
    while remaining:
        group = [remaining.pop(0)]
        for i in list(remaining):
            if any(abs(fit.poles[i] - fit.poles[j]) < MAX_TWIN_DISTANCE * abs(fit.poles[j].real) for j in group):
                group.append(i)
                remaining.remove(i)
        if len(group) == 1:
            poles.append(fit.poles[group[0]])
            vectors.append(fit.participation[:, group[0]])
            continue
        residue = fit.shape[:, group] @ fit.participation[:, group].T
        size, right = np.linalg.svd(residue, full_matrices=False)[1:]
        weights = np.linalg.norm(fit.shape[:, group], axis=0) * np.linalg.norm(fit.participation[:, group], axis=0)
        centre = complex((fit.poles[group] * weights).sum() / weights.sum())
        for k in range(min(int((size > MIN_RANK_RATIO * size[0]).sum()), len(group))):
            poles.append(centre)
            vectors.append(right[k])
    return np.array(poles), np.stack(vectors, axis=1)
