"""The page of a machine: drawn with its modes, compared with references, FRFs at the tool point, lobes, inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._doubt import Doubt, doubts_among
from toolpoint._rounding import number_text
from toolpoint.cutting import StabilityChart, build
from toolpoint.cutting.stability.lowest import LowestLimit
from toolpoint.machine import Machine
from toolpoint.machine.assembly.system import freedoms
from toolpoint.machine.description.origins import origin_of
from toolpoint.plot import Cell, Chart, Listing, Notes, Report, ShapeView, Table
from toolpoint.plot.figures.cuts.lobes import StabilityCurve, stability_chart
from toolpoint.plot.figures.measured.frf import bode
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.machines.machine_report import MachineReport, comparison, depth_at_every_speed
from toolpoint.studies.machines.pose_words import pose_words
from toolpoint.studies.machines.tool_point import ToolPoint
from toolpoint.studies.machines.tool_yielding import yielding_sentence


def machine_page(result: MachineReport, source: str, file_name: str, *, problems: Sequence[str] = ()) -> Report:
    """Return the page of a machine.

    source, file_name : text and name of the machine file; problems : doubts to be printed first.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.studies import study_machine
    >>> from toolpoint.cutting import ZeroOrder
    >>> page = machine_page(study_machine(machine, method=ZeroOrder()), "", "slide.yaml")
    >>> page.summary.split(";")[0]  # sqrt(1e7 / 100) / (2 pi)
    'The lowest mode is at 50.33 Hz'
    """
    description = result.machine.description
    summary = "\n\n".join(part for part in (answer(result), description.description) if part)
    report = Report(description.name, summary, subtitle=f"{file_name}, {pose_words(result.machine, result.pose)}")
    scene, shapes = machine_shapes(result.machine, result.pose, 12)
    report = report.with_section(
        "Machine and modes", ShapeView(scene, shapes, "machine", description.name,
                                       "Undamped modes at the pose named above; shapes are scaled to be seen."))
    report = report.with_section("Natural frequencies", *_frequency_parts(result))
    report = with_responses(report, result)
    report = report.with_doubts(*problems, *result.gaps, *doubts_among(result.notes))
    rests = ["Small, linear motion about each pose.", *description.assumptions, *_method_notes(result)]
    return report.with_section("Inputs and assumptions", Notes(rests, "assumed"), _input_table(result.machine),
                               Listing(f"Machine file {file_name}", source))


def answer(result: MachineReport) -> str:
    """Return the lowest mode with the greatest compliance of the tool, its softest joint, the lowest stable depth, and what
    they rest on.

    A sentence each; those on joint and depth are left out where the machine has no tool and where no chart has a limit.
    """
    words = f"The lowest mode is at {number_text(float(result.frequency[0]))} Hz"
    if result.study is not None:
        frf = result.study.frf
        sizes = [(float(np.abs(frf.at_pose(k).values[:, i, i]).max()), k, i) for k in range(len(result.study.poses))
                 for i in range(len(frf.outputs))]
        size, k, i = max(sizes)
        line = int(np.argmax(np.abs(frf.at_pose(k).values[:, i, i])))
        words += (f"; the tool is most compliant along {'xyz'[i]} at {frf.frequency[line]:.1f} Hz "
                  f"({number_text(1e6 * size, digits=3)} µm/N)")
    words += f". {yielding_sentence(result.yielding)}".removesuffix(".") if result.yielding else ""
    finite = [limit for limit in result.lowest if np.isfinite(limit.depth)]
    if finite:
        lowest = min(finite, key=lambda limit: limit.depth)
        words += (f". In the cut of the file {depth_at_every_speed(lowest)} is stable at every charted "
                  f"speed and pose (least at {lowest.speed:.0f} rev/min)")
    return words + ". Computed from the numbers of the file, without an interval."


def with_responses(report: Report, result: MachineReport) -> Report:
    """Return the report with the tool-point responses and the stability charts, where there are any."""
    if result.study is not None:
        report = report.with_section("Tool against table" if "-" in result.study.point else "Tool point",
                                     *frf_parts(result.study))
    if result.charts:
        report = report.with_section("Stability of the cut", *lobe_parts(result))
    return report


def _frequency_parts(result: MachineReport) -> list[Table | str]:
    """Return the number of freedoms and the table of frequencies beside the references of the file."""
    header, rows = comparison(result)
    references = result.machine.description.reference
    marks = ["", "computed", *(origin_of(r.source) for r in references),
             *("" for _ in references)]
    marked = [[Cell(round(v, 2) if isinstance(v, float) else v, mark if v != "" else "")
               for v, mark in zip(row, marks, strict=True)] for row in rows]
    header = [name.replace(" Hz", ", Hz").replace(" %", ", %") for name in header]
    words = f"The machine has {freedoms(result.machine)} degrees of freedom in minimal coordinates."
    return [words, Table(header, marked, "Natural frequencies")]


def frf_parts(study: ToolPoint) -> list[Chart]:
    """Return the direct responses along x, y and z at every pose."""
    parts = []
    for i, way in enumerate("xyz"):
        single = {pose_words(study.machine, pose): study.frf.at_pose(k).selected([i], [i])
                  for k, pose in enumerate(study.poses)}
        parts.append(Chart(bode(single, title=f"{study.point}, direction {way}"),
                           _direction_text(study, way)))
    return parts


def _direction_text(study: ToolPoint, way: str) -> str:
    """Return the caption of a response: between which points, and whose directions."""
    text = f"Receptance along {way} under equal and opposite forces." if "-" in study.point else ""
    return f"{text} x, y and z are the tool's at each pose.".strip() if study.leaning() else text


def lobe_parts(result: MachineReport) -> list[Chart | Table | str]:
    """Return the stability chart of all poses and a table of the lowest limit of each pose."""
    assert result.study is not None
    cut = result.machine.description.cutting
    assert cut is not None
    names = [pose_words(result.machine, pose) for pose in result.study.poses]
    curves = [StabilityCurve(chart.speeds, chart.limit, name) for chart, name in zip(result.charts, names, strict=True)]
    words = (f"{build.words(cut)}. "
             f"Method: {result.charts[0].method or 'default'}. Below the curve the cut is stable. The response is that of "
             "the machine's structure alone; the tool and spindle add their own at higher frequencies.")
    rows = [[name, *_lowest(limit, chart)] for name, chart, limit in zip(names, result.charts, result.lowest, strict=True)]
    finite = any(np.isfinite(chart.limit).any() for chart in result.charts)
    depth_top = None if finite else max(chart.depth_max for chart in result.charts)
    return [words, Chart(stability_chart(curves, max_depth=depth_top)),
            Table(["pose", "lowest limit, mm", "chatter, Hz", "at rev/min"], rows,
                  "Depth that is stable at every speed of the chart, also between its lines, rounded down; ± is the numerical "
                  "error and that of reduced elastic bodies, printed where it is above half a per cent")]


def _lowest(limit: LowestLimit, chart: StabilityChart) -> list[object]:
    """Return the lowest limit (mm), its chatter frequency (Hz) and its speed (rev/min) as cells."""
    if not np.isfinite(limit.depth):
        return [f"above {1e3 * chart.depth_max:.3g}", "", ""]
    return [depth_at_every_speed(limit).removesuffix(" mm"), f"{limit.frequency:.0f}", round(limit.speed)]


def _method_notes(result: MachineReport) -> list[str]:
    """Return the remarks on methods that are no doubts, each once."""
    notes = [note for note in result.notes if not isinstance(note, Doubt)]
    notes += [*result.study.leaning(), *result.study.modes.notes] if result.study is not None else []
    for chart in result.charts:
        notes += [note for note in chart.notes if note not in notes]
    return notes


def _input_table(machine: Machine) -> Table:
    """Return the inputs of all joints and bodies with the marks of their origin."""
    rows = []
    for name, joint in machine.description.joints.items():
        mark = origin_of(joint.source)
        values = "; ".join(f"{k} {v:.5g} {'N m/rad' if k.startswith('r') else 'N/m'}" for k, v in joint.stiffness.items())
        loose = f" free: {', '.join(joint.free)}" if joint.free else ""
        cell = Cell((values + loose) or "all directions locked", mark)
        rows.append([f"joint {name}", f"{joint.parent} - {joint.child}", cell])
    for name, body in machine.description.bodies.items():
        mark = origin_of(body.source)
        mass = float(machine.bodies[machine.link(name)].mass[0, 0])
        rows.append([f"body {name}", "", Cell(f"{mass:.6g} kg", mark)])
    return Table(["part", "between", "value"], rows, "Where the values come from")


