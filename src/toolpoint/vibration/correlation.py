r"""Correlation of mode shapes and responses: MAC, COMAC, ECOMAC, MSF, FRAC and pairing; real or complex, always a matrix.

Sources: Allemang, Brown, IMAC 1982 (MAC, MSF); Lieven, Ewins, IMAC 1988 (COMAC); Hunt, IMAC 1992 (ECOMAC);
Heylen, Lammens, 1996 (FRAC).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import Array, BoolArray, FloatArray, IndexArray, fail, real_or_complex
from toolpoint._notebook import NotebookText
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

PAIRING_FREQUENCY_WEIGHT = 0.2  # MAC that a factor e of frequency weighs in a pairing
ALIKENESS_WEIGHT = 2.0  # MAC that a factor e of frequency weighs more where all shapes of a set are alike
MAX_LOG_DISTANCE = 2.0  # of frequencies: farther apart weighs no more
MAX_ROUNDING = 1e-13  # of the largest response of a set, below which a response is the rounding of a computation


def mac(first: Array, second: Array | None = None) -> FloatArray:
    r"""Return the modal assurance criterion (MAC) of every pair of shapes, shape (..., n_first, n_second).

    :math:`|\phi_i^H \psi_j|^2 / (\phi_i^H \phi_i\ \psi_j^H \psi_j)`. `first`, `second`: shapes (..., n_dofs, n_modes); the
    AutoMAC of `first` where `second` is left out. Raises ToolpointError for different Dofs, or a shape that is zero everywhere.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.vibration.correlation import mac
    >>> mac(np.array([[1.0, 1.0], [1.0, -1.0]])).round(12).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    a, b = _shapes(first, first if second is None else second)
    norm = _power(a)[..., :, None] * _power(b)[..., None, :]
    return np.abs(np.swapaxes(a.conj(), -1, -2) @ b) ** 2 / norm


def auto_mac(shapes: Array) -> FloatArray:
    """Return the MAC of a set of shapes with itself, shape (..., n, n)."""
    return mac(shapes)


def modal_scale_factor(first: Array, second: Array) -> Array:
    r"""Return the modal scale factors :math:`\phi_i^H \psi_j / \phi_i^H \phi_i`, the best on `first`, (n_first, n_second)."""
    a, b = _shapes(first, second)
    return np.swapaxes(a.conj(), -1, -2) @ b / _power(a)[..., :, None]


