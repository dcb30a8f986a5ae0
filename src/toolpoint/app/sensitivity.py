"""`toolpoint sensitivity`: what every parameter of a machine file does to its frequencies, damping and shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.app import console
from toolpoint.app.poses import machine_at
from toolpoint.machine import Machine
from toolpoint.plot import Chart, Notes, Report, ShapeView, Table
from toolpoint.plot.figures.sensitivity import cumulative_bars, sensitivity_map
from toolpoint.plot.shape_view.machine_scene import machine_shapes
from toolpoint.studies.sensitivity_study import SensitivityStudy, sensitivity_study

_ROWS = 40
_SHOWN = 5e-4
_KINDS = ("stiffness", "modulus", "mass", "density", "damping", "loss_factor")


def sensitivity(
    machine: str | Path, paths: Sequence[str] = (), modes: int = 6, change: float = 0.1,
    pose: Mapping[str, float] | None = None, output: str | Path = "toolpoint-report", quiet: bool = False,
) -> SensitivityStudy:
    """Study a machine file, print the table, and write the page; MAC values are given for `change` of each parameter."""
    with console.steps(2, quiet) as step, console.collected_warnings() as warnings:
        step("sensitivities")
        built = machine_at(machine, pose)
        found = sensitivity_study(built, paths or None, min(modes, built.size), pose)
        step("page")
        path = page(found, built, change, pose, warnings).save(output)
    if not quiet:
        console.OUT.print(found.table(), markup=False, soft_wrap=True)
        for text in warnings:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        console.OUT.print(f"Page written: {path}", markup=False)
    return found


def page(found: SensitivityStudy, machine: Machine, change: float = 0.1, pose: Mapping[str, float] | None = None,
         warnings: Sequence[str] = ()) -> Report:
    """Return the page of a study."""
    report = Report(f"Sensitivities of {machine.name}", _summary(found), subtitle=f"{len(found.paths)} parameters")
    order = _largest(np.abs(found.frequency).max(axis=1))
    names = [found.paths[k] for k in order]
    some = (f" The {len(order)} largest of {len(found.paths)} are shown; the others move no frequency by more than "
            f"{np.sort(np.abs(found.frequency).max(axis=1))[-len(order) - 1]:.2g}." if len(order) < len(found.paths) else "")
    report = report.with_section(
        "Frequencies, parameter by parameter",
        Chart(sensitivity_map(found.frequency[order], names, found.frequencies, quantity="(p/f) df/dp"),
              "Per cent of frequency per per cent of the parameter; a sole spring would have 0.5, a sole mass -0.5." + some))
    report = report.with_section("Frequencies, part by part", *_cumulated(found))
    report = report.with_section("Shapes", *_shapes(found, change))
    if np.any(found.damping):
        damped = np.argsort(-np.abs(found.damping).max(axis=1), kind="stable")[:_ROWS]
        damped = damped[np.abs(found.damping[damped]).max(axis=1) > 0]
        report = report.with_section("Damping", Chart(
            sensitivity_map(100 * found.damping[damped], [found.paths[k] for k in damped], found.frequencies,
                            quantity="p dζ/dp, %"), "Change of the damping ratio in points of per cent per unit of dp/p."))
    scene, shapes = machine_shapes(machine, pose, found.frequencies.size)
    report = report.with_section("The modes", ShapeView(scene, shapes, "modes"))
    rows = [[path, float(value), *map(float, row)] for path, value, row in zip(
        found.paths, found.values, found.frequency, strict=True)]
    report = report.with_section("All numbers", Table(
        ["parameter", "value (SI)", *(f"{f:.3f} Hz" for f in found.frequencies)], rows, "Relative sensitivity of frequency"))
    return report.with_section("Warnings", Notes(warnings, "warning")) if warnings else report


def _largest(size: FloatArray) -> np.ndarray:
    """Return the parameters to draw, the largest first: what would show as an empty row is left out."""
    order = np.argsort(-size, kind="stable")[:_ROWS]
    shown = order[size[order] >= _SHOWN]
    return shown if shown.size else order


def _summary(found: SensitivityStudy) -> str:
    parts = found.cumulative("stiffness") or found.cumulative()
    words = []
    for k, f in enumerate(found.frequencies):
        best = max(parts, key=lambda part: abs(float(parts[part][k])))
        words.append(f"{f:.2f} Hz by {best.split('.')[1]} ({parts[best][k]:+.2f})")
    return "Which part's stiffness moves each frequency most: " + ", ".join(words) + "."


def _cumulated(found: SensitivityStudy) -> list[Chart]:
    charts = []
    for kind in (k for k in _KINDS if k in found.kinds):
        parts = {name.split(".")[1]: row for name, row in found.cumulative(kind).items()}
        if any(np.any(row) for row in parts.values()):
            title = kind.replace("_", " ")
            charts.append(Chart(cumulative_bars(parts, found.frequencies, quantity="(p/f) df/dp", title=title)))
    return charts


def _shapes(found: SensitivityStudy, change: float) -> list[Chart | Table]:
    lost = 1 - found.mac_after(change)
    order = _largest(lost.max(axis=1)) if lost.max() > 1e-9 else np.zeros(0, int)
    words = f"1 - MAC between each shape and itself after {100 * change:+.3g} % of the parameter, to second order."
    charts: list[Chart | Table] = []
    if len(order):
        charts.append(Chart(sensitivity_map(lost[order], [found.paths[k] for k in order], found.frequencies, quantity="1 - MAC",
                                            diverging=False), words))
    kinds = [k for k in _KINDS if k in found.kinds]
    rows = [[part, kind, *(f"{v:.4f}" for v in 1 - (row * change) ** 2)] for kind in kinds
            for part, row in found.cumulative_shape(kind).items() if np.any(row > 1e-6)]
    return [*charts, Table(["part", "kind", *(f"MAC, {f:.2f} Hz" for f in found.frequencies)], rows,
                           f"All parameters of a part and kind changed together by {100 * change:+.3g} %")]
