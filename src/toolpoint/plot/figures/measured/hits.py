"""Figures of hammer hits: the pulse of every hit, and the force spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure, plain

REFUSED_COLOUR = "#c0392b"
MAX_DRAWN_PULSES = 60  # pulses drawn


@dataclass(frozen=True, eq=False)
class PulseCurve:
    """The force of a hit about its peak: ms from the peak, N, its name, whether it is used."""

    name: str
    time: FloatArray
    force: FloatArray
    accepted: bool


def force_pulses(pulses: Sequence[PulseCurve]) -> go.Figure:
    """Return the pulses of hits over the time from their peaks; refused ones are dashed and red."""
    chart = figure("", 380)
    for pulse in pulses[:MAX_DRAWN_PULSES]:
        colour = COLOURS[0] if pulse.accepted else REFUSED_COLOUR
        chart.add_scatter(x=np.float32(pulse.time), y=np.float32(pulse.force), mode="lines", name=plain(pulse.name),
                          line={"color": colour, "dash": "solid" if pulse.accepted else "dash", "width": 1.4},
                          showlegend=len(pulses) <= 12,
                          hovertemplate=plain(pulse.name) + "<br>%{x:.3f} ms: %{y:.4g} N<extra></extra>")
    chart.update_xaxes(title_text="Time from the peak, ms")
    chart.update_yaxes(title_text="Force, N")
    return chart


def force_spectra(frequency: FloatArray, spectra: Sequence[tuple[str, FloatArray]], band: tuple[float, float]) -> go.Figure:
    """Return force spectra (dB under their maximum) over frequency (Hz), the usable band shaded."""
    chart = figure("", 320)
    names = list(dict.fromkeys(name for name, _ in spectra))  # spectra of one name are one entry of the legend
    for k, (name, level) in enumerate(spectra):
        decibels = 20 * np.log10(np.maximum(level, 1e-12 * level.max()) / level.max())
        chart.add_scatter(x=np.float32(frequency), y=np.float32(decibels), mode="lines", name=plain(name), legendgroup=name,
                          showlegend=name not in [earlier for earlier, _ in spectra[:k]],
                          line={"color": COLOURS[names.index(name) % len(COLOURS)], "width": 1.5},
                          hovertemplate="%{x:.5g} Hz: %{y:.1f} dB")
    chart.add_vrect(x0=band[0], x1=band[1], fillcolor="rgba(46,204,113,0.12)", line_width=0)
    # ISO 7626-5: the force spectrum of the band used falls by no more than 20 dB.
    chart.add_hline(y=-20, line={"dash": "dot", "width": 1})
    chart.update_xaxes(title_text="Frequency, Hz", range=[0, float(frequency[-1])])
    chart.update_yaxes(title_text="Force, dB", range=[-60, 3])
    return chart
