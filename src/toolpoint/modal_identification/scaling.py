r"""Shapes from residues: rank-one factors, mass normalisation by driving points.

A residue matrix of one mode is :math:`R = \phi \psi^T`; a driving point (output and input at one point along one axis)
gives :math:`\phi_d = \pm \psi_d`, which fixes the scale. Several driving points are used in the least-squares sense.
Source: Ewins, Modal Testing, 2nd ed., section 4; Heylen, Lammens, Sas, Modal Analysis Theory and Testing, section A.3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import Array
from toolpoint.vibration.driving_point import DrivingPoint


def factor_rank_one(residue: Array) -> tuple[Array, Array, float]:
    """Return the best rank-one factors of (n_outputs, n_inputs) residues and the share that rank one leaves out.

    The share is sqrt(sum of the other singular values squared / sum of all squared), 0 for an exact rank one.
    """
    left, values, right = np.linalg.svd(residue, full_matrices=False)
    total = float((values**2).sum())
    share = float(np.sqrt((values[1:] ** 2).sum() / total)) if total > 0 else 0.0
    root = np.sqrt(values[0])
    return left[:, 0] * root, right[0] * root, share


def scale_shapes(shape: Array, participation: Array, points: Sequence[DrivingPoint]) -> tuple[Array, Array, bool]:
    r"""Return (shape, participation, whether it is scaled) with :math:`\phi_d = sign\ \psi_d` at the driving points.

    With :math:`\phi = g\,a` and :math:`\psi = b / g`, g minimises :math:`\sum_d |g^2 a_d - sign\, b_d|^2`, so
    :math:`g^2 = \sum a_d^* b_d\, sign / \sum |a_d|^2`. Real shapes need a positive :math:`g^2`: a negative one means
    that a driving point has the wrong sign; then, and without a driving point that moves, nothing is scaled.
    """
    a = np.array([shape[point.row] for point in points])
    b = np.array([point.sign * participation[point.column] for point in points])
    power = float((np.abs(a) ** 2).sum()) if a.size else 0.0
    is_moving = a.size > 0 and power > 1e-12 * float((np.abs(shape) ** 2).mean())
    square = (a.conj() * b).sum() / power if is_moving else 0.0
    if np.iscomplexobj(shape):
        usable = bool(is_moving and abs(square) > 0)
        factor = np.sqrt(square + 0j) if usable else 1.0
    else:
        usable = bool(is_moving and square > 0)
        factor = np.sqrt(square) if usable else 1.0
    return shape * factor, participation / factor, usable
