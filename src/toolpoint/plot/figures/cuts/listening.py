"""Charts of a listened cut: spectrogram with orders and chatter lines, spectrum with named lines, growth, samples each turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.signals.orders.growth import PowerCourse
from toolpoint.signals.orders.line_spectrum import LineSpectrum, SpectralLines

if TYPE_CHECKING:
    import plotly.graph_objects as go

MAX_TIMES, MAX_FREQUENCIES = 240, 260  # cells of a spectrogram
MAX_SPECTRUM_POINTS = 5000  # of a spectrum
SHOWN_DECIBELS = 70.0  # below the largest
MAX_ORDER_LINES = 12  # tooth passings drawn


def spectrogram(samples: FloatArray, rate: float, tooth: float, *, chatter: FloatArray, highest: float, start: float = 0.0
                ) -> go.Figure:
    """Return power over time and frequency, dB below the largest, with tooth passings and chatter lines at the right edge."""
    from scipy.signal import spectrogram as compute

    # Eighty milliseconds: lines 12 Hz apart are told apart, and chatter that grows within a tenth of a second is seen to.
    size = int(min(max(0.08 * rate, 256), samples.size))
    frequency, time, power = compute(samples, rate, window="hann", nperseg=size, noverlap=size // 2)
    kept = frequency <= highest
    power, frequency = power[kept], frequency[kept]
    power, frequency = _thinned(power, frequency, MAX_FREQUENCIES)
    turned, time = _thinned(power.T, time, MAX_TIMES)
    level = 10 * np.log10(np.maximum(turned.T / max(float(turned.max()), 1e-300), 1e-12))
    chart = figure("", 420)
    chart.add_heatmap(x=np.round(start + time, 4), y=np.round(frequency, 1), z=np.round(level, 1), zmin=-SHOWN_DECIBELS, zmax=0,
                      colorscale="Viridis", colorbar={"title": {"text": "dB"}, "thickness": 12},
                      hovertemplate="%{x:.2f} s<br>%{y:.0f} Hz<br>%{z:.0f} dB<extra></extra>")
    edge = float(start + time[-1])
    passings = tooth * np.arange(1, min(int(highest / tooth), MAX_ORDER_LINES) + 1)
    _mark(chart, edge, passings, "tooth passing", "triangle-left", "rgba(240,240,240,0.95)")
    _mark(chart, edge, chatter[chatter <= highest], "chatter and side bands", "x", COLOURS[1])
    chart.update_xaxes(title_text="Time, s")
    chart.update_yaxes(title_text="Frequency, Hz", range=[0, highest])
    return chart


def _mark(chart: go.Figure, edge: float, frequency: FloatArray, name: str, symbol: str, colour: str) -> None:
    if frequency.size:
        chart.add_scatter(x=np.full(frequency.size, edge), y=frequency, mode="markers", name=name,
                          marker={"symbol": symbol, "size": 9, "color": colour, "line": {"width": 1, "color": "#444"}},
                          hovertemplate="%{y:.1f} Hz<extra>" + name + "</extra>")


def _thinned(values: FloatArray, axis: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return rows joined in groups by their largest value, so that a narrow line stays."""
    step = -(-values.shape[0] // count)
    if step == 1:
        return values, axis
    starts = np.arange(0, values.shape[0], step)
    return np.maximum.reduceat(values, starts, axis=0), axis[starts]


def draw_spectrum(spectrum: LineSpectrum, tooth: float, chatter: SpectralLines | None, *, background: SpectralLines,
                  highest: float) -> go.Figure:
    """Return the spectrum with tooth passings, chatter lines and lines that are there without the cut marked."""
    kept = spectrum.frequency <= highest
    power, frequency = spectrum.power[kept], spectrum.frequency[kept]
    scale = float(power.max())
    envelope, axis = _thinned(power[:, None], frequency, MAX_SPECTRUM_POINTS)
    chart = figure("", 420)
    chart.add_scatter(x=np.round(axis, 2), y=np.round(10 * np.log10(envelope[:, 0] / scale), 2), mode="lines", name="spectrum",
                      line={"width": 1, "color": COLOURS[6]}, hoverinfo="skip")
    passings = tooth * np.arange(1, int(highest / tooth) + 1)
    marks = [("tooth passing", passings, spectrum.highest_near(passings, 1.5 * spectrum.cell), "triangle-up", COLOURS[0])]
    for name, lines, symbol, colour in (("chatter and side bands", chatter, "x", COLOURS[1]),
                                        ("there without the cut", background, "circle-open", COLOURS[2])):
        if lines is not None and lines.frequency.size:
            marks.append((name, lines.frequency, lines.power, symbol, colour))
    for name, place, value, symbol, colour in marks:
        is_shown = (place <= highest) & (value > scale * 10 ** (-SHOWN_DECIBELS / 10))
        chart.add_scatter(x=place[is_shown], y=10 * np.log10(value[is_shown] / scale), mode="markers", name=name,
                          marker={"symbol": symbol, "size": 8, "color": colour},
                          hovertemplate="%{x:.1f} Hz<br>%{y:.0f} dB<extra>" + name + "</extra>")
    chart.update_xaxes(title_text="Frequency, Hz", range=[0, highest])
    chart.update_yaxes(title_text="Power, dB below the largest line", range=[-SHOWN_DECIBELS - 10, 5])
    return chart


def growth_chart(course: PowerCourse, start: float, onset: float | None) -> go.Figure:
    """Return the power of the chatter lines and of all else over time, with the onset."""
    scale = float(max(course.power.max(), course.other_power.max(), 1e-300))
    chart = figure("", 340)
    for name, power, colour in (("chatter lines", course.power, COLOURS[1]), ("all else", course.other_power, COLOURS[6])):
        chart.add_scatter(x=start + course.time, y=10 * np.log10(np.maximum(power / scale, 1e-10)), mode="lines", name=name,
                          line={"color": colour})
    if onset is not None:
        chart.add_vline(x=onset, line={"width": 1, "dash": "dot", "color": COLOURS[0]}, annotation_text="onset")
    chart.update_xaxes(title_text="Time, s")
    chart.update_yaxes(title_text="Power, dB")
    return chart


def turn_samples(points: FloatArray) -> go.Figure:
    """Return samples of each revolution against those a quarter turn later: a cluster, a closed curve, or two clusters."""
    chart = figure("", 420)
    scale = float(np.abs(points).max()) or 1.0
    chart.add_scatter(x=points[:, 0] / scale, y=points[:, 1] / scale, mode="markers", name="each revolution",
                      marker={"color": np.arange(len(points)), "colorscale": "Viridis", "size": 6})
    chart.update_xaxes(title_text="Sample, over the largest", range=[-1.05, 1.05])
    chart.update_yaxes(title_text="Sample a quarter turn later", range=[-1.05, 1.05])
    return chart
