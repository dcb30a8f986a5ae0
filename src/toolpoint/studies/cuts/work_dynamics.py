r"""Work that gives way beside the tool: the response between both is the sum of theirs, :math:`G = G_{tool} + G_{work}`.

The cutting force acts on both with opposite signs, and the chip sees the difference of their motions. That holds where tool and
work stand on structures that do not move each other: a thin wall in a vice, a long part between centres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import Array, ComplexArray, FloatArray, ToolpointError
from toolpoint.cutting import MillingProblem
from toolpoint.machine import Machine
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.tool_seat import question_tool_seat
from toolpoint.vibration import Dof, Frf, Modes, frequency_response

BOTH_LABELS = (Dof("tool-work", "+x"), Dof("tool-work", "+y"))  # of the response between tool and work
SPATIAL_LABELS = (*BOTH_LABELS, Dof("tool-work", "+z"))  # of the same where that along the tool's axis is known
_HIGHEST_LINE_RATIO = 3.0  # of the highest mode: tooth passing reaches beyond it
_LINE_COUNT_RANGE = (2000, 20000)  # of modes that are taken as lines
_MIN_COMMON_LINES = 16  # lines that both responses cover


def with_work(tool: ToolDynamics, work: ToolDynamics) -> ToolDynamics:
    """Return the dynamics between a tool and a work that gives way too, each with its own modes or lines.

    Parameters
    ----------
    tool, work : ToolDynamics
        x of one is x of the other. Modes of both stay modes; where one is measured lines, the sum is taken at these lines. The
        direction z is kept where the tool's is known; a work whose response along z is not known is rigid along it.

    Raises
    ------
    ToolpointError
        For lines that do not overlap, and bodies that spin beside measured lines.

    Examples
    --------
    >>> from toolpoint.studies import modal_dynamics
    >>> from toolpoint.vibration import Modes
    >>> tool = modal_dynamics(Modes([800.0], [0.03], [[1.0]], ["tip:+x"]), y="rigid")
    >>> wall = modal_dynamics(Modes([300.0], [0.01], [[2.0]], ["wall:+x"]), y="rigid")
    >>> both = with_work(tool, wall)
    >>> both.response.frequency.tolist(), both.x
    ([800.0, 300.0], 'tool-work:+x')
    """
    if isinstance(tool.response, Modes) and isinstance(work.response, Modes) and _add_as_modes(tool.response, work.response):
        response: Modes | Frf = _joined_modes(tool, work)
        at_speed = tool.at_speed
        faster = None if at_speed is None else lambda speed: _joined_modes(replace(tool, response=at_speed(speed)), work)
    elif tool.at_speed is not None:
        raise ToolpointError(f"work: {work.what} is measured lines, and bodies of {tool.what} spin; give the work's modes "
                             "(toolpoint identify FILE -m work.h5)")
    else:
        response, faster = _joined_lines(tool, work), None
    axial = [] if _labels(tool)[2] is None or _labels(work)[2] is not None else [
        f"{work.what}: rigid along the tool's axis, where its response is not known"]
    note = (f"the work gives way too: {work.what} is added to {tool.what}; both are taken to stand on structures that do not "
            "move each other")
    return replace(tool, response=response, x=str(BOTH_LABELS[0]), y=str(BOTH_LABELS[1]), at_speed=faster,
                   what=f"{tool.what} and {work.what}", parts=(tool, work),
                   notes=tuple(dict.fromkeys([*tool.notes, *work.notes, note, *axial])))


def machine_work(machine: Machine, pose: Mapping[str, float] | None = None) -> ToolDynamics:
    """Return the dynamics of a work that a machine description holds: its `tool` is the place of the work that is cut.

    Parameters
    ----------
    machine : Machine
        The part with what holds it; x and y of its place are those of the tool.
    pose : mapping, optional
        Axis positions, m or rad.

    Raises
    ------
    ToolpointError
        For a machine without a tool's point.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription
    >>> from toolpoint.machine.description import MachineDescription, PointDescription
    >>> clamp = JointDescription("ground", "part", stiffness={"x": 2e7, "y": 5e7})
    >>> part = BodyDescription(5.0, inertia=InertiaDescription(0.1, 0.1, 0.1))
    >>> work = machine_work(build(MachineDescription("vice", {"part": part}, {"clamp": clamp}, tool="wall",
    ...                                              points={"wall": PointDescription("part")}, damping_ratio=0.02)))
    >>> work.x, [round(hz) for hz in work.response.frequency.tolist()]
    ('wall:+x', [318, 503])
    """
    dynamics = machine_dynamics(machine, pose)
    # A work has no spindle between its body and its place: that the tool's seat lacks one is no doubt here.
    seats = [doubt for doubt in question_tool_seat(machine) if not doubt.grave]
    return replace(dynamics, notes=tuple(note for note in dynamics.notes if note not in seats))


def problem_with_work(problem: MillingProblem, work: ToolDynamics) -> MillingProblem:
    """Return a milling problem whose work gives way too, on the modes of both; refuse measured lines, and bodies that spin."""
    if not isinstance(problem.dynamics, Modes):
        raise ToolpointError("work: bodies of the machine spin; where the work gives way too they must stand (spin: 0)")
    if not isinstance(work.response, Modes):
        raise ToolpointError(f"work: {work.what} is measured lines; over many poses its modes are needed (toolpoint identify "
                             "FILE -m work.h5)")
    y = None if problem.y is None else str(problem.y)
    both = with_work(ToolDynamics(problem.dynamics, str(problem.x), y, None, (), "the machine"), work)
    axial = None if problem.z is None else str(SPATIAL_LABELS[-1])
    return problem.changed(dynamics=both.response, x=both.x, y=both.y, z=axial)


def _labels(dynamics: ToolDynamics) -> tuple[str | None, str | None, str | None]:
    """Return the labels along x, y (None: rigid; ``same``) and z (None: not known) of the point that is cut at."""
    x = Dof.parse(dynamics.x)
    axial = Dof(x.point, "+z")
    dofs = dynamics.response.dofs if isinstance(dynamics.response, Modes) else [
        dof for dof in dynamics.response.outputs if dof in dynamics.response.inputs]
    return dynamics.x, dynamics.y, str(axial) if axial in dofs and axial != x else None


def _rows_of(dynamics: ToolDynamics) -> list[tuple[int, str]]:
    """Return the rows of the response between tool and work that a part of it fills, each with its label."""
    return [(row, label) for row, label in enumerate(_labels(dynamics)) if label not in (None, "same")]


def _both_labels(tool: ToolDynamics) -> tuple[Dof, ...]:
    """Return the labels of the response between tool and work: along z too where the tool's is known."""
    return SPATIAL_LABELS if _labels(tool)[2] is not None else BOTH_LABELS


