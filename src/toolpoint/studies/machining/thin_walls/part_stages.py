"""Stages of a part while its material goes: chosen so that its natural frequencies change little from one to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint.bodies.solid.cut_solid import CutSolid, CutState
from toolpoint.bodies.solid.element_places import ElementPlaces, locate
from toolpoint.studies.machining.mesh_share import MeshError
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.vibration.sparse import factorise, modes
from toolpoint.vibration.sparse.factorisation import Factorisation

STAGE_MODE_COUNT = 12  # of every stage; what lies above answers at once
JUDGED_MODES = 4  # the lowest, whose frequencies choose the stages
MAX_STAGES = 48  # of a program
_MESH_ORDER = 2  # least order at which frequencies converge with the mesh: the estimate is no bound


@dataclass(frozen=True, eq=False)
class PartStage:
    """Part when `piece` pieces of the path have been cut: frequency (m,), Hz, damping ratio (m,), shapes (coordinates, m) of
    unit modal mass, zero where held or cut away."""

    piece: int
    state: CutState
    frequency: FloatArray
    damping_ratio: FloatArray
    shapes: FloatArray

    def solver(self) -> Factorisation:
        """Return the factors of its stiffness."""
        return factorise(self.state.stiffness, coordinates=self.state.coordinates)

    def locate(self, cut: CutSolid, places: FloatArray) -> ElementPlaces:
        """Return where places (n, 3), m, are among the elements with material."""
        return locate([(block.kind, block.nodes[active], block.corners[active])
                       for block, active in zip(cut.blocks, self.state.active, strict=True)], places)


def solve_stage(cut: CutSolid, part: ClampedPart, piece: int) -> PartStage:
    """Return the modes of the part when so many pieces have been cut."""
    state = cut.at(piece)
    inverse = factorise(state.stiffness, coordinates=state.coordinates)
    number = min(STAGE_MODE_COUNT, max(state.free.size // 3 - 1, 1))
    pairs = modes(state.stiffness, state.mass, number, shift=0, inverse=inverse, is_counted=False,
                  coordinates=state.coordinates)
    vectors, omega = pairs.vectors[:, :number], 2 * np.pi * pairs.frequency[:number]
    loss = np.einsum("nm,nm->m", vectors, state.loss @ vectors)
    ratio = np.full(number, part.damping_ratio) if part.damping_ratio else loss / (2 * omega**2)
    shapes = np.zeros((cut.model.size, number))
    shapes[state.free] = vectors
    return PartStage(piece, state, omega / (2 * np.pi), ratio, shapes)


def largest_change(first: FloatArray, second: FloatArray) -> float:
    """Return the largest relative change of the lowest natural frequencies (m,) between two stages."""
    count = min(JUDGED_MODES, first.size, second.size)
    return float(np.abs(np.log(second[:count] / first[:count])).max())


@dataclass(frozen=True, eq=False)
class StageCourse:
    """Stages of a part in their order; change : largest relative change of a frequency between neighbours, (stages - 1,);
    is_capped : whether more would have been needed."""

    cut: CutSolid
    stages: tuple[PartStage, ...]
    change: FloatArray
    is_capped: bool

    def stage_of(self, pieces: IndexArray) -> IndexArray:
        """Return the stage that stands for the part when so many pieces have been cut: the nearest by the removed volume."""
        return nearest_of(self.cut, np.array([stage.piece for stage in self.stages]), np.asarray(pieces))


def nearest_of(cut: CutSolid, stages: IndexArray, pieces: IndexArray) -> IndexArray:
    """Return which of some stages (numbers of pieces that have been cut, in order) is the nearest by the removed volume."""
    if len(stages) == 1:
        return np.zeros(len(pieces), np.int64)
    following = np.clip(np.searchsorted(stages, pieces, side="right"), 1, len(stages) - 1)
    removed_volume, cut_volume = volume_before(cut, stages), volume_before(cut, pieces)
    is_later = removed_volume[following] - cut_volume < cut_volume - removed_volume[following - 1]
    return np.where(is_later, following, following - 1)


def volume_before(cut: CutSolid, pieces: IndexArray) -> FloatArray:
    """Return the volume of a part that is gone before each of the pieces of the path, m^3, by its samples."""
    times, volumes = list[IndexArray](), list[FloatArray]()
    for block in cut.blocks:
        is_uniform, samples = block.time >= 0, block.line_times.reshape(block.mixed.size, -1)
        times += [block.time[is_uniform], samples.ravel()]
        share = block.volumes[block.mixed] / max(samples.shape[1], 1)
        volumes += [block.volumes[is_uniform], np.repeat(share, samples.shape[1])]
    time, volume = np.concatenate(times), np.concatenate(volumes)
    order = np.argsort(time, kind="stable")
    total = np.concatenate([[0.0], np.cumsum(volume[order])])
    return np.asarray(total[np.searchsorted(time[order], pieces)])


def choose_stages(part: ClampedPart, cut: CutSolid, progress: Callable[[int, int], None] = lambda finished, total: None
                  ) -> StageCourse:
    """Return the stages of a part under a path: halved by removed volume until each changes less than `stage_change`.

    Raises ToolpointError where the path takes nothing of the part.
    """
    if not cut.events.size:
        fail("part", "no material of it is cut", "must be met by the program",
             remedy="give it in the coordinates of the program, in m (its file says the unit)")
    solved = {piece: solve_stage(cut, part, piece) for piece in (0, cut.sweep.count)}
    waiting, is_capped = [(0, cut.sweep.count)], False
    while waiting:
        begin, end = waiting.pop(0)
        if largest_change(solved[begin].frequency, solved[end].frequency) <= part.stage_change:
            continue
        # A stage begins behind a piece that took something; the pieces between two events leave the part as it is.
        between = cut.events[(cut.events >= begin) & (cut.events < end - 1)] + 1
        between = between[(between > begin) & (between < end)]
        if not between.size:
            continue
        if len(solved) >= MAX_STAGES:
            is_capped = True
            break
        removed = volume_before(cut, np.concatenate([[begin], between, [end]]))
        middle = int(between[np.abs(removed[1:-1] - 0.5 * (removed[0] + removed[-1])).argmin()])
        progress(len(solved), len(solved) + 1 + len(waiting))
        solved[middle] = solve_stage(cut, part, middle)
        waiting += [(begin, middle), (middle, end)]
    stages = tuple(solved[piece] for piece in sorted(solved))
    change = np.array([largest_change(a.frequency, b.frequency) for a, b in pairwise(stages)])
    return StageCourse(cut, stages, change, is_capped)


def estimate_mesh_error(part: ClampedPart, course: StageCourse) -> MeshError | None:
    """Return the relative errors of the frequencies by the mesh, from another one; None without one.

    At the first, the middle and the last stage, mode by mode. An estimate: of frequencies that converge with the square of the
    mesh size, by the numbers of elements as if both were finer in all directions, so that it is rather too large for a plate.
    """
    if part.compared is None:
        return None
    other = CutSolid(part.compared, part.nodes_of(part.compared), course.cut.sweep, part.springs_on(part.compared))
    squared = (part.model.element_count / part.compared.element_count) ** (_MESH_ORDER / 3)
    frequencies, errors = list[FloatArray](), list[FloatArray]()
    for k in sorted({0, len(course.stages) // 2, len(course.stages) - 1}):
        frequency, compared = course.stages[k].frequency, solve_stage(other, part, course.stages[k].piece).frequency
        count = min(frequency.size, compared.size)
        frequencies.append(frequency[:count])
        errors.append(np.abs(np.log(compared[:count] / frequency[:count])) / abs(squared - 1))
    return MeshError(np.concatenate(frequencies), np.concatenate(errors))


def largest_of_lowest(error: MeshError | None, course: StageCourse) -> float | None:
    """Return the largest error of the lowest frequencies; None where it is not known."""
    if error is None:
        return None
    lowest = max(float(stage.frequency[:JUDGED_MODES].max()) for stage in course.stages)
    return float(error.error[error.frequency <= lowest * (1 + 1e-9)].max())
