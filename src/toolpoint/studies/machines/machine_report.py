"""First study of a machine: modes beside its references, tool-point responses, stability of the described cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import doubts_among, mark_notes, place_note
from toolpoint._notebook import NotebookText
from toolpoint._rounding import limit_text
from toolpoint.cutting import StabilityChart
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.lowest import LowestLimit
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine import Machine
from toolpoint.machine.assembly.gyroscopics import fastest_spin
from toolpoint.machine.assembly.joint_terms import joint_matrices
from toolpoint.machine.assembly.reduction_error import reduction_note
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description import ReferenceDescription
from toolpoint.machine.description.origins import origin_of
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.machines.pose_words import pose_words
from toolpoint.studies.machines.reduced_limits import question_reduction
from toolpoint.studies.machines.tool_point import ToolPoint, lobes, lowest_limits, pose_problem, tool_point
from toolpoint.studies.machines.tool_seat import question_tool_seat
from toolpoint.studies.machines.tool_yielding import compliance_shares, yielding_sentence
from toolpoint.studies.text_table import text_table

Step = Callable[[str], None]
Pose = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class MachineReport(NotebookText):
    """Modes of a machine at a pose beside its references, with tool-point responses and stability charts.

    gaps : what could not be computed, and why; notes : errors of the reduction of elastic bodies at the poses, doubts as
    `Doubt`; yielding : share of each spring, by its path, in the static compliance of tool against table, empty without a tool.
    """

    machine: Machine
    pose: Pose
    frequency: FloatArray
    study: ToolPoint | None
    charts: tuple[StabilityChart, ...]
    gaps: tuple[str, ...] = field(default=())
    lowest: tuple[LowestLimit, ...] = field(default=())
    notes: tuple[str, ...] = ()
    yielding: Mapping[str, float] = field(default_factory=dict)

    def table(self) -> str:
        """Return the modes, where values come from, and the stability limits, as text."""
        header, rows = comparison(self)
        texts = [[_text(value, name) for value, name in zip(row, header, strict=True)] for row in rows]
        doubts = doubts_among(self.notes)
        return "\n".join([*mark_notes(doubts), text_table(self.machine.name, header, texts), *_sources(self.machine),
                          *self.gaps, *mark_notes(note for note in self.notes if note not in doubts),
                          *(self.study.leaning() if self.study else []),
                          *filter(None, [yielding_sentence(self.yielding)]), *self.limit_lines()])

    def limit_lines(self) -> list[str]:
        """Return a line on the depth that is stable at every speed of the chart, also between its lines, for every pose."""
        lines = []
        for pose, chart, lowest in zip(self.study.poses if self.study else (), self.charts, self.lowest, strict=False):
            depth = (f"{depth_at_every_speed(lowest)} (least at {lowest.speed:.0f} rev/min)"
                     if np.isfinite(lowest.depth) else f"above {1e3 * chart.depth_max:.3g} mm")
            lines.append(f"Stable at every speed from {chart.speeds.min():.0f} to {chart.speeds.max():.0f} rev/min, "
                         f"{pose_words(self.machine, pose)}: {depth}")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return frequencies (Hz) and the lowest stable depth (m, None: above the chart) of every pose as plain data."""
        limits = [limit.depth for limit in self.lowest]
        return {"frequency_hz": self.frequency.tolist(), "missing": list(self.gaps),
                "doubts": doubts_among(self.notes), "notes": list(self.notes), "stable_at_every_speed_m": [
            limit if np.isfinite(limit) else None for limit in limits],
            "tool_yielding_shares": dict(self.yielding), "limit_error_m": [limit.error for limit in self.lowest]}


def depth_at_every_speed(lowest: LowestLimit) -> str:
    """Return the depth that is stable at every speed in mm, as page and terminal both print it."""
    return f"{limit_text(1e3 * lowest.depth, 1e3 * lowest.error)} mm"


def study_modes(machine: Machine, pose: Pose | None = None) -> MachineReport:
    """Return the modes at a pose, without responses.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7, "z": 4e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> study_modes(machine).frequency.round(2).tolist()
    [50.33, 71.18, 100.66]
    """
    chosen_pose = dict(pose or {})
    # Of 18 modes the first are printed; the drawing offers all.
    return MachineReport(machine, chosen_pose, body_shapes(machine, chosen_pose, 18).frequency, None, ())


