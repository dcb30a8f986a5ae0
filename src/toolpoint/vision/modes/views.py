r"""Two videos of orthogonal planes joined to spatial shapes.

The blows differ and no force is known, so each video has its own complex scale. A mode seen in both is joined by what both
see: their common direction at common points, :math:`\phi_2 \to c\,\phi_2` with :math:`c = \phi_2^H \phi_1 / \phi_2^H \phi_2`
over those Dofs. Where that motion does not stand out of its noise, the two halves of a shape have no common scale and stay
apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.vibration import Dof, Modes

MIN_COMMON_MOTION_RATIO = 5.0  # motion in the common direction over its noise


@dataclass(frozen=True, eq=False)
class JoinedViews:
    """Spatial shapes of the modes that both videos show.

    modes : Modes with the Dofs of both; pairs : (n, 2) indices in the first and the second; scale_deviation : (n,) relative
    standard deviation of the common scale; notes : modes that were not joined, and why.
    """

    modes: Modes
    pairs: tuple[tuple[int, int], ...]
    scale_deviation: FloatArray
    notes: tuple[str, ...]


def join_views(first: Modes, second: Modes, *, frequency_shift: float = 0.01) -> JoinedViews:
    """Return the modes of two orthogonal videos (both in metres or both in pixels) as spatial shapes.

    Parameters
    ----------
    first, second : Modes
        With common points and one common direction, e.g. ``VideoStudy.modes_at`` of both.
    frequency_shift : float
        Largest relative difference of frequency within a pair.

    Raises
    ------
    ToolpointError
        Without a common Dof, or where no mode can be joined.

    >>> front = Modes([80.0], [0.02], [[1.0], [0.5]], ["1:+x", "1:-z"], scaling="unscaled")
    >>> side = Modes([80.0], [0.02], [[0.25], [0.5]], ["1:+y", "1:-z"], scaling="unscaled")
    >>> [str(dof) for dof in join_views(front, side).modes.dofs]
    ['1:+x', '1:-z', '1:+y']
    """
    common = [dof for dof in first.dofs if dof in second.dofs]
    if not common:
        fail("join_views", "no common point and direction", "must be one at least",
             remedy="both planes show z: name points that both see")
    added_dofs = [dof for dof in second.dofs if dof not in first.dofs]
    kept, pairs, deviations, notes = [], [], [], []
    for i in range(first.count):
        j = int(np.argmin(np.abs(second.frequency - first.frequency[i])))
        if abs(second.frequency[j] / first.frequency[i] - 1) > frequency_shift:
            notes.append(f"{first.frequency[i]:.4g} Hz: seen in the first video only")
            continue
        a, b = first.shape_at(common)[:, i], second.shape_at(common)[:, j]
        power = float((np.abs(b) ** 2).sum())
        noise = _noise(first, common, i) / max(float((np.abs(a) ** 2).sum()), 1e-300) + _noise(second, common, j) / max(power,
                                                                                                                        1e-300)
        if power == 0 or noise > 1 / MIN_COMMON_MOTION_RATIO**2:
            notes.append(f"{first.frequency[i]:.4g} Hz: the common direction does not move enough for a common scale; the "
                         "two halves stay apart")
            continue
        scale = (b.conj() @ a) / power
        kept.append(np.concatenate([first.shape[:, i], scale * second.shape_at(added_dofs)[:, j]]))
        pairs.append((i, j))
        deviations.append(float(np.sqrt(noise)))
    if not kept:
        fail("join_views", "; ".join(notes) or "no modes", "must have a mode that both videos show in their common direction",
             remedy="use the videos apart: each plane updates its own parameters")
    joined_modes = [i for i, _ in pairs]
    modes = Modes(first.frequency[joined_modes], first.damping_ratio[joined_modes], np.stack(kept, axis=1),
                  (*first.dofs, *added_dofs), "unscaled",
                  covariance=None if first.covariance is None else first.covariance[joined_modes])
    return JoinedViews(modes, tuple(pairs), np.array(deviations), tuple(notes))


def _noise(modes: Modes, common: Sequence[Dof], mode: int) -> float:
    if modes.shape_variance is None:
        return 0.0
    rows = [modes.dofs.index(dof) for dof in common]
    return float(modes.shape_variance[rows, mode].sum()) / len(rows)
