r"""Receptances and their derivatives along parameters, :math:`H' = -L Z^{-1} Z' Z^{-1} B` from the low-rank factors of Z'."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.updating.models.shape_turns import EqualDamping, UndampedModes, Weighted
from toolpoint.vibration import SecondOrderSystem


def direct_response(
    lines: FloatArray, left: Array, right: Array, *, system: SecondOrderSystem, factors: Weighted, count: int
) -> tuple[ComplexArray, ComplexArray | None]:
    """Return receptances (n_f, n_outputs, n_inputs) at lines (Hz) and, with `count`, derivatives (count, ...) of them."""
    w = 2 * np.pi * np.asarray(lines)[:, None, None]
    z = system.stiffness - w**2 * system.mass + 0j
    if system.damping is not None:
        z += 1j * w * system.damping
    if system.structural_damping is not None:
        z += 1j * system.structural_damping
    # Symmetric matrices: one factorisation serves forces and (transposed) responses.
    both = np.linalg.solve(z, np.concatenate([right, left.T], axis=1) + 0j)
    forced, sensed = both[..., :right.shape[1]], both[..., right.shape[1]:]
    values = left @ forced
    if not count:
        return values, None
    result: ComplexArray = np.zeros((count, *values.shape), complex)
    flat = [np.moveaxis(part, 1, 0).reshape(part.shape[1], -1) for part in (sensed, forced)]
    scale: dict[str, complex | Array] = {"stiffness": 1.0, "damping": 1j * w, "structural_damping": 1j, "mass": -w**2}
    for term, (factor, weights) in factors.items():
        # (used, rank, lines, outputs) and (used, rank, lines, inputs): the products of small matrices are summed over the rank.
        a, b = (factor.seen(part).reshape(*weights.shape, len(w), -1) for part in flat)
        product = (a * weights[:, :, None, None]).transpose(0, 2, 3, 1) @ b.transpose(0, 2, 1, 3)
        result[factor.used] -= product * scale[term]
    return values, result


def modal_response(
    lines: FloatArray, left: Array, right: Array, *, modal: UndampedModes, equal_damping: EqualDamping
) -> tuple[ComplexArray, ComplexArray | None]:
    """Return the same by superposition of all modes with one damping ratio."""
    a, b = left @ modal.vectors, modal.vectors.T @ right
    w, omega, ratio = 2 * np.pi * np.asarray(lines)[:, None], modal.omega, equal_damping.ratio
    g = 1 / (omega**2 - w**2 + 2j * ratio * omega * w)
    # A product of two matrices each: outputs by modes, modes by lines and inputs.
    values = _over_lines(a, g.T[:, :, None] * b[:, None, :])
    if not modal.count:
        return values, None
    da, db = np.tensordot(a, modal.turns, 1).transpose(2, 0, 1), np.tensordot(modal.turns, b, (0, 0)).transpose(1, 0, 2)
    dg = -(g**2) * ((1 + 1j * ratio * w / omega) * modal.square_slopes.T[:, None, :]
                    + 2j * omega * w * equal_damping.slopes[:, None, None])
    modal_part = g.T[None, :, :, None] * db[:, :, None, :] + dg.transpose(0, 2, 1)[..., None] * b[None, :, None, :]
    changes = np.empty((modal.count, *values.shape), complex)
    for k in range(modal.count):
        changes[k] = _over_lines(da[k], g.T[:, :, None] * b[:, None, :]) + _over_lines(a, modal_part[k])
    return values, changes


def _over_lines(left_part: FloatArray, modal_part: ComplexArray) -> ComplexArray:
    """Return the product (n_f, n_outputs, n_inputs) of real (n_outputs, r) and complex (r, n_f, n_inputs)."""
    flat = np.ascontiguousarray(modal_part).reshape(len(modal_part), -1)
    # Real numbers side by side: half the work of a complex product.
    product = (left_part @ flat.view(float)).view(complex)
    return product.reshape(len(left_part), *modal_part.shape[1:]).transpose(1, 0, 2)
