"""Identification from files: reading, the page, and the table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.io import frf_files, geometry_files, hdf5
from toolpoint.modal_identification import Identification, cmif, identify, residues
from toolpoint.plot import AnimatedShapes, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.correlation import mac_matrix
from toolpoint.plot.figures.frf import bode
from toolpoint.plot.figures.stabilization import indicators, stabilization
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import auto_mac
from toolpoint.vibration.geometry import Geometry

LEGEND = ("share: part of the responses at its frequency that a mode carries, with those that overlap and look like it; "
          "* stands out, ? doubtful")


def identify_files(
    files: Sequence[str | Path], geometry: str | Path | None = None, modes_file: str | Path | None = None,
    output: str | Path = "toolpoint-report", method: str = "refined", band: tuple[float, float] | None = None,
    quantity: str | None = None, quiet: bool = False,
) -> Identification:
    """Identify the modes of measured FRFs, print the table, write the page, and save the modes where asked to."""
    if modes_file is not None and not Path(modes_file).parent.is_dir():
        raise ToolpointError(f"{modes_file}: the folder {Path(modes_file).parent} does not exist; create it first")
    with console.steps(4, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        frf = frf_files.read(files, quantity=quantity)
        shape = None if geometry is None else geometry_files.read(geometry)
        step("identification")
        found = identify(frf, method, band)
        step("page")
        path = page(found, shape, [Path(f).name for f in files], warnings).save(output)
        if modes_file is not None:
            hdf5.write(found.modes, modes_file)
    if quiet:
        return found
    console.OUT.print(found.table(), markup=False)
    console.OUT.print(LEGEND, markup=False)
    console.OUT.print(found.status, markup=False)
    for text in [*warnings, *(note for note in frf.notes if not any(note in told for told in warnings))]:
        console.ERR.print("warning: " + console.spelled(text), markup=False, style="yellow")
    if modes_file is not None:
        console.OUT.print(f"Modes saved: {modes_file}", markup=False)
    console.OUT.print(f"Page written: {path}", markup=False)
    return found


def page(found: Identification, geometry: Geometry | None, names: Sequence[str], warnings: Sequence[str] = ()) -> Report:
    """Return the page of an identification."""
    report = Report("Modal identification", found.status.split("\n")[0], subtitle=", ".join(names))
    report = report.with_section("Modes", _table(found), *([Notes(found.advice, "warning", "What to try next")]
                                                           if found.advice else []))
    parts: list[Chart | ShapeView | str] = []
    shapes: list[int] | None = None
    if geometry is not None:
        scene = Scene.of_points(geometry.points, geometry.lines)
        report = report.with_section("Mode shapes", ShapeView(scene, AnimatedShapes.from_modes(found.modes, geometry.points),
                                                              "modes", "Identified modes"))
        shapes, view = _pole_shapes(found, geometry, scene)
        if view is not None:
            parts.append(view)
    if found.diagram is not None:
        chart = Chart(stabilization(found.diagram, cmif(found.frf), shapes), name="stabilization",
                      caption="A click on a stable pole shows its shape." if parts else "",
                      click_view="poles" if parts else "")
        report = report.with_section("Stabilization diagram", chart, *parts)
    report = report.with_section("Mode indicator", Chart(indicators(cmif(found.frf))))
    report = report.with_section("Measured and synthesised", *_fits(found))
    if len(found.modes.dofs) > 1:  # of one response every MAC is 1
        report = report.with_section("AutoMAC", Chart(mac_matrix(auto_mac(found.modes.shape), found.modes, found.modes)))
    notes = [*warnings, *found.frf.notes]
    return report.with_section("Remarks", Notes(notes, "warning")) if notes else report


def plain(found: Identification) -> dict[str, Any]:
    """Return the modes of an identification as plain lists, for JSON; None where an interval is unknown."""
    modes, strongest = found.modes, found.dominant.tolist()
    result: dict[str, Any] = {"frequency_hz": modes.frequency.tolist(), "damping_ratio": modes.damping_ratio.tolist()}
    if modes.covariance is not None:
        for name, widths in (("frequency_interval_hz", modes.frequency_interval), ("damping_interval", modes.damping_interval)):
            result[name] = [width if np.isfinite(width) else None for width in widths.tolist()]
    return result | {"fit": found.mode_quality.tolist(), "share": found.share.tolist(), "doubtful": found.doubtful.tolist(),
                     "stands_out": [i in strongest for i in range(modes.count)], "status": found.status}


def _table(found: Identification) -> Table:
    modes = found.modes
    header = ["mode", "frequency Hz", "damping %", "fit %"]
    if modes.covariance is not None:
        header += ["+- Hz (95 %)", "+- % (95 %)"]
    header += ["share %", ""]
    words = np.where(found.doubtful, "doubtful", "").astype(object)
    words[found.dominant] = "stands out"
    rows = []
    for i in range(modes.count):
        row: list[object] = [i + 1, round(float(modes.frequency[i]), 4), round(100 * float(modes.damping_ratio[i]), 4),
                             round(100 * float(found.mode_quality[i]), 3)]
        if modes.covariance is not None:
            widths = float(modes.frequency_interval[i]), 100 * float(modes.damping_interval[i])
            row += [float(f"{width:.2g}") if np.isfinite(width) else "unknown" for width in widths]
        rows.append([*row, round(100 * float(found.share[i]), 1), words[i]])
    caption = (f"Method: {found.method}. Share: of the responses at its frequency that a mode moves, together with neighbours "
               "that overlap and look like it; the strongest of those that move more than half stand out.")
    return Table(header, rows, caption, digits=6)


def _fits(found: Identification) -> list[Chart]:
    worst = np.unravel_index(int(np.argmin(found.quality)), found.quality.shape)
    best = np.unravel_index(int(np.argmax(found.quality)), found.quality.shape)
    charts = []
    for words, (row, column) in (("worst ", worst), ("best ", best))[:1 if worst == best else 2]:
        pair = {"measured": found.frf.selected([int(row)], [int(column)]),
                "synthesised": found.synthesis.selected([int(row)], [int(column)])}
        title = f"{found.frf.outputs[int(row)]} / {found.frf.inputs[int(column)]}: {'' if worst == best else words}fit, "
        charts.append(Chart(bode(pair, modes=found.modes, title=title + f"{100 * found.quality[row, column]:.2f} %")))
    return charts


def _pole_shapes(found: Identification, geometry: Geometry, scene: Scene) -> tuple[list[int] | None, ShapeView | None]:
    """Return for every pole of the diagram its place in a view of the stable poles' own shapes, and the view."""
    diagram = found.diagram
    if diagram is None or not (diagram.level == 3).any():
        return None, None
    numbers = np.full(diagram.poles.size, -1)
    poles: list[complex] = []
    shapes, labels = [], []
    for order in diagram.orders:
        at = np.flatnonzero((diagram.order == order) & (diagram.level == 3))
        if at.size == 0:
            continue
        parts = residues(found.frf, diagram.poles[at]).values
        strongest = np.argmax(np.abs(parts).sum(axis=0), axis=0)
        for k, pole in enumerate(at):
            numbers[pole] = len(poles)
            poles.append(diagram.poles[pole])
            shapes.append(parts[:, strongest[k], k])
            labels.append(f"order {order}")
    s = np.array(poles)
    modes = Modes(np.abs(s) / (2 * np.pi), -s.real / np.abs(s), np.stack(shapes, axis=1), found.frf.outputs, "unscaled")
    view = ShapeView(scene, AnimatedShapes.from_modes(modes, geometry.points, labels), "poles", "Shape of the pole chosen")
    return numbers.tolist(), view
