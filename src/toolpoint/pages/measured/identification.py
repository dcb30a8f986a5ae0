"""The page of a modal identification: modes, shapes, diagram, measured beside synthesised, AutoMAC."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.modal_identification import Identification, cmif, residues
from toolpoint.plot import AnimatedShapes, Chart, Notes, Report, Scene, ShapeView, Table
from toolpoint.plot.figures.correlation import mac_matrix
from toolpoint.plot.figures.frf import bode
from toolpoint.plot.figures.stabilization import indicators, stabilization
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import auto_mac
from toolpoint.vibration.geometry import Geometry


def identification_page(result: Identification, geometry: Geometry | None = None, names: Sequence[str] = (),
                        *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of an identification."""
    report = Report("Modal identification", result.status.split("\n")[0], subtitle=", ".join(names))
    report = report.with_doubts(*result.doubts, *warnings, *result.frf.notes)
    report = report.with_section("Modes", _table(result), *([Notes(result.advice, "warning", "What to try next")]
                                                           if result.advice else []))
    parts: list[Chart | ShapeView | str] = []
    shapes: list[int] | None = None
    if geometry is not None:
        scene = Scene.of_points(geometry.points, geometry.lines)
        report = report.with_section("Mode shapes", ShapeView(scene, AnimatedShapes.from_modes(result.modes, geometry.points),
                                                              "modes", "Identified modes"))
        shapes, view = _pole_shapes(result, geometry, scene)
        if view is not None:
            parts.append(view)
    if result.diagram is not None:
        chart = Chart(stabilization(result.diagram, cmif(result.frf), shapes), name="stabilization",
                      caption="A click on a stable pole shows its shape." if parts else "",
                      click_view="poles" if parts else "")
        report = report.with_section("Stabilization diagram", chart, *parts)
    report = report.with_section("Mode indicator", Chart(indicators(cmif(result.frf))))
    report = report.with_section("Measured and synthesised", *_fits(result))
    if len(result.modes.dofs) > 1:  # of one response every MAC is 1
        report = report.with_section("AutoMAC", Chart(mac_matrix(auto_mac(result.modes.shape), result.modes, result.modes)))
    return report


def _table(result: Identification) -> Table:
    modes = result.modes
    header = ["mode", "frequency Hz", "damping %", "fit %"]
    if modes.covariance is not None:
        header += ["+- Hz (95 %)", "+- % (95 %)"]
    header += ["share %", ""]
    words = np.where(result.doubtful, "doubtful", "").astype(object)
    words[result.dominant] = "stands out"
    rows = []
    for i in range(modes.count):
        row: list[object] = [i + 1, round(float(modes.frequency[i]), 4), round(100 * float(modes.damping_ratio[i]), 4),
                             round(100 * float(result.mode_quality[i]), 3)]
        if modes.covariance is not None:
            widths = float(modes.frequency_interval[i]), 100 * float(modes.damping_interval[i])
            row += [float(f"{width:.2g}") if np.isfinite(width) else "unknown" for width in widths]
        rows.append([*row, round(100 * float(result.share[i]), 1), words[i]])
    caption = (f"Method: {result.method}. Share: of the responses at its frequency that a mode moves, together with neighbours "
               "that overlap and look like it; the strongest of those that move more than half stand out.")
    return Table(header, rows, caption, digits=6)


def _fits(result: Identification) -> list[Chart]:
    worst = np.unravel_index(int(np.argmin(result.quality)), result.quality.shape)
    best = np.unravel_index(int(np.argmax(result.quality)), result.quality.shape)
    charts = []
    for words, (row, column) in (("worst ", worst), ("best ", best))[:1 if worst == best else 2]:
        pair = {"measured": result.frf.selected([int(row)], [int(column)]),
                "synthesised": result.synthesis.selected([int(row)], [int(column)])}
        title = f"{result.frf.outputs[int(row)]} / {result.frf.inputs[int(column)]}: {'' if worst == best else words}fit, "
        charts.append(Chart(bode(pair, modes=result.modes, title=title + f"{100 * result.quality[row, column]:.2f} %")))
    return charts


def _pole_shapes(result: Identification, geometry: Geometry, scene: Scene) -> tuple[list[int] | None, ShapeView | None]:
    """Return for every pole of the diagram its place in a view of the stable poles' own shapes, and the view."""
    diagram = result.diagram
    if diagram is None or not (diagram.level == 3).any():
        return None, None
    numbers = np.full(diagram.poles.size, -1)
    poles: list[complex] = []
    shapes, labels = [], []
    for order in diagram.orders:
        at = np.flatnonzero((diagram.order == order) & (diagram.level == 3))
        if at.size == 0:
            continue
        parts = residues(result.frf, diagram.poles[at]).values
        strongest = np.argmax(np.abs(parts).sum(axis=0), axis=0)
        for k, pole in enumerate(at):
            numbers[pole] = len(poles)
            poles.append(diagram.poles[pole])
            shapes.append(parts[:, strongest[k], k])
            labels.append(f"order {order}")
    s = np.array(poles)
    modes = Modes(np.abs(s) / (2 * np.pi), -s.real / np.abs(s), np.stack(shapes, axis=1), result.frf.outputs, "unscaled")
    view = ShapeView(scene, AnimatedShapes.from_modes(modes, geometry.points, labels), "poles", "Shape of the pole chosen")
    return numbers.tolist(), view
