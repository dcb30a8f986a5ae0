"""MeasuredWork: responses of the work that were measured at stages of a program, along its x and y."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.thin_walls.work_course import WorkCourse
from toolpoint.vibration import Dof, Frf, Modes

MEASURED_LABELS = (Dof("work", "+x"), Dof("work", "+y"))


@dataclass(frozen=True, eq=False)
class MeasuredWork:
    """Responses of the work by the line of the program from which each holds.

    A response along x or y alone is that of a wall which is rigid along the other. Raises ToolpointError for none, and for a
    response along neither.

    Examples
    --------
    >>> from toolpoint.studies import modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> wall = modal_dynamics(Modes([900.0], [0.01], [[2.0]], ["wall:+y"]), y="rigid")
    >>> MeasuredWork({1: wall}).lines
    (1,)
    """

    responses: Mapping[int, ToolDynamics]

    def __post_init__(self) -> None:
        if not self.responses:
            fail("responses", "none", "must be one at least, with the line from which it holds")
        object.__setattr__(self, "responses", {line: along_program(each) for line, each in self.responses.items()})

    @property
    def lines(self) -> tuple[int, ...]:
        """Lines from which a response holds, in their order."""
        return tuple(sorted(self.responses))


def along_program(dynamics: ToolDynamics) -> ToolDynamics:
    """Return the response of a work along x and y of the program: one that is known along one of them is rigid along the other.

    Examples
    --------
    >>> from toolpoint.studies import modal_dynamics
    >>> wall = along_program(modal_dynamics(Modes([900.0], [0.01], [[2.0]], ["wall:+y"])))
    >>> wall.response.shape.tolist()
    [[0.0], [2.0]]
    """
    if dynamics.y != "same":
        return dynamics
    label = Dof.parse(dynamics.x)
    way = label.direction[1:]
    if way not in ("x", "y"):
        fail("work", f"{dynamics.what}: its response is along {label.direction}", "must be along x or y of the program",
             remedy="name the labels of its driving points, for example wall:+y")
    row = "xy".index(way)
    response: Modes | Frf
    if isinstance(dynamics.response, Modes):
        modes = dynamics.response
        response = replace(modes, shape=_placed(modes.shape_at([label]), row), dofs=MEASURED_LABELS, direct=None,
                           participation=None if modes.participation is None else _placed(modes.participation_at([label]), row),
                           input_dofs=() if modes.participation is None else MEASURED_LABELS, lower_residual=None,
                           upper_residual=None, shape_variance=None)
    else:
        frf = dynamics.response.selected([label], [label])
        values = np.zeros((*frf.values.shape[:-2], 2, 2), complex)
        values[..., row, row] = frf.values[..., 0, 0]
        response = Frf(frf.frequency, values, MEASURED_LABELS, MEASURED_LABELS, frf.quantity)
    notes = tuple(note for note in dynamics.notes if "response across is taken" not in note)
    return ToolDynamics(response, str(MEASURED_LABELS[0]), str(MEASURED_LABELS[1]), what=dynamics.what,
                        notes=(*notes, f"{dynamics.what}: the work is rigid along {'yx'[row]}"))


def _placed(row: FloatArray, place: int) -> FloatArray:
    """Return one row (1, m) as one of two, the other zero."""
    rows = np.zeros((2, row.shape[1]), row.dtype)
    rows[place] = row[0]
    return rows


def follow_responses(work: MeasuredWork, arcs: PlaceArcs, *, removed: RemovedMaterial, laid: ProgramPath) -> WorkCourse:
    """Return the course of responses that were measured at stages, see `follow_work`."""
    line = laid.path.line[laid.moves.block[removed.piece[arcs.place]]]
    first = int(line.min())
    if first < work.lines[0]:
        fail("work", f"the first response holds from line {work.lines[0]}", f"must hold from line {first} at the latest, where "
             "the program begins to cut", remedy="give a response of the uncut work from line 1")
    group = np.searchsorted(np.array(work.lines), line, side="right") - 1
    dynamics = [work.responses[each] for each in work.lines]
    rows = tuple((str(k + 1), str(each), "-", "-", "-", "-", "-") for k, each in enumerate(work.lines))
    notes = [f"the work's response from line {each} on: {work.responses[each].what}" for each in work.lines]
    doubts = [Doubt("response of the work", "one measured response stands for all places of its stage, with the motion where "
                    "it was struck", "strike the wall where it gives way most, or give the part by finite elements")]
    for tip in dynamics:
        notes += list(tip.notes)
    return WorkCourse(np.asarray(group), tuple(dynamics), np.full(arcs.place.size, np.nan), rows, tuple(dict.fromkeys(notes)),
                      tuple(doubts))