def _add_as_modes(tool: Modes, work: Modes) -> bool:
    """Return whether the modes of both can be written as modes of one kind, without residuals."""
    parts = (tool, work)
    is_one_kind = len({(part.scaling, part.damping) for part in parts}) == 1 or all(_has_modal_a(part) for part in parts)
    return is_one_kind and all(part.frequency.ndim == 1 and part.lower_residual is None and part.upper_residual is None
                               for part in parts)


def _has_modal_a(modes: Modes) -> bool:
    """Return whether modes are complex ones of modal A, or can be written so: viscous, oscillating, of unit modal mass."""
    if modes.scaling == "modal A":
        return True
    oscillates = (modes.damping_ratio < 1) & (modes.frequency > 0)
    return modes.scaling == "unit modal mass" and modes.damping == "viscous" and bool(oscillates.all())


def _in_modal_a(modes: Modes) -> Modes:
    r"""Return modes of unit modal mass as modes of modal A, with residues :math:`\phi \psi^T / 2 i \omega_d`."""
    if modes.scaling == "modal A":
        return modes
    shape_at_inputs = modes.shape if modes.participation is None else modes.participation
    damped = modes.omega * np.sqrt(1 - modes.damping_ratio**2)
    return replace(modes, scaling="modal A", participation=shape_at_inputs / (2j * damped), direct=None,
                   input_dofs=modes.input_dofs or modes.dofs)


def _joined_modes(tool: ToolDynamics, work: ToolDynamics) -> Modes:
    """Return the modes of both; those of the work have opposite signs, which their products do not show."""
    shapes, participations, parts = [], [], []
    both = [part.response for part in (tool, work) if isinstance(part.response, Modes)]
    is_mixed, labels = len({modes.scaling for modes in both}) > 1, _both_labels(tool)
    for dynamics, as_given in zip((tool, work), both, strict=True):
        modes = _in_modal_a(as_given) if is_mixed else as_given
        if dynamics.y == "same":
            modes = _doubled(modes, dynamics.x)
            rows, columns = modes.shape, modes.participation
            assert columns is not None
            empty = np.zeros((len(labels) - 2, modes.count))
            rows, columns = np.vstack([rows, empty]), np.vstack([columns, empty])
        else:
            rows, columns = _spread_rows(dynamics, modes, len(labels))
        shapes.append(rows)
        participations.append(columns)
        parts.append(modes)
    frequency, damping = (np.concatenate([getattr(part, name) for part in parts]) for name in ("frequency", "damping_ratio"))
    first = parts[0]
    return Modes(frequency, damping, np.hstack(shapes), labels, first.scaling, first.damping,
                 participation=np.hstack(participations), input_dofs=labels, direct=_joined_direct(tool, work),
                 notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)))


def _spread_rows(dynamics: ToolDynamics, modes: Modes, count: int) -> tuple[Array, Array]:
    """Return shapes and participations (count, m) along x, y and, of three, z; zero where the part is rigid."""
    placed = [(row, label) for row, label in _rows_of(dynamics) if row < count]
    rows, names = [row for row, _ in placed], [label for _, label in placed]
    parts = modes.shape_at(names), modes.participation_at(names)
    shape, participation = (np.zeros((count, modes.count), part.dtype) for part in parts)
    shape[rows], participation[rows] = parts
    return shape, participation


