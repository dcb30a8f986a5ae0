r"""States of a part between its stages: a response for the material that is left where the tool stands.

A limit on the flank of a lobe follows a natural frequency some twenty times over, so the nearest stage is too far. The modes of
the stages on both sides, :math:`V`, stand for the part between them (Rayleigh-Ritz) with the stiffness and the mass of its own
state: :math:`V^T K V q = \omega^2 V^T M V q`. That errs by the square of the change between the stages, so the frequencies
are taken with what the residual :math:`(K - \omega^2 M) V q` moves the stage before by, as in a step of Davidson's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.cut_solid import CutSolid, CutState
from toolpoint.bodies.solid.element_places import ElementPlaces, locate
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.part_stages import (
    STAGE_MODE_COUNT,
    PartStage,
    StageCourse,
    largest_change,
    volume_before,
)
from toolpoint.vibration.sparse.factorisation import Factorisation

RESPONSE_CHANGE = 0.001  # relative change of a frequency from one state to the next
MAX_STATES = 600  # of a program
_MIN_RITZ_SHARE = 1e-9  # of the largest: directions in which two stages differ by less are one


@dataclass(frozen=True, eq=False)
class PartState:
    """Part when `piece` pieces of the path have been cut.

    frequency (m,), Hz, and damping_ratio (m,) of its modes; weights : (k, m) of these in the k modes of the stages `around`, of
    which the first has all its material; active : for each block of the mesh its elements with material.
    """

    piece: int
    frequency: FloatArray
    damping_ratio: FloatArray
    weights: FloatArray
    around: tuple[PartStage, ...]
    active: tuple[IndexArray, ...]

    @classmethod
    def of_stage(cls, stage: PartStage) -> PartState:
        """Return a stage as a state."""
        weights = np.eye(stage.frequency.size)
        return cls(stage.piece, stage.frequency, stage.damping_ratio, weights, (stage,), stage.state.active)

    def locate(self, cut: CutSolid, places: FloatArray) -> ElementPlaces:
        """Return where places (n, 3), m, are among the elements with material."""
        return locate([(block.kind, block.nodes[active], block.corners[active])
                       for block, active in zip(cut.blocks, self.active, strict=True)], places)

    def motion(self, located: ElementPlaces) -> FloatArray:
        """Return the motion (n, 3, m) of places in the modes."""
        return np.concatenate([located.motion(stage.shapes) for stage in self.around], axis=2) @ self.weights


def solve_between(cut: CutSolid, part: ClampedPart, piece: int, *, around: tuple[PartStage, PartStage],
                  inverse: Factorisation) -> PartState:
    """Return the part between two stages, by the modes of both; inverse : factors of the stiffness of the first."""
    state = cut.at(piece)
    basis = np.hstack([stage.shapes[state.free] for stage in around])
    squares, weights = _ritz(state, basis)
    number = min(STAGE_MODE_COUNT, squares.size)
    omega, weights = np.sqrt(squares[:number]), weights[:, :number]
    shapes = basis @ weights
    ratio = np.full(number, part.damping_ratio) if part.damping_ratio else \
        np.einsum("nm,nm->m", shapes, state.loss @ shapes) / (2 * omega**2)
    residual = np.zeros((cut.model.size, number))
    residual[state.free] = state.stiffness @ shapes - (state.mass @ shapes) * omega**2
    moved = np.zeros_like(residual)
    moved[around[0].state.free] = inverse.solve(residual[around[0].state.free])
    omega = np.sqrt(_ritz(state, np.hstack([shapes, moved[state.free]]))[0][:number])
    return PartState(piece, omega / (2 * np.pi), ratio, weights, around, state.active)


def _ritz(state: CutState, basis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the squares (m,) of the angular frequencies in a basis (free, k), and the modes' weights (k, m) in it."""
    length = np.sqrt(np.einsum("nk,nk->k", basis, state.mass @ basis))
    basis = basis / np.where(length > 0, length, 1.0)
    values, turn = np.linalg.eigh(basis.T @ (state.mass @ basis))
    kept = values > _MIN_RITZ_SHARE * values[-1]
    unit = turn[:, kept] / np.sqrt(values[kept])
    squares, vectors = np.linalg.eigh(unit.T @ (basis.T @ (state.stiffness @ basis)) @ unit)
    return squares, (unit @ vectors) / np.where(length > 0, length, 1.0)[:, None]


def choose_states(part: ClampedPart, course: StageCourse, pieces: IndexArray) -> tuple[list[PartState], float]:
    """Return the states at which the response is taken, in their order, and the largest change of a frequency between two.

    pieces : how many pieces of the path have been cut at every place of the tool. The states between two stages are halved by
    removed volume until each of the lowest frequencies changes by less than `RESPONSE_CHANGE`; there is one at least, as a
    frequency that rises and falls again may be alike in both stages.
    """
    asked_pieces, states = np.unique(pieces), [PartState.of_stage(course.stages[0])]
    for first, last in pairwise(course.stages):
        between = asked_pieces[(asked_pieces > first.piece) & (asked_pieces < last.piece)]
        numbers = np.concatenate([[first.piece], between, [last.piece]])
        solved = {0: PartState.of_stage(first), between.size + 1: PartState.of_stage(last)}
        waiting = [(0, between.size + 1)] if between.size else []
        inverse = first.solver() if waiting else None
        while waiting and inverse is not None:
            begin, end = waiting.pop(0)
            change = largest_change(solved[begin].frequency, solved[end].frequency)
            is_close = change <= RESPONSE_CHANGE and len(solved) > 2
            if is_close or end - begin < 2 or len(states) + len(solved) > MAX_STATES:
                continue
            middle = _middle(volume_before(course.cut, numbers[begin:end + 1])) + begin
            solved[middle] = solve_between(course.cut, part, int(numbers[middle]), around=(first, last), inverse=inverse)
            waiting += [(begin, middle), (middle, end)]
        states += [solved[k] for k in sorted(solved)[1:]]
    # Between two neighbours that differ more there is a place of the tool only where their number came to its end.
    needed = [largest_change(a.frequency, b.frequency) for a, b in pairwise(states)
              if ((asked_pieces > a.piece) & (asked_pieces < b.piece)).any()]
    return states, max(needed, default=0.0)


def _middle(volumes: FloatArray) -> int:
    """Return the number of the volume, of those between, nearest to the middle of the first and the last."""
    return 1 + int(np.abs(volumes[1:-1] - 0.5 * (volumes[0] + volumes[-1])).argmin())
