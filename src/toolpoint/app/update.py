"""`toolpoint update`: a machine file and measured modes or responses in, the machine that agrees with them out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.identify import read_frf
from toolpoint.io import hdf5, machine_yaml
from toolpoint.machine import Machine, assemble
from toolpoint.machine.description import parameters
from toolpoint.plot import Chart, Listing, Notes, Report, ShapeView, Table
from toolpoint.plot.frf import bode
from toolpoint.plot.machine_scene import machine_shapes
from toolpoint.studies.machine_update import MachineUpdate, update
from toolpoint.vibration import Frf, Modes, frequency_response

_CURVES = 4


def update_machine(
    machine: str | Path, modes: str | Path | None = None, frf: Sequence[str | Path] = (), paths: Sequence[str] = (),
    pose: Mapping[str, float] | None = None, machine_file: str | Path | None = None,
    output: str | Path = "toolpoint-report", quiet: bool = False,
) -> MachineUpdate:
    """Update a machine to saved modes and measured FRFs, print the fit report, write the machine file and the page.

    Parameters that are not named are all stiffnesses of the joints; those that the data cannot tell stay where they were.
    """
    if modes is None and not frf:
        raise ToolpointError("update: neither --modes nor --frf given; needs at least one measurement")
    with console.steps(3, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        built = machine_yaml.read(machine)
        measured = None if modes is None else _modes(Path(modes))
        responses = read_frf(frf) if frf else None
        names = list(paths) or [p for p in parameters(built.description) if ".stiffness." in p]
        step("updating")
        found = update(built, names, measured, responses, pose)
        if machine_file is not None:
            machine_yaml.write(found.machine.description, machine_file)
        step("page")
        path = _page(built, found, responses, pose, warnings).save(output)
    if not quiet:
        console.OUT.print(found.report(), markup=False, soft_wrap=True)
        for text in warnings:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        if machine_file is not None:
            console.OUT.print(f"Machine file written: {machine_file}", markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return found


def _modes(path: Path) -> Modes:
    found = hdf5.read(path)
    if not isinstance(found, Modes):
        raise ToolpointError(f"{path}: holds {type(found).__name__}; needs Modes")
    return found


def _page(before: Machine, found: MachineUpdate, measured: Frf | None, pose: Mapping[str, float] | None,
          warnings: Sequence[str]) -> Report:
    report = Report(f"Updated: {before.name}", found.fit.status, subtitle=f"{len(found.problem.parameters)} parameters")
    rows = [[path, before.value(path), found.machine.value(path), 100 * (found.machine.value(path) / before.value(path) - 1)]
            for path in (p.name for p in found.problem.parameters) if before.value(path)]
    report = report.with_section("Parameters", Table(["parameter", "before", "after", "change %"], rows, digits=6),
                                 Listing("Identifiability, fit report and agreement", found.report()))
    if found.before.measured.size:
        agreement = [[r + 1, float(found.before.measured[r]), float(found.before.predicted[r]), float(found.before.mac[r]),
                      float(found.after.predicted[r]), float(found.after.mac[r])] for r in range(found.before.measured.size)]
        header = ["mode", "measured Hz", "before Hz", "before MAC", "after Hz", "after MAC"]
        report = report.with_section("Modes before and after", Table(header, agreement, digits=6))
    if measured is not None:
        report = report.with_section("Responses before and after", *_responses(before, found.machine, measured, pose))
    count = min(12, before.size)
    scene, shapes = machine_shapes(before, pose, count)
    other, moved = machine_shapes(found.machine, pose, count)
    pair = ShapeView(scene, shapes, "pair", "before", "", (other, moved, "after"))
    report = report.with_section("Shapes before and after", pair)
    return report.with_section("Warnings", Notes(warnings, "warning")) if warnings else report


def _responses(before: Machine, after: Machine, measured: Frf, pose: Mapping[str, float] | None) -> list[Chart]:
    lines = measured if measured.frequency[0] > 0 else measured.between(float(measured.frequency[1]), np.inf)
    lines = lines.converted_to("receptance")
    charts = []
    for k in range(min(_CURVES, len(lines.outputs))):
        single = replace(lines.selected([k], [0]), coherence=None)
        named = {"measured": single}
        for words, machine in (("before", before), ("after", after)):
            system = assemble(machine, pose, single.outputs, single.inputs)
            named[words] = frequency_response.direct(system, single.frequency)
        charts.append(Chart(bode(named, title=f"{single.outputs[0]} / {single.inputs[0]}")))
    return charts
