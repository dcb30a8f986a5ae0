r"""Correlation of mode shapes and responses: MAC, COMAC, ECOMAC, MSF, FRAC and pairing; real or complex, always a matrix.

Sources: Allemang, Brown, IMAC 1982 (MAC, MSF); Lieven, Ewins, IMAC 1988 (COMAC); Hunt, IMAC 1992 (ECOMAC);
Heylen, Lammens, 1996 (FRAC).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import Array, BoolArray, FloatArray, fail, real_or_complex
from toolpoint._notebook import NotebookText
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes


def mac(first: Array, second: Array | None = None) -> FloatArray:
    r"""Return :math:`|\phi_i^H \psi_j|^2 / (\phi_i^H \phi_i\ \psi_j^H \psi_j)`, shape (..., n_first, n_second).

    `first`, `second`: shapes (..., n_dofs, n_modes); the AutoMAC of `first` where `second` is left out.
    """
    a, b = _shapes(first, first if second is None else second)
    norm = _power(a)[..., :, None] * _power(b)[..., None, :]
    return np.abs(np.swapaxes(a.conj(), -1, -2) @ b) ** 2 / norm


def auto_mac(shapes: Array) -> FloatArray:
    """Return the MAC of a set of shapes with itself, shape (..., n, n)."""
    return mac(shapes)


def modal_scale_factor(first: Array, second: Array) -> Array:
    r"""Return :math:`\phi_i^H \psi_j / \phi_i^H \phi_i`: the factor on `first` that fits `second` best, (n_first, n_second)."""
    a, b = _shapes(first, second)
    return np.swapaxes(a.conj(), -1, -2) @ b / _power(a)[..., :, None]


def comac(first: Array, second: Array) -> FloatArray:
    r"""Return the coordinate MAC of paired shapes, shape (n_dofs,): 1 where all pairs agree.

    :math:`(\sum_r |\phi_{kr} \psi_{kr}^*|)^2 / (\sum_r |\phi_{kr}|^2 \sum_r |\psi_{kr}|^2)`; a Dof that stands still in
    all shapes of both sets agrees: 1.
    """
    a, b = _paired(first, second)
    top = np.abs(a * b.conj()).sum(axis=-1) ** 2
    bottom = (np.abs(a) ** 2).sum(axis=-1) * (np.abs(b) ** 2).sum(axis=-1)
    return np.where(bottom > 0, top / np.where(bottom > 0, bottom, 1.0),
                    np.where(np.abs(a).sum(axis=-1) + np.abs(b).sum(axis=-1) == 0, 1.0, 0.0))


def ecomac(first: Array, second: Array) -> FloatArray:
    r"""Return the enhanced COMAC of paired shapes, shape (n_dofs,): 0 where they agree, up to 1.

    :math:`\sum_r |\hat\phi_{kr} - \hat\psi_{kr}| / 2 L` with shapes scaled to a largest entry of one, the second set by
    its modal scale factor, so sign, phase and size do not matter.
    """
    a, b = _paired(first, second)
    a = a / np.abs(a).max(axis=-2, keepdims=True)
    factor = (b.conj() * a).sum(axis=-2, keepdims=True) / (np.abs(b) ** 2).sum(axis=-2, keepdims=True)
    return np.abs(a - b * factor).sum(axis=-1) / (2 * a.shape[-1])


def mac_without(first: Array, second: Array, groups: Sequence[Sequence[int]]) -> FloatArray:
    r"""Return the MAC of paired shapes seen without a group of Dofs, shape (n_groups, n_pairs).

    What a group costs (or lends) a pair is the MAC without it less the MAC of all: a point at which a shape was measured
    wrongly, or the model is wrong, stands out. Not a number where nothing moves without the group.

    Parameters
    ----------
    first, second : (n_dofs, n_modes)
        Paired one to one.
    groups : sequences of rows
        For example the directions of every point.
    """
    a, b = _paired(first, second)
    cross, power, other = (a.conj() * b), np.abs(a) ** 2, np.abs(b) ** 2
    result = np.full((len(groups), a.shape[-1]), np.nan)
    for k, rows in enumerate(groups):
        at = list(rows)
        top = np.abs(cross.sum(axis=-2) - cross[at].sum(axis=-2)) ** 2
        left, right = (p.sum(axis=-2) - p[at].sum(axis=-2) for p in (power, other))
        moves = (left > 1e-12 * power.sum(axis=-2)) & (right > 1e-12 * other.sum(axis=-2))
        result[k, moves] = top[moves] / (left * right)[moves]
    return result


def combine_shapes(first: Array, second: Array, near: BoolArray) -> tuple[Array, FloatArray]:
    r"""Return the mix of shapes that is nearest to each other shape: factors and the MAC with that mix.

    Each :math:`\phi_i` is fitted by :math:`\sum_j q_{ij} \psi_j` over the shapes that are `near` (least squares, each of unit
    length). Two modes that lie close mix freely, in a test or in a model: then MAC with each alone is low and with the mix
    near 1; where the mix is no better, the shape itself is another.

    Parameters
    ----------
    first, second : (n_dofs, n_first), (n_dofs, n_second)
    near : (n_first, n_second) bool
        Which of the second set may take part.

    Returns
    -------
    factors : (n_first, n_second), zero where not near; mac : (n_first,), 0 where none is near.
    """
    a, b = _shapes(first, second)
    a, b = (shapes / np.sqrt(_power(shapes)) for shapes in (a, b))
    factors = np.zeros((a.shape[-1], b.shape[-1]), np.result_type(a, b))
    share = np.zeros(a.shape[-1])
    for i in range(a.shape[-1]):
        at = np.flatnonzero(near[i])
        if at.size:
            q = np.linalg.lstsq(b[:, at], a[:, i], rcond=1e-9)[0]
            factors[i, at] = q
            share[i] = float(np.linalg.norm(b[:, at] @ q)) ** 2
    return factors, np.minimum(share, 1.0)


def frac(first: Frf, second: Frf) -> FloatArray:
    r"""Return the frequency response assurance criterion of every output-input pair, shape (..., n_outputs, n_inputs).

    :math:`|\sum_f a_f^* b_f|^2 / (\sum |a|^2 \sum |b|^2)` over equal frequency lines; 0 where one of both is zero at all
    lines, 1 where both are.
    """
    if first.frequency.shape != second.frequency.shape or not np.allclose(first.frequency, second.frequency, rtol=1e-9):
        fail("frac", f"{first!r} and {second!r}", "must have equal frequency lines", remedy="use frf.interpolated")
    if first.quantity != second.quantity or first.values.shape[-2:] != second.values.shape[-2:]:
        fail("frac", f"{first!r} and {second!r}", "must have the same quantity, outputs and inputs")
    a, b = first.values, second.values
    a, b = (values / np.where((top := np.abs(values).max(axis=-3, keepdims=True)) > 0, top, 1.0) for values in (a, b))
    cross = np.abs((a.conj() * b).sum(axis=-3)) ** 2
    powers = [(np.abs(values) ** 2).sum(axis=-3) for values in (a, b)]
    product = powers[0] * powers[1]
    silent = np.where((powers[0] == 0) & (powers[1] == 0), 1.0, 0.0)
    return np.asarray(np.where(product > 0, cross / np.where(product > 0, product, 1.0), silent))


@dataclass(frozen=True)
class Pairing(NotebookText):
    """Modes of two sets that belong together: `pairs` (n, 2) indices, the MAC of each, and the modes left single."""

    pairs: np.ndarray
    values: FloatArray
    single_first: tuple[int, ...]
    single_second: tuple[int, ...]

    def __repr__(self) -> str:
        return (f"Pairing({len(self.pairs)} pairs, lowest MAC {self.values.min(initial=1.0):.4f}, "
                f"{len(self.single_first)} + {len(self.single_second)} single)")


def pair_modes(first: Modes, second: Modes, lowest_mac: float = 0.5, *, frequency_shift: float = np.inf) -> Pairing:
    """Return the one-to-one pairing with the largest sum of MAC values.

    Parameters
    ----------
    first, second : Modes
        One pose each, with the same Dofs (any order; common ones are used).
    lowest_mac : float
        Pairs below are left single.
    frequency_shift : float
        Largest relative difference of frequency within a pair.
    """
    common = [dof for dof in first.dofs if dof in second.dofs]
    if not common:
        fail("pair_modes", "no common Dof", "both sets must share points and directions")
    matrix = mac(first.shape_at(common), second.shape_at(common))
    shift = np.abs(first.frequency[:, None] - second.frequency) / np.maximum(first.frequency[:, None], 1e-12)
    allowed = (matrix >= lowest_mac) & (shift <= frequency_shift)
    rows, columns = scipy.optimize.linear_sum_assignment(np.where(allowed, matrix, 0.0), maximize=True)
    keep = allowed[rows, columns]
    pairs = np.stack([rows[keep], columns[keep]], axis=1)
    return Pairing(pairs, matrix[rows[keep], columns[keep]],
                   tuple(sorted(set(range(first.count)) - set(pairs[:, 0].tolist()))),
                   tuple(sorted(set(range(second.count)) - set(pairs[:, 1].tolist()))))


def _shapes(first: Array, second: Array) -> tuple[Array, Array]:
    a, b = real_or_complex("first", first, (None, None)), real_or_complex("second", second, (None, None))
    if a.shape[-2] != b.shape[-2]:
        fail("shapes", f"{a.shape[-2]} and {b.shape[-2]} Dofs", "must be the same Dofs in the same order")
    for name, shapes in (("first", a), ("second", b)):
        if (_power(shapes) == 0).any():
            fail(name, f"mode {int(np.argwhere(_power(shapes) == 0)[0, -1])} is zero at all Dofs", "must move somewhere")
    return a, b


def _paired(first: Array, second: Array) -> tuple[Array, Array]:
    a, b = _shapes(first, second)
    if a.shape[-1] != b.shape[-1]:
        fail("shapes", f"{a.shape[-1]} and {b.shape[-1]} modes", "must be paired one to one", remedy="use `pair_modes` first")
    return a, b


def _power(shapes: Array) -> FloatArray:
    return (np.abs(shapes) ** 2).sum(axis=-2)