def _joined_direct(tool: ToolDynamics, work: ToolDynamics) -> Frf | None:
    """Return the response that was solved directly beside the modes of one of both, with the other's added to it."""
    solved = [direct for part in (tool, work) if (direct := getattr(part.response, "direct", None)) is not None]
    if not solved:
        return None
    lines = solved[0].frequency
    labels = _both_labels(tool)
    values = sum(_plane(part if (direct := getattr(part.response, "direct", None)) is None else replace(part, response=direct),
                        lines, len(labels))[0] for part in (tool, work))
    return Frf(lines, np.asarray(values), labels, labels, "receptance")


def _doubled(modes: Modes, x: str) -> Modes:
    """Return the modes along x once more along y, for a response that is the same in both."""
    shape, participation = modes.shape_at([x]), modes.participation_at([x])
    zero = np.zeros_like(shape)
    return Modes(np.tile(modes.frequency, 2), np.tile(modes.damping_ratio, 2), np.block([[shape, zero], [zero, shape]]),
                 BOTH_LABELS, modes.scaling, modes.damping, notes=modes.notes, input_dofs=BOTH_LABELS,
                 participation=np.block([[participation, zero], [zero, participation]]))


def _joined_lines(tool: ToolDynamics, work: ToolDynamics) -> Frf:
    """Return the sum of both on the lines of the one that is measured, the tool's where both are."""
    measured = [part.response for part in (tool, work) if isinstance(part.response, Frf)]
    lines = measured[0].frequency if measured else _lines_of(tool, work)
    first_line = max([0.0, *(float(part.frequency[0]) for part in measured)])
    last_line = min([np.inf, *(float(part.frequency[-1]) for part in measured)])
    lines = lines[(lines >= first_line) & (lines <= last_line)]
    if lines.size < _MIN_COMMON_LINES:
        spans = " and ".join(f"{part.frequency[0]:g} to {part.frequency[-1]:g} Hz" for part in measured)
        raise ToolpointError(f"work: {tool.what} and {work.what} have {lines.size} lines in common ({spans}); must be at least "
                             f"{_MIN_COMMON_LINES}; measure both over one band")
    labels = _both_labels(tool)
    planes = [_plane(part, lines, len(labels)) for part in (tool, work)]
    drawn = [draws for _, draws in planes if draws is not None]
    values = planes[0][0] + planes[1][0]
    draws = None
    if drawn:
        count = min(map(len, drawn))
        draws = np.sum([np.broadcast_to(value, (count, *value.shape)) if part is None else part[:count]
                        for value, part in planes], axis=0)
    return Frf(lines, values, labels, labels, "receptance", draws=draws)


def _lines_of(tool: ToolDynamics, work: ToolDynamics) -> FloatArray:
    """Return lines over all modes of both, close at the sharpest."""
    modes = [part.response for part in (tool, work) if isinstance(part.response, Modes)]
    highest = _HIGHEST_LINE_RATIO * max(float(part.frequency.max()) for part in modes)
    width = min(float((part.frequency * part.damping_ratio)[~part.is_rigid].min()) for part in modes)
    return np.linspace(highest / _LINE_COUNT_RANGE[1], highest, int(np.clip(4 * highest / width, *_LINE_COUNT_RANGE)))


def _plane(dynamics: ToolDynamics, lines: FloatArray, count: int) -> tuple[ComplexArray, ComplexArray | None]:
    """Return the response (n_f, count, count) along x, y and, of three, z on some lines, zero where it is rigid, and its
    draws."""
    placed = [(row, label) for row, label in _rows_of(dynamics) if row < count]
    labels = [label for _, label in placed]
    response = dynamics.response
    if isinstance(response, Modes):
        frf = frequency_response.modal(response, lines, labels, inputs=labels)
        if response.direct is not None:  # what the modes lack between resonances
            solved = response.direct.selected(labels, labels)
            lacking = solved.values - frequency_response.modal(response, solved.frequency, labels, inputs=labels).values
            frf = replace(frf, values=frf.values + scipy.interpolate.make_interp_spline(solved.frequency, lacking, k=1)(
                np.clip(lines, solved.frequency[0], solved.frequency[-1])))
    else:
        frf = response.selected(labels, labels).interpolated(lines)
    rows, is_same = [row for row, _ in placed], dynamics.y == "same"
    plane = _filled(frf.values, rows, count, is_same=is_same)
    return plane, None if frf.draws is None else _filled(frf.draws, rows, count, is_same=is_same)


def _filled(values: ComplexArray, rows: Sequence[int], count: int, *, is_same: bool) -> ComplexArray:
    """Return responses (..., k, k) of some of the directions as (..., count, count)."""
    result = np.zeros((*values.shape[:-2], count, count), complex)
    result[..., np.array(rows)[:, None], np.array(rows)] = values
    if is_same:
        result[..., 1, 1] = values[..., 0, 0]
    return result