def comac(first: Array, second: Array) -> FloatArray:
    r"""Return the coordinate MAC of paired shapes, shape (n_dofs,): 1 where all pairs agree.

    :math:`(\sum_r |\phi_{kr} \psi_{kr}^*|)^2 / (\sum_r |\phi_{kr}|^2 \sum_r |\psi_{kr}|^2)`; 1 also for a Dof at rest in all
    shapes of both sets.
    """
    a, b = _paired(first, second)
    numerator = np.abs(a * b.conj()).sum(axis=-1) ** 2
    denominator = (np.abs(a) ** 2).sum(axis=-1) * (np.abs(b) ** 2).sum(axis=-1)
    return np.where(denominator > 0, numerator / np.where(denominator > 0, denominator, 1.0),
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
    r"""Return the MAC of paired shapes without a group of Dofs, shape (n_groups, n_pairs).

    The MAC without a group less the MAC of all Dofs is the influence of the group: a point that was measured wrongly, or where
    the model is wrong, stands out. NaN where no other Dof moves.

    Parameters
    ----------
    first, second : (n_dofs, n_modes)
        Paired one to one.
    groups : sequences of rows
        For example the directions of every point.
    """
    a, b = _paired(first, second)
    cross, power_first, power_second = (a.conj() * b), np.abs(a) ** 2, np.abs(b) ** 2
    result = np.full((len(groups), a.shape[-1]), np.nan)
    for group, rows in enumerate(groups):
        indices = list(rows)
        numerator = np.abs(cross.sum(axis=-2) - cross[indices].sum(axis=-2)) ** 2
        remaining_first, remaining_second = (p.sum(axis=-2) - p[indices].sum(axis=-2) for p in (power_first, power_second))
        is_moving = (remaining_first > 1e-12 * power_first.sum(axis=-2)) & (remaining_second > 1e-12
                                                                            * power_second.sum(axis=-2))
        result[group, is_moving] = numerator[is_moving] / (remaining_first * remaining_second)[is_moving]
    return result


def combine_shapes(first: Array, second: Array, candidates: BoolArray) -> tuple[Array, FloatArray]:
    r"""Return the combination of shapes nearest to each shape of another set: its factors and the MAC with it.

    Each :math:`\phi_i` is fitted by :math:`\sum_j q_{ij} \psi_j` over the candidates (least squares, each of unit length).
    Modes of nearly equal frequency mix freely, in a test as in a model: the MAC with each alone is then low, and with the
    combination near 1. Where the combination is no better, the shape itself differs.

    Parameters
    ----------
    first, second : (n_dofs, n_first), (n_dofs, n_second)
    candidates : (n_first, n_second) bool
        Which shapes of the second set may be combined.

    Returns
    -------
    factors : (n_first, n_second) floats or complex
        Zero for what is no candidate.
    mac : (n_first,) floats
        MAC with the combination; 0 without candidates.
    """
    a, b = _shapes(first, second)
    a, b = (shapes / np.sqrt(_power(shapes)) for shapes in (a, b))
    factors = np.zeros((a.shape[-1], b.shape[-1]), np.result_type(a, b))
    explained = np.zeros(a.shape[-1])
    for mode in range(a.shape[-1]):
        columns = np.flatnonzero(candidates[mode])
        if columns.size:
            fitted = np.linalg.lstsq(b[:, columns], a[:, mode], rcond=1e-9)[0]
            factors[mode, columns] = fitted
            explained[mode] = float(np.linalg.norm(b[:, columns] @ fitted)) ** 2
    return factors, np.minimum(explained, 1.0)


def frac(first: Frf, second: Frf) -> FloatArray:
    r"""Return the frequency response assurance criterion of every output-input pair, shape (..., n_outputs, n_inputs).

    :math:`|\sum_f a_f^* b_f|^2 / (\sum |a|^2 \sum |b|^2)` over equal frequency lines; 0 where one of both is zero at all
    lines, 1 where both are. Zero is what lies below the rounding of the largest response of its set: planes that do not couple.
    """
    if first.frequency.shape != second.frequency.shape or not np.allclose(first.frequency, second.frequency, rtol=1e-9):
        fail("frac", f"{first!r} and {second!r}", "must have equal frequency lines", remedy="use frf.interpolated")
    if first.quantity != second.quantity or first.values.shape[-2:] != second.values.shape[-2:]:
        fail("frac", f"{first!r} and {second!r}", "must have the same quantity, outputs and inputs")
    a, b = first.values, second.values
    a, b = (values / np.where((scale := np.abs(values).max(axis=-3, keepdims=True)) > 0, scale, 1.0) for values in (a, b))
    cross = np.abs((a.conj() * b).sum(axis=-3)) ** 2
    powers = [(np.abs(values) ** 2).sum(axis=-3) for values in (a, b)]
    largest = [np.abs(frf.values).max(axis=(-3, -2, -1), keepdims=True)[..., 0, :, :] for frf in (first, second)]
    for power, frf, level in zip(powers, (first, second), largest, strict=True):
        power[np.abs(frf.values).max(axis=-3) <= MAX_ROUNDING * level] = 0.0
    product = powers[0] * powers[1]
    if_zero = np.where((powers[0] == 0) & (powers[1] == 0), 1.0, 0.0)
    return np.asarray(np.where(product > 0, cross / np.where(product > 0, product, 1.0), if_zero))


@dataclass(frozen=True)
class Pairing(NotebookText):
    """One-to-one pairing of two sets of modes: `pairs` (n, 2) indices, the MAC of each, and the modes left single."""

    pairs: np.ndarray
    values: FloatArray
    single_first: tuple[int, ...]
    single_second: tuple[int, ...]

    def __repr__(self) -> str:
        return (f"Pairing({len(self.pairs)} pairs, lowest MAC {self.values.min(initial=1.0):.4f}, "
                f"{len(self.single_first)} + {len(self.single_second)} single)")


def pair_modes(first: Modes, second: Modes, lowest_mac: float = 0.5, *, frequency_shift: float = np.inf) -> Pairing:
    """Return the one-to-one pairing with the largest sum of MAC values, less what frequencies lie apart (`assign_modes`).

    Shapes decide where they differ; the more alike few points make the shapes of one set, the more the frequencies do.

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
    # What a pair loses by its frequencies never makes it worse than no pair.
    weight = PAIRING_FREQUENCY_WEIGHT + ALIKENESS_WEIGHT * max(_alikeness(each.shape_at(common)) for each in (first, second))
    score = matrix + weight * (MAX_LOG_DISTANCE - _log_distance(first, second))
    rows, columns = scipy.optimize.linear_sum_assignment(np.where(allowed, score, 0.0), maximize=True)
    is_pair = allowed[rows, columns]
    pairs = np.stack([rows[is_pair], columns[is_pair]], axis=1)
    return Pairing(pairs, matrix[rows[is_pair], columns[is_pair]],
                   tuple(sorted(set(range(first.count)) - set(pairs[:, 0].tolist()))),
                   tuple(sorted(set(range(second.count)) - set(pairs[:, 1].tolist()))))


def assign_modes(first: Modes, second: Modes, frequency_weight: float = PAIRING_FREQUENCY_WEIGHT
                 ) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Return indices of pairs in both sets and their MAC, (n,) each: every mode of the smaller set has a partner.

    Shapes decide; frequencies decide between shapes that are nearly alike: a factor e of frequency weighs as much as
    `frequency_weight` of a MAC, and no more than two of them. Rows of both sets are the same Dofs.
    """
    values = mac(first.shape, second.shape)
    rows, columns = scipy.optimize.linear_sum_assignment(frequency_weight * _log_distance(first, second) - values)
    return rows, columns, values[rows, columns]


def _alikeness(shapes: Array) -> float:
    """Return the mean MAC of different shapes of one set: about one over the Dofs for shapes that have nothing in common."""
    count = shapes.shape[-1]
    return float((auto_mac(shapes).sum() - count) / (count * (count - 1))) if count > 1 else 0.0


def _log_distance(first: Modes, second: Modes) -> FloatArray:
    """Return how far frequencies lie apart, |ln f1/f2|, MAX_LOG_DISTANCE at most, (n_first, n_second)."""
    ratio = np.outer(first.frequency, 1 / np.maximum(second.frequency, 1e-9))
    return np.minimum(np.abs(np.log(np.maximum(ratio, 1e-300))), MAX_LOG_DISTANCE)


def _shapes(first: Array, second: Array) -> tuple[Array, Array]:
    """Return two sets of shapes after checking that they have the same Dofs and that every shape moves."""
    a, b = real_or_complex("first", first, (None, None)), real_or_complex("second", second, (None, None))
    if a.shape[-2] != b.shape[-2]:
        fail("shapes", f"{a.shape[-2]} and {b.shape[-2]} Dofs", "must be the same Dofs in the same order")
    for name, shapes in (("first", a), ("second", b)):
        if (_power(shapes) == 0).any():
            fail(name, f"mode {int(np.argwhere(_power(shapes) == 0)[0, -1])} is zero at all Dofs", "must move somewhere")
    return a, b


def _paired(first: Array, second: Array) -> tuple[Array, Array]:
    """Return two sets of shapes after checking that they have equally many modes."""
    a, b = _shapes(first, second)
    if a.shape[-1] != b.shape[-1]:
        fail("shapes", f"{a.shape[-1]} and {b.shape[-1]} modes", "must be paired one to one", remedy="use `pair_modes` first")
    return a, b


def _power(shapes: Array) -> FloatArray:
    """Return phi^H phi of every mode."""
    return (np.abs(shapes) ** 2).sum(axis=-2)
