"""The commands as Python functions of the same name and options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.app import console, machine_page, measured_page
from toolpoint.app.poses import machine_at
from toolpoint.cutting import ZeroOrder
from toolpoint.io.yaml import machine_file
from toolpoint.machine import Machine
from toolpoint.machine.shapes import body_shapes
from toolpoint.plot import Listing, Notes, Report, ShapeView
from toolpoint.plot.shape_view.machine_scene import machine_shapes

DEMO, DEMO_DRIVES = "three_axis_vertical.yaml", "three_axis_vertical_drives.yaml"
Pose = Mapping[str, float]


def demo(output: str | Path = "toolpoint-report", quiet: bool = False) -> Path:
    """Build the published three-axis machine, compare it with its paper, and write the page; return the page's path."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder, \
            console.steps(6, quiet) as step, console.collected_warnings() as warnings:
        step("machine")
        casting = machine_page.only_modes(machine_file.read(folder / DEMO))
        step("machine with feed drives")
        # The quickest method: nobody wants to wait for a compiler on the first page.
        drives = machine_page.computed(machine_file.read(folder / DEMO_DRIVES), None, step, ZeroOrder())
        step("page")
        path = _demo_page(casting, drives, folder, warnings).save(output)
    _show(casting, ())
    size, frequency = drives.machine.size, drives.frequency
    console.OUT.print(f"With feed drives: {size} degrees of freedom, {frequency[0]:.2f} .. {frequency[-1]:.1f} Hz")
    _show_limits(drives, warnings)
    console.OUT.print(f"Page written: {path}")
    return path


def _demo_page(casting: machine_page.MachineResults, drives: machine_page.MachineResults, folder: Path,
               warnings: Sequence[str]) -> Report:
    page = machine_page.machine_report(casting, (folder / DEMO).read_text(encoding="utf-8"), DEMO)
    inputs, page = page.sections[-1], replace(page, sections=page.sections[:-1])
    scene, shapes = machine_shapes(drives.machine, {}, 18)
    page = page.with_section(
        "With feed drives", f"The same casting with its feed drives has {drives.machine.size} degrees of freedom, as table 2 "
        "of the paper counts them. The stiffnesses of the drives are chosen, not published. Tool-point responses and stability "
        "below are those of this machine.", ShapeView(scene, shapes, "drives", drives.machine.name))
    page = machine_page.with_responses(page, drives)
    more = [note for note in drives.machine.description.assumptions if note not in casting.machine.description.assumptions]
    parts = [Notes(warnings, "warning")] if warnings else []
    text = (folder / DEMO_DRIVES).read_text(encoding="utf-8")
    return page.with_section(inputs.title, *parts, *inputs.parts, Notes(more, "assumed", "Also assumed for the feed drives"),
                             Listing(f"Machine file {DEMO_DRIVES}", text))


def report(
    machine: str | Path | None = None, pose: Pose | None = None, frf: Sequence[str | Path] = (),
    output: str | Path = "toolpoint-report", quantity: str | None = None, band: tuple[float, float] | None = None,
    quiet: bool = False,
) -> Path:
    """Write the page of a user's machine, of measured FRFs, or of both; return its path."""
    if machine is None and not frf:
        raise ToolpointError("report: neither a machine file nor --frf given; needs at least one of them")
    with console.steps(6, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        built = None if machine is None else machine_at(machine, pose)
        page = Report("Measured frequency responses", subtitle=", ".join(Path(f).name for f in frf))
        results = None
        if built is not None:
            results = machine_page.computed(built, pose, step)
            page = machine_page.machine_report(results, Path(machine).read_text(encoding="utf-8-sig"),  # type: ignore[arg-type]
                                               Path(machine).name, warnings)  # type: ignore[arg-type]
        elif pose:
            raise ToolpointError("--pose: needs a machine file to be applied to")
        measured = None
        if frf:
            step("measured responses")
            before = len(warnings)
            cut = None if built is None else built.description.cutting
            measured = measured_page.computed(measured_page.read(frf, quantity, band), cut)
            page = measured_page.with_measured(page, measured, warnings[before:])
        step("page")
        path = page.save(output)
    _show(results, warnings)
    if measured is not None:
        _show_measured(measured)
    console.OUT.print(f"Page written: {path}")
    return path


def check(machine: str | Path) -> Machine:
    """Read a machine file, raise all its faults at once, and return the machine."""
    return machine_file.read(machine)


def modes(machine: str | Path, pose: Pose | None = None, count: int = 12) -> np.ndarray:
    """Return the natural frequencies (Hz) of a machine file at a pose."""
    return body_shapes(machine_at(machine, pose), dict(pose or {}), count).frequency


def _show(results: machine_page.MachineResults | None, warnings: Sequence[str]) -> None:
    if results is not None:
        header, rows = machine_page.comparison(results)
        console.table(results.machine.name, header, [[_text(v, name) for v, name in zip(row, header, strict=True)]
                                                     for row in rows])
        for line in _sources(results.machine):
            console.OUT.print(line, markup=False)
        for text in results.missing:
            console.OUT.print(text, markup=False)
        _show_limits(results, warnings)


def _show_limits(results: machine_page.MachineResults, warnings: Sequence[str]) -> None:
    for pose, chart in zip(results.study.poses if results.study else (), results.charts, strict=False):
        limit = float(np.min(chart.limit))
        words = f"{1e3 * limit:.3f} mm" if np.isfinite(limit) else f"above {1e3 * chart.depth_max:.3g} mm"
        console.OUT.print(f"Stable at every charted speed, {machine_page.pose_name(pose)}: {words}", markup=False)
    for text in warnings:
        console.ERR.print("warning: " + text, markup=False, style="yellow")


def _sources(machine: Machine) -> list[str]:
    lines = []
    for mark in ("published", "measured", "chosen", "assumed"):
        names = [f"joint {n}" for n, j in machine.description.joints.items() if j.source == mark]
        names += [f"body {n}" for n, b in machine.description.bodies.items() if b.source == mark]
        names += [r.name for r in machine.description.reference if r.source == mark]
        if names:
            lines.append(f"{mark}: {', '.join(names)}")
    return lines


def _text(value: Any, column: str) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:+.2f}" if column.startswith("to ") else f"{value:.2f}"


def _show_measured(results: measured_page.MeasuredResults) -> None:
    if results.modes is not None:
        rows = [[str(i + 1), f"{results.modes.frequency[i]:.1f}", f"{100 * results.modes.damping_ratio[i]:.2f}"]
                for i in range(results.modes.count)]
        console.table("Modes by quadrature picking", ["mode", "frequency Hz", "damping %"], rows)
    if results.chart is not None:
        limit = float(np.min(results.chart.limit))
        console.OUT.print(f"Lobes from the measured FRF: stable at every charted speed below {1e3 * limit:.3f} mm",
                          markup=False)
    for note in results.notes:
        console.OUT.print("note: " + note, markup=False)
