"""The page of a machine: drawn with its modes, compared with references, FRFs at the tool point, lobes, inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import StabilityChart, build
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine import Machine
from toolpoint.machine.description import ReferenceDescription
from toolpoint.machine.joint_terms import joint_matrices
from toolpoint.machine.placement import placed
from toolpoint.machine.shapes import body_shapes
from toolpoint.plot import Cell, Chart, Listing, Notes, Report, ShapeView, Table
from toolpoint.plot.figures.frf import bode
from toolpoint.plot.figures.lobes import StabilityCurve, stability_chart
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.tool_point import ToolPoint, lobes, tool_point

Step = Callable[[str], None]
Pose = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class MachineResults:
    """Everything that the page and the terminal show of one machine."""

    machine: Machine
    pose: Pose
    frequency: FloatArray
    study: ToolPoint | None
    charts: tuple[StabilityChart, ...]
    missing: tuple[str, ...] = field(default=())


def only_modes(machine: Machine, pose: Pose | None = None) -> MachineResults:
    """Return the modes at a pose, without responses."""
    at = dict(pose or {})
    return MachineResults(machine, at, body_shapes(machine, at, 18).frequency, None, ())


def computed(machine: Machine, pose: Pose | None, step: Step, method: StabilityMethod | None = None) -> MachineResults:
    """Return modes at a pose, FRFs and lobes at the described poses (or at the pose asked for); what cannot be, is said.

    `method` of the lobes: the exact engine where left out, whose kernels are compiled at the first call and kept on disk.
    """
    description = machine.description
    step("modes")
    at = dict(pose or {})
    frequency = body_shapes(machine, at, 18).frequency
    missing = []
    study: ToolPoint | None = None
    charts: tuple[StabilityChart, ...] = ()
    step("tool-point responses")
    if description.tool is None:
        missing.append("No tool-point FRFs: the machine file names no 'tool' point.")
    elif not has_damping(machine):
        missing.append("No tool-point FRFs: the machine has no damping; "
                       "give damping_ratio, or loss_factor or damping to joints.")
    else:
        study = tool_point(machine, [at] if pose else None)
    step("stability lobes" if method else "stability lobes (half a minute of compiling, the first time only)")
    if study is not None and description.cutting is not None:
        charts = lobes(study, method=method)
    elif study is not None:
        missing.append("No stability lobes: the machine file describes no 'cutting'.")
    return MachineResults(machine, at, frequency, study, charts, tuple(missing))


def has_damping(machine: Machine) -> bool:
    """Return whether anything in the machine dissipates energy."""
    if machine.description.damping_ratio:
        return True
    _, viscous, structural = joint_matrices(placed(machine))
    return bool(np.any(viscous) or np.any(structural))


def pose_name(pose: Pose) -> str:
    """Return a pose in words."""
    return ", ".join(f"{name} {value:g}" for name, value in pose.items()) or "reference pose"


def comparison(results: MachineResults) -> tuple[list[str], list[list[object]]]:
    """Return header and rows of the frequencies beside every reference, with the difference in per cent."""
    references = results.machine.description.reference
    longest = max([6, *(len(r.frequencies) for r in references)])
    header = ["mode", "computed Hz", *(f"{r.name} Hz" for r in references), *(f"to {r.name} %" for r in references)]
    rows: list[list[object]] = []
    for i, value in enumerate(results.frequency[:longest]):
        row: list[object] = [i + 1, float(value)]
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


def machine_report(results: MachineResults, source: str, file_name: str, problems: Sequence[str] = ()) -> Report:
    """Return the page of a machine; `source` is the text of its file."""
    description = results.machine.description
    report = Report(description.name, description.description, subtitle=f"{file_name}, {pose_name(results.pose)}")
    scene, shapes = machine_shapes(results.machine, results.pose, 12)
    report = report.with_section(
        "Machine and modes", ShapeView(scene, shapes, "machine", description.name,
                                       "Undamped modes at the pose named above; shapes are scaled to be seen."))
    report = report.with_section("Natural frequencies", *_frequency_parts(results))
    report = with_responses(report, results)
    problems = [*problems, *results.missing]
    report = report.with_section(
        "Inputs and assumptions", *( [Notes(problems, "warning")] if problems else []),
        Notes([*description.assumptions, *_method_notes(results)], "assumed"), _input_table(results.machine),
        Listing(f"Machine file {file_name}", source))
    return report


def with_responses(report: Report, results: MachineResults) -> Report:
    """Return the report with the tool-point responses and the stability charts, where there are any."""
    if results.study is not None:
        report = report.with_section("Tool against table" if "-" in results.study.point else "Tool point",
                                     *frf_parts(results.study))
    if results.charts:
        report = report.with_section("Stability of the cut", *lobe_parts(results))
    return report


def _frequency_parts(results: MachineResults) -> list[Table | str]:
    header, rows = comparison(results)
    references = results.machine.description.reference
    marks = ["", "computed", *(r.source if r.source in ("published", "measured") else "" for r in references),
             *("" for _ in references)]
    marked = [[Cell(round(v, 2) if isinstance(v, float) else v, mark if v != "" else "")
               for v, mark in zip(row, marks, strict=True)] for row in rows]
    words = f"The machine has {results.machine.size} degrees of freedom in minimal coordinates."
    return [words, Table(header, marked, "Natural frequencies")]


def frf_parts(study: ToolPoint) -> list[Chart]:
    """Return the direct responses along x, y and z at every pose."""
    parts = []
    for i, way in enumerate("xyz"):
        single = {pose_name(pose): study.frf.at_pose(k).selected([i], [i]) for k, pose in enumerate(study.poses)}
        parts.append(Chart(bode(single, title=f"{study.point}, direction {way}"),
                           f"Receptance along {way} under equal and opposite forces." if "-" in study.point else ""))
    return parts


def lobe_parts(results: MachineResults) -> list[Chart | Table | str]:
    """Return the stability chart of all poses and the lowest limit of each."""
    assert results.study is not None
    cut = results.machine.description.cutting
    assert cut is not None
    names = [pose_name(pose) for pose in results.study.poses]
    curves = [StabilityCurve(chart.speeds, chart.limit, name) for chart, name in zip(results.charts, names, strict=True)]
    words = (f"{build.words(cut)}. "
             f"Method: {results.charts[0].method or 'default'}. Below the curve the cut is stable. The response is that of "
             "the machine's structure alone; the tool and spindle add their own at higher frequencies.")
    rows = [[name, _lowest(chart), float(chart.speeds[int(np.argmin(chart.limit))])]
            for name, chart in zip(names, results.charts, strict=True)]
    return [words, Chart(stability_chart(curves)),
            Table(["pose", "lowest limit mm", "at rev/min"], rows, "Depth that is stable at every charted speed")]


def _lowest(chart: StabilityChart) -> object:
    value = float(np.min(chart.limit))
    return round(1e3 * value, 4) if np.isfinite(value) else f"above {1e3 * chart.depth_max:.3g}"


def _method_notes(results: MachineResults) -> list[str]:
    notes = list(results.study.modes.notes) if results.study is not None else []
    for chart in results.charts:
        notes += [note for note in chart.notes if note not in notes]
    return notes


def _input_table(machine: Machine) -> Table:
    rows = []
    for name, joint in machine.description.joints.items():
        mark = joint.source if joint.source in ("published", "chosen", "measured", "assumed") else ""
        values = "; ".join(f"{k} {v:.5g} {'N m/rad' if k.startswith('r') else 'N/m'}" for k, v in joint.stiffness.items())
        loose = f" free: {', '.join(joint.free)}" if joint.free else ""
        cell = Cell((values + loose) or "all directions locked", mark)
        rows.append([f"joint {name}", f"{joint.parent} - {joint.child}", cell])
    for name, body in machine.description.bodies.items():
        mark = body.source if body.source in ("published", "chosen", "measured", "assumed") else ""
        mass = float(machine.bodies[machine.link(name)].mass[0, 0])
        rows.append([f"body {name}", "", Cell(f"{mass:.6g} kg", mark)])
    return Table(["part", "between", "value"], rows, "Where the values come from")