def study_machine(machine: Machine, pose: Pose | None = None, *, step: Step = lambda name: None,
                   method: StabilityMethod | None = None) -> MachineReport:
    """Return modes at a pose, with FRFs and lobes at the described poses (or at the requested pose).

    Results that cannot be computed are named with their reason.

    `method` of the lobes: the exact engine where left out, whose kernels are compiled at the first call and kept on disk.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> study_machine(machine).frequency.round(2).tolist()
    [50.33, 100.66]
    """
    description = machine.description
    step("modes")
    chosen_pose = dict(pose or {})
    frequency = body_shapes(machine, chosen_pose, 18).frequency
    gaps = ["Bodies spin: the modes drawn and listed are those at standstill; responses and lobes are those of the spinning "
            "machine (toolpoint campbell shows both)."] if fastest_spin(description) else []
    notes = list[str]()
    for place in ([chosen_pose] if pose or not description.poses else [dict(p) for p in description.poses]):
        # A note on the reduction holds at the poses of the responses only.
        if note := reduction_note(machine, place):
            notes.append(place_note(note, pose_words(machine, place)))
    study: ToolPoint | None = None
    charts: tuple[StabilityChart, ...] = ()
    lowest: tuple[LowestLimit, ...] = ()
    step("tool-point responses")
    if description.tool is None:
        gaps.append("No tool-point FRFs: the machine file names no 'tool' point.")
    elif not has_damping(machine):
        gaps.append("No tool-point FRFs: the machine has no damping; "
                    "give damping_ratio, or loss_factor or damping to joints.")
    else:
        study = tool_point(machine, [chosen_pose] if pose else None)
    step("stability lobes" if method else "stability lobes (half a minute of compiling, the first time only)")
    if study is not None and description.cutting is not None:
        charts = lobes(study, method=method)
        lowest = lowest_limits(study, charts, method=method)
        charts, lowest, reduction_notes = _with_reduction(study, description.cutting, charts, lowest=lowest)
        notes = [*question_tool_seat(machine), *notes, *reduction_notes]
    elif study is not None:
        gaps.append("No stability lobes: the machine file describes no 'cutting'.")
    return MachineReport(machine, chosen_pose, frequency, study, charts, tuple(gaps), lowest, tuple(notes),
                         compliance_shares(machine))


def _with_reduction(study: ToolPoint, cut: CuttingDescription, charts: Sequence[StabilityChart], *,
                    lowest: Sequence[LowestLimit]) -> tuple[tuple[StabilityChart, ...], tuple[LowestLimit, ...], list[str]]:
    """Return charts and lowest limits of all poses whose errors hold the reduction of elastic bodies, and remarks on it."""
    widened, widened_lowest, notes = [], [], list[str]()
    for i, (pose, chart, limit) in enumerate(zip(study.poses, charts, lowest, strict=True)):
        reduced = question_reduction(study.machine, pose, pose_problem(study, cut, i), chart=chart)
        widened.append(chart if reduced is None else reduced.widen(chart))
        widened_lowest.append(limit if reduced is None else reduced.widen_lowest(limit))
        notes += [] if reduced is None else [place_note(note, pose_words(study.machine, pose)) for note in reduced.notes]
    return tuple(widened), tuple(widened_lowest), notes


def has_damping(machine: Machine) -> bool:
    """Return whether anything in the machine dissipates energy."""
    if machine.description.damping_ratio or machine.description.modal_damping:
        return True
    _, viscous, structural = joint_matrices(place_machine(machine))
    return bool(np.any(viscous) or np.any(structural))


def comparison(results: MachineReport) -> tuple[list[str], list[list[object]]]:
    """Return header and rows of the frequencies beside every reference, with the difference in per cent."""
    references = results.machine.description.reference
    longest = max([6, *(len(r.frequencies) for r in references)])
    header = ["mode", "computed Hz", *(f"{r.name} Hz" for r in references), *(f"to {r.name} %" for r in references)]
    rows: list[list[object]] = []
    for i, value in enumerate(results.frequency[:longest]):
        row: list[object] = [i + 1, float(value)]
        # A reference with fewer modes leaves its cells empty.
        row += [_reference(r, i) for r in references]
        row += [_difference(r, i, float(value)) for r in references]
        rows.append(row)
    return header, rows


def _reference(reference: ReferenceDescription, i: int) -> object:
    return reference.frequencies[i] if i < len(reference.frequencies) else ""


def _difference(reference: ReferenceDescription, i: int, value: float) -> object:
    if i >= len(reference.frequencies):
        return ""
    return 100 * (value / reference.frequencies[i] - 1)


def _sources(machine: Machine) -> list[str]:
    lines = []
    for mark in ("published", "measured", "chosen", "assumed"):
        names = [f"joint {n}" for n, j in machine.description.joints.items() if origin_of(j.source) == mark]
        names += [f"body {n}" for n, b in machine.description.bodies.items() if origin_of(b.source) == mark]
        names += [r.name for r in machine.description.reference if origin_of(r.source) == mark]
        if names:
            lines.append(f"{mark}: {', '.join(names)}")
    return lines


def _text(value: Any, column: str) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:+.2f}" if column.startswith("to ") else f"{value:.2f}"
