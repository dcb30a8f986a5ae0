r"""Choice of points to measure and to strike, by the shapes that a model expects.

Effective independence: points are taken away one by one, each time the one whose loss leaves the determinant of the Fisher
information :math:`Q = \sum_p \Phi_p^T \Phi_p` largest, :math:`\det(Q - \Phi_p^T \Phi_p) = \det(Q) \det(I - \Phi_p Q^{-1}
\Phi_p^T)` (Kammer, J. Guidance, Control, Dynamics 14 (1991) 251; three directions at once). Where to strike: the driving-point
residues :math:`\phi_r^2` (Ewins, Modal Testing, 2nd ed., section 5.3): of every choice the one in which the least visible mode
is seen best.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.correlation import mac

INFORMATION_RANK_TOLERANCE = 1e-9  # of the largest eigenvalue of the Fisher information


def choose_points(modes: Modes, number: int, keep: Sequence[str | int] = ()) -> list[str | int]:
    """Return the points (all directions of each) that keep the modes most independent, in the order of the labels.

    `keep` : points that stay (those that are struck, as a driving point gives shapes their scale).

    Raises ToolpointError where so few points cannot distinguish so many modes.
    """
    points = list(dict.fromkeys(dof.point for dof in modes.dofs))
    rows = {point: [k for k, dof in enumerate(modes.dofs) if dof.point == point] for point in points}
    shape = np.real(modes.shape) / np.linalg.norm(modes.shape, axis=0)
    if not max(1, len(keep)) <= number <= len(points):
        fail("points", str(number), f"must be {max(1, len(keep))} .. {len(points)}: those struck, and all that can be measured")
    if sum(len(rows[point]) for point in points) < modes.count or number * max(map(len, rows.values())) < modes.count:
        fail("points", f"{number} for {modes.count} modes", "must have as many directions as modes, or more",
             remedy=f"take {-(-modes.count // 3)} points at least, or fewer modes by `highest`")
    kept = list(points)
    while len(kept) > number:
        kept_rows = [row for point in kept for row in rows[point]]
        information = shape[kept_rows].T @ shape[kept_rows]
        inverse = np.linalg.pinv(information, rcond=INFORMATION_RANK_TOLERANCE)
        losses = [float(np.linalg.det(np.eye(len(rows[p])) - shape[rows[p]] @ inverse @ shape[rows[p]].T)) for p in kept]
        order = np.argsort(losses)[::-1].tolist()
        kept.pop(next(k for k in order if kept[k] not in keep))
    return kept


def choose_struck(modes: Modes, dofs: Sequence[Dof], number: int) -> list[Dof]:
    """Return the Dofs to strike that show the least visible mode best, one after the other."""
    size = np.abs(modes.shape_at(dofs)) / np.maximum(np.abs(modes.shape).max(axis=0), 1e-300)
    chosen: list[int] = []
    for _ in range(min(number, len(dofs))):
        best = np.array([np.maximum.reduce([size[k], *(size[j] for j in chosen)]) for k in range(len(dofs))])
        # The least visible mode first; among equals the one that moves all modes more.
        worth = best.min(axis=1) + 1e-3 * np.sqrt(best).mean(axis=1)
        worth[chosen] = -1.0
        chosen.append(int(np.argmax(worth)))
    return [dofs[k] for k in chosen]


def visibility(modes: Modes, struck: Sequence[Dof]) -> FloatArray:
    """Return the motion of the best struck Dof in every mode over its largest motion, 0 .. 1."""
    size = np.abs(modes.shape_at(struck)) / np.maximum(np.abs(modes.shape).max(axis=0), 1e-300)
    return np.asarray(size.max(axis=0))


def largest_likeness(modes: Modes, points: Sequence[str | int]) -> float:
    """Return the largest MAC between two different modes at points: near 1 they cannot be separated there."""
    chosen = set(points)
    rows = [k for k, dof in enumerate(modes.dofs) if dof.point in chosen]
    if modes.count < 2:
        return 0.0
    both = mac(modes.shape[rows])
    np.fill_diagonal(both, 0.0)
    return float(both.max())


def expand(modes: Modes, measured: Modes, dofs: Sequence[Dof]) -> FloatArray:
    """Return measured shapes at all Dofs of the model by its own shapes (SEREP; O'Callahan, Avitabile, Riemer, IMAC 7 (1989)).

    `modes` the model's, `measured` the measured ones with their labels `dofs`.
    """
    return np.asarray(modes.shape @ np.linalg.pinv(modes.shape_at(dofs)) @ measured.shape_at(dofs))
