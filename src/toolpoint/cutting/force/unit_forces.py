"""Forces on a rigid tool per unit of each cutting coefficient: the linear model of a calibration."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.cut.total_energy import effective_chip
from toolpoint.cutting.force.laws import edge_field

NAMES = ("kt", "kn", "ka", "edge_t", "edge_n", "edge_a")


def names_of(directions: int) -> tuple[str, ...]:
    """Return the names of the coefficients that forces in so many directions tell: the axial ones need z."""
    return NAMES if directions == 3 else ("kt", "kn", "edge_t", "edge_n")


def forces_per_coefficient(problem: MillingProblem, depth: float, turn: FloatArray, *, directions: int,
                           slices: int, exponent: float = 0.0) -> FloatArray:
    """Return forces per unit of each coefficient at the run-out of the problem, shape (n_angle * n_directions, n_names).

    turn : (n_angle,) rotation of tooth 0, rad; names are those of `NAMES`, without the axial ones for two directions.
    exponent : m of a total-energy law; the first coefficients then stand before h (h/1 mm)^-m.
    """
    phi, h, kappa, _, share = edge_field(problem, depth, turn, slices=slices)
    s, c, sk, ck = np.sin(phi), np.cos(phi), np.sin(kappa)[:, None], np.cos(kappa)[:, None]
    chip, edge = effective_chip(np.maximum(h, 0.0), exponent) * share, (h > 0) * share
    zero = np.zeros(turn.size)

    def over(field: FloatArray) -> FloatArray:
        return field.sum((1, 2))

    columns = []
    for g in (chip, edge):
        columns += [np.stack([-over(g * c), over(g * s), zero]),
                    np.stack([-over(g * s * sk), -over(g * c * sk), over(g * ck)]),
                    np.stack([over(g * s * ck), over(g * c * ck), over(g * sk)])]
    stacked = np.stack(columns)[:, :directions]  # (name, direction, angle)
    keep = stacked if directions == 3 else stacked[[0, 1, 3, 4]]
    return keep.transpose(2, 1, 0).reshape(-1, keep.shape[0])
