"""`toolpoint joints`: measured responses or modes in, joints and a minimal machine out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.io import frf_files, geometry_files, mode_files
from toolpoint.io.yaml import component_file
from toolpoint.io.yaml import machine_file as machine_yaml
from toolpoint.joint_identification import JointIdentification, identify_joints
from toolpoint.machine import MachineDescription, build
from toolpoint.machine.shapes import body_shapes
from toolpoint.modal_identification import identify, real_modes
from toolpoint.plot import AnimatedShapes, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.joint_views import joint_views
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.joint_machine import component_masses, machine_of
from toolpoint.studies.model_correlation import correlate
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry

_HEADER = ["mode", "computed Hz", "measured Hz", "difference %", "MAC"]


@dataclass(frozen=True, eq=False)
class JointRun:
    """Joints, the modes they came from, and the machine where masses were known."""

    joints: JointIdentification
    modes: Modes
    machine: MachineDescription | None


def joints(
    files: Sequence[str | Path], geometry: str | Path, components: str | Path, machine_file: str | Path | None = None,
    band: tuple[float, float] | None = None, output: str | Path = "toolpoint-report", quiet: bool = False,
    coordinate_deviation: float = 0.0,
) -> JointRun:
    """Identify the joints of a machine from measured FRFs (or saved modes), write a machine file that runs, and a page.

    `coordinate_deviation` is the standard deviation of the points' coordinates, m.
    """
    with console.steps(4, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        shape = geometry_files.read(geometry)
        described, bodies = component_file.read(components)
        step("modes")
        modes = _modes(files, band)
        step("joints")
        real = real_modes(modes)
        found = identify_joints(real, shape.points, described.points(), chain=described.chain,
                                masses=component_masses(bodies) if bodies else None, coordinate_deviation=coordinate_deviation)
        machine = machine_of(described.name, found, bodies, real, shape.points, described.points()) if bodies else None
        if machine_file is not None:
            if machine is None:
                raise ToolpointError(f"{components}: no mass properties; a machine file needs the body of every component")
            machine_yaml.write(machine, machine_file)
        step("page")
        path = _page(described, shape, found, modes, machine, warnings).save(output)
    if not quiet:
        console.OUT.print(found.table(), markup=False, soft_wrap=True)
        console.OUT.print(found.status, markup=False)
        for text in warnings:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        if machine is not None:
            console.table("The machine of these joints", _HEADER, _rows(machine, modes))
        if machine_file is not None:
            console.OUT.print(f"Machine file written: {machine_file}", markup=False)
        console.OUT.print(f"Page written: {path}", markup=False)
    return JointRun(found, modes, machine)


def _modes(files: Sequence[str | Path], band: tuple[float, float] | None) -> Modes:
    if len(files) == 1 and mode_files.holds_modes(files[0]):
        return mode_files.read(files[0])
    return identify(frf_files.read(files), band=band).modes


def _rows(machine: MachineDescription, modes: Modes) -> list[list[str]]:
    """Return the computed modes beside the measured ones that look like them, then the measured ones without a partner."""
    built = build(machine)
    found = correlate(built, real_modes(modes))
    partner = {int(j): int(i) for i, j in found.pairs.pairs}
    rows = []
    for j, computed in enumerate(body_shapes(built).frequency):
        row = [str(j + 1), f"{computed:.3f}", "", "", ""]
        if j in partner:
            measured = modes.frequency[partner[j]]
            row[2:] = f"{measured:.3f}", f"{100 * (computed / measured - 1):+.2f}", f"{found.mac[partner[j], j]:.3f}"
        rows.append(row)
    return rows + [["no partner", "", f"{modes.frequency[i]:.3f}", "", ""] for i in found.pairs.single_first]


def _page(described: component_file.Components, shape: Geometry, found: JointIdentification, modes: Modes,
          machine: MachineDescription | None, warnings: Sequence[str]) -> Report:
    report = Report(f"Joints of {described.name}", found.status, subtitle=" - ".join(described.chain))
    rows = []
    for one in found.joints:
        stiff = "" if one.stiffness is None or one.stiffness_interval is None else ", ".join(
            f"{way} {k:.4g} ± {h:.2g}" for way, k, h in zip(one.freedoms, one.stiffness, one.stiffness_interval, strict=True))
        rows.append([f"{one.parent} - {one.child}", one.kind, ", ".join(one.freedoms), one.position_text, stiff, one.status])
    header = ["joint", "kind", "free", "position mm (95 %)", "stiffness N m/rad or N/m (95 %)", "status"]
    views = Chart(joint_views(shape.points, described.points(), found.joints),
                  "Crosses: joints; lines: their free directions; dots: measured points by component.")
    report = report.with_section("Joints", Table(header, rows), views)
    scene = Scene.of_points(shape.points, shape.lines, components=described.points())
    shapes = AnimatedShapes.from_modes(modes, shape.points)
    report = report.with_section("Measured mode shapes", ShapeView(scene, shapes, "measured"))
    if machine is not None:
        built = build(machine)
        drawn, moved = machine_shapes(built, {}, min(12, built.size))
        report = report.with_section("The machine of these joints", Table(_HEADER, _rows(machine, modes)),
                                     ShapeView(drawn, moved, "model"))
    doubts = [*warnings, *found.doubts, *(text for one in found.joints for text in one.doubts)]
    return report.with_section("Doubts", Notes(list(dict.fromkeys(doubts)), "warning")) if doubts else report
