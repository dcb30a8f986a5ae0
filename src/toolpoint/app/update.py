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
from toolpoint.plot.correlation import mac_matrix
from toolpoint.plot.frf import bode
from toolpoint.plot.machine_scene import machine_shapes
from toolpoint.plot.shape_pairs import partners, turned_alike
from toolpoint.studies.machine_update import MachineUpdate, update
from toolpoint.vibration import Frf, Modes, correlation, eigen, frequency_response

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
        path = _page(built, found, measured, responses, pose, warnings).save(output)
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


def _page(before: Machine, found: MachineUpdate, measured: Modes | None, responses: Frf | None,
          pose: Mapping[str, float] | None, warnings: Sequence[str]) -> Report:
    free = f"{len(found.fit.free)} of {len(found.problem.parameters)} parameters moved"
    report = Report(f"Updated: {before.name}", found.fit.status[:1].upper() + found.fit.status[1:] + ".", subtitle=free)
    report = report.with_section("Parameters", _parameters(before, found),
                                 Listing("Identifiability, fit report and agreement", found.report()))
    if measured is not None:
        report = report.with_section("Modes before and after", _agreement(found), *_mac(before, found, measured, pose))
    if responses is not None:
        report = report.with_section("Responses before and after", *_frac(found), *_responses(before, found.machine, responses,
                                                                                               pose))
    report = report.with_section("Shapes before and after", _shapes(before, found, pose))
    return report.with_section("Warnings", Notes(warnings, "warning")) if warnings else report


def _parameters(before: Machine, found: MachineUpdate) -> Table:
    rows = []
    for path in (p.name for p in found.problem.parameters):
        old, new = before.value(path), found.machine.value(path)
        moved = path in found.fit.free
        error = f"± {found.fit.standard_error[path]:.2g}" if moved else ""
        verdict = ("moved, at a bound" if path in found.fit.at_bounds else "moved") if moved else (
            "left alone: " + found.fit.left_alone.get(path, ""))
        rows.append([path, f"{old:.6g}", f"{new:.6g}", error, f"{100 * (new / old - 1):+.2f}" if old else "", verdict])
    return Table(["parameter", "before", "after", "standard error", "change %", "verdict"], rows, "SI units")


def _agreement(found: MachineUpdate) -> Table:
    b, a = found.before, found.after
    rows = [[r + 1, f"{b.measured[r]:.3f}", f"{b.predicted[r]:.3f}", f"{100 * b.frequency_error[r]:+.2f}", f"{b.mac[r]:.3f}",
             f"{a.predicted[r]:.3f}", f"{100 * a.frequency_error[r]:+.2f}", f"{a.mac[r]:.3f}"] for r in range(b.measured.size)]
    return Table(["mode", "measured Hz", "before Hz", "before %", "before MAC", "after Hz", "after %", "after MAC"], rows)


def _mac(before: Machine, found: MachineUpdate, measured: Modes, pose: Mapping[str, float] | None) -> list[Chart]:
    charts = []
    for words, machine, agreed in (("before", before, found.before), ("after", found.machine, found.after)):
        count = max(int(agreed.modes.max()) + 1, min(measured.count + 2, machine.size))
        modes = eigen.undamped(assemble(machine, pose, measured.dofs, modal_damping=False), count)
        pairs = np.stack([np.arange(agreed.modes.size), agreed.modes], axis=1)
        charts.append(Chart(mac_matrix(
            correlation.mac(measured.shape, modes.shape), measured, modes, row_title="Measured mode",
            column_title="Mode of the model", title=f"MAC {words}", pairs=pairs), "Paired modes are framed."))
    return charts


def _frac(found: MachineUpdate) -> list[Table]:
    b, a = found.before.frac, found.after.frac
    if b is None or a is None:
        return []
    rows = [[name, f"{one.min():.4f}", f"{one.mean():.4f}"] for name, one in (("before", b), ("after", a))]
    return [Table(["FRAC", "lowest", "mean"], rows, "Over all measured responses and lines")]


def _shapes(before: Machine, found: MachineUpdate, pose: Mapping[str, float] | None) -> ShapeView:
    scene, shapes = machine_shapes(before, pose, before.size)
    other, moved = machine_shapes(found.machine, pose, before.size)
    if found.before.modes.size:
        shapes, moved = shapes.selected(found.before.modes.tolist()), moved.selected(found.after.modes.tolist())
    else:
        shapes = shapes.selected(range(min(12, shapes.count)))
        moved = moved.selected(partners(shapes, moved))
    return ShapeView(scene, shapes, "pair", "before", "Shapes that belong to one measured mode, or else look alike.",
                     (other, turned_alike(moved, shapes), "after"))


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
