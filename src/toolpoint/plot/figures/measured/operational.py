"""Charts of an operational modal analysis: singular values of the spectra with modes and harmonics, poles of all orders."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.modal_identification import OperationalIdentification
from toolpoint.plot.figures.theme import COLOURS, figure, mark_modes, plain


def singular_values(result: OperationalIdentification) -> go.Figure:
    """Return the singular values of the spectral matrix over frequency: modes dotted, harmonics as crosses above them."""
    chart = figure("", 440)
    for k in range(result.spectra[0].values.shape[1]):
        frequency: list[FloatArray] = []
        values: list[FloatArray] = []
        for spectra in reversed(result.spectra):  # the finest resolution that a frequency has
            if k >= spectra.values.shape[1]:
                continue
            is_new = spectra.frequency > (frequency[-1][-1] if frequency else 0.0)
            # The last tenth of a decimated band holds the slope of its filter.
            inside = is_new & (spectra.frequency <= 0.9 * spectra.frequency[-1])
            if inside.any():
                frequency.append(spectra.frequency[inside])
                values.append(spectra.values[inside, k])
        chart.add_scatter(x=np.concatenate(frequency), y=np.concatenate(values), name=f"singular value {k + 1}", mode="lines",
                          line={"color": COLOURS[k % len(COLOURS)], "width": 1.6 if k == 0 else 1.0})
    mark_modes(chart, result.modes.frequency)
    if result.harmonics:
        marker_height = float(result.spectra[0].values[:, 0].max())
        chart.add_scatter(
            x=[h.frequency
               for h in result.harmonics], y=[marker_height] * len(result.harmonics), name="harmonic (no mode)", mode="markers",
            marker={"symbol": "x", "size": 9, "color": COLOURS[1]},
            text=[f"order {h.order}" if h.order else "no order" for h in result.harmonics],
            hovertemplate="%{x:.4f} Hz<br>%{text}<extra>harmonic</extra>")
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(type="log", exponentformat="power", title_text="Singular value, 1/Hz")
    chart.update_layout(legend={"orientation": "h", "y": -0.19, "yanchor": "top"})
    return chart


def operational_poles(result: OperationalIdentification) -> go.Figure:
    """Return the poles of all orders of all bands over frequency, coloured by damping, with the modes at the foot."""
    chart = figure("", 480)
    for k, (diagram, spectra) in enumerate(zip(result.diagrams, result.spectra, strict=True)):
        chart.add_scatter(
            x=diagram.frequency, y=diagram.order, mode="markers", name=f"up to {spectra.frequency[-1] / 1.28:.4g} Hz",
            marker={"size": 5, "color": COLOURS[k % len(COLOURS)], "opacity": 0.6, "symbol": "circle-open"},
            customdata=100 * diagram.damping_ratio,
            hovertemplate="%{x:.3f} Hz<br>order %{y}<br>damping %{customdata:.3f} %<extra>" + plain("pole") + "</extra>")
    chart.add_scatter(x=result.modes.frequency, y=[0] * result.modes.count, mode="markers", name="mode",
                      marker={"symbol": "triangle-up", "size": 12, "color": COLOURS[1]},
                      hovertemplate="%{x:.3f} Hz<extra>mode</extra>")
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Model order", rangemode="tozero")
    chart.update_layout(legend={"orientation": "h", "y": -0.19, "yanchor": "top"})
    return chart
