"""Charts of drives: enlarged contour error, histories, and Bode diagrams of loops with their margins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.drives.accuracy.contour import ContourError
from toolpoint.drives.controller.loops import LoopLevel
from toolpoint.drives.simulation.simulate import ServoResult
from toolpoint.plot.figures.theme import COLOURS, figure, plain
from toolpoint.plot.figures.thinning import thin_curve

if TYPE_CHECKING:
    import plotly.graph_objects as go

_MAX_PATH_POINTS = 3000  # points of a drawn path


def path_with_error(errors: dict[str, ContourError], factor: float = 50.0, title: str = "") -> go.Figure:
    """Return the commanded path and, for each name, the path with its contour error drawn `factor` times enlarged (mm)."""
    chart = figure(title, 640)
    first = next(iter(errors.values()))
    step = max(1, len(first.foot) // _MAX_PATH_POINTS)
    chart.add_scatter(x=1e3 * first.foot[::step, 0], y=1e3 * first.foot[::step, 1], name="command", mode="lines",
                     line={"color": "rgba(127,127,127,0.7)", "width": 1, "dash": "dash"})
    for k, (name, error) in enumerate(errors.items()):
        points = 1e3 * error.enlarged(factor)[::step]
        chart.add_scatter(x=points[:, 0], y=points[:, 1], name=f"{plain(name)}, error × {factor:g}", mode="lines",
                         line={"color": COLOURS[k % len(COLOURS)], "width": 1.5}, customdata=1e6 * error.length[::step],
                         hovertemplate="%{customdata:.2f} µm")
    chart.update_xaxes(title_text="x, mm", constrain="domain")
    chart.update_yaxes(title_text="y, mm", scaleanchor="x")
    return chart


def histories(result: ServoResult, errors: dict[str, ContourError]) -> dict[str, go.Figure]:
    """Return charts over time: contour error, torque set point, following error."""
    contour = figure("", 340)
    for k, (name, error) in enumerate(errors.items()):
        time, length = thin_curve(result.time, 1e6 * error.length)
        contour.add_scatter(x=time, y=length, name=plain(name), line={"color": COLOURS[k % len(COLOURS)]})
    charts = {"Contour error": (contour, "Contour error, µm")}
    for words, name, factor, unit in (("Torque", "torque_set", 1.0, "Torque set point, N m"),
                                      ("Following error", "following_error", 1e6, "Following error, µm")):
        chart = figure("", 340)
        for k, axis in enumerate(result.axes):
            time, signal = thin_curve(result.time, factor * result.signal(name, axis))
            chart.add_scatter(x=time, y=signal, name=axis, line={"color": COLOURS[k % len(COLOURS)]})
        charts[words] = (chart, unit)
    for chart, unit in charts.values():
        chart.update_xaxes(title_text="Time, s")
        chart.update_yaxes(title_text=unit)
    return {words: chart for words, (chart, _) in charts.items()}


def friction_points(velocity: FloatArray, load: FloatArray, force_unit: str, *, unit: str) -> go.Figure:
    """Return the mean load at every constant speed; velocities in m/s or rad/s, by `unit` (m, rad)."""
    chart = figure("", 340)
    factor, words = (180 / np.pi, "°/s") if unit == "rad" else (1e3, "mm/s")
    chart.add_scatter(x=factor * velocity, y=load, mode="markers", name="load", marker={"color": COLOURS[0]})
    chart.update_xaxes(title_text=f"Speed, {words}")
    chart.update_yaxes(title_text=f"Load, {plain(force_unit) or '-'}")
    return chart


def loop_bode(level: LoopLevel, axis: int, name: str) -> go.Figure:
    """Return open and closed loop of one axis: magnitude in dB over phase in deg."""
    from plotly.subplots import make_subplots

    # A sampled loop has a response up to half its sampling rate only.
    nyquist_frequency = 0.5 / float(level.closed.sample_time or 1.0)
    f = np.geomspace(nyquist_frequency * 1e-4, 0.99 * nyquist_frequency, 600)
    chart = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    chart.update_layout(figure(f"{level.name} loop, axis {plain(name)}", 480).layout)
    for k, (words, values) in enumerate((("open", level.open_response(f, axis)), ("closed", level.closed_response(f, axis)))):
        line = {"color": COLOURS[k]}
        chart.add_scatter(x=f, y=20 * np.log10(np.maximum(np.abs(values), 1e-12)), name=words, line=line, row=1, col=1)
        chart.add_scatter(x=f, y=_phase(values), name=words, line=line, showlegend=False, row=2, col=1)
    chart.update_xaxes(type="log", title_text="Frequency, Hz", row=2, col=1)
    chart.update_xaxes(type="log", row=1, col=1)
    chart.update_yaxes(title_text="Magnitude, dB", row=1, col=1)
    chart.update_yaxes(title_text="Phase, °", row=2, col=1)
    return chart


def _phase(values: ComplexArray) -> FloatArray:
    """Return the unwrapped phase, deg."""
    return np.degrees(np.unwrap(np.angle(values)))
