"""Charts of an identification: sum of responses, indicators, coherence, residual of every response, fit and Argand by name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from toolpoint._check import ComplexArray
from toolpoint.modal_identification import Identification, Indicator
from toolpoint.plot.figures.theme import COLOURS, figure, mark_modes, plain
from toolpoint.plot.figures.thinning import extreme_samples
from toolpoint.plot.page.charts import ClickedSeries
from toolpoint.vibration import Frf

MAX_LISTED_RESPONSES, DRAWN_RESPONSE_LINES = 48, 400  # responses in a list; spectral lines that each is drawn with
_MAX_RESIDUAL_BARS = 30  # bars


def sums_and_indicators(result: Identification, first: Indicator, second: Indicator) -> go.Figure:
    """Return the mean size of all responses, measured and synthesised, over CMIF and MvMIF, modes marked."""
    chart = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.4, 0.35, 0.25])
    chart.update_layout(figure("", 620).layout)
    for name, frf, colour in (("measured", result.frf, COLOURS[0]), ("synthesised", result.synthesis, COLOURS[1])):
        chart.add_scatter(x=frf.frequency, y=np.abs(frf.values).mean(axis=(1, 2)), name=name, mode="lines",
                          line={"color": colour, "width": 1.5, "dash": "solid" if name == "measured" else "dash"}, row=1, col=1)
    for k in range(min(first.values.shape[1], 6)):
        chart.add_scatter(x=first.frequency, y=first.values[:, k], name=f"CMIF {k + 1}", mode="lines",
                          line={"color": COLOURS[(k + 2) % len(COLOURS)], "width": 1.3}, row=2, col=1)
    for k in range(min(second.values.shape[1], 6)):
        chart.add_scatter(x=second.frequency, y=second.values[:, k], name=f"MvMIF {k + 1}", mode="lines",
                          line={"color": COLOURS[(k + 2) % len(COLOURS)], "width": 1.3, "dash": "dot"}, row=3, col=1)
    for row in (1, 2, 3):
        mark_modes(chart, result.modes.frequency, row=row, col=1)
    chart.update_yaxes(type="log", dtick=1, title_text="Mean size", row=1, col=1)
    chart.update_yaxes(type="log", dtick=1, title_text="CMIF", row=2, col=1)
    chart.update_yaxes(range=[0, 1.02], title_text="MvMIF", row=3, col=1)
    chart.update_xaxes(title_text="Frequency, Hz", row=3, col=1)
    return chart


def coherence_range(frf: Frf) -> go.Figure:
    """Return the lowest and the mean coherence of all responses on every line."""
    chart = figure("", 300)
    coherence = np.asarray(frf.coherence).reshape(frf.frequency.size, -1)
    for name, values, colour in (("mean of all responses", coherence.mean(axis=1), COLOURS[0]),
                                 ("lowest of all responses", coherence.min(axis=1), COLOURS[1])):
        chart.add_scatter(x=frf.frequency, y=values, name=name, mode="lines", line={"color": colour, "width": 1.3})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Coherence", range=[0, 1.02])
    return chart


def response_residuals(result: Identification) -> go.Figure:
    """Return what the synthesis leaves of every response, the worst first, as bars (per cent of its energy)."""
    names = response_names(result.frf)
    residual_energy = 100 * (1 - result.quality.ravel())
    order = np.argsort(-residual_energy)[:_MAX_RESIDUAL_BARS]
    chart = figure("", 150 + 22 * order.size)
    chart.add_bar(x=residual_energy[order], y=[plain(names[k]) for k in order], orientation="h", marker={"color": COLOURS[0]},
                  hovertemplate="%{y}<br>%{x:.3g} %<extra></extra>")
    chart.update_yaxes(autorange="reversed", type="category", dtick=1)
    chart.update_xaxes(title_text="Energy of the response that the synthesis leaves, %")
    return chart


def fits_by_name(result: Identification, name: str = "fit") -> ClickedSeries:
    """Return measured, synthesised and left-over size of a response that is chosen by its name: the worst first, then the
    best, then driving points and others in their order, `MAX_LISTED_RESPONSES` at most."""
    frf, names = result.frf, response_names(result.frf)
    measured, model = (part.values.reshape(part.frequency.size, -1) for part in (frf, result.synthesis))
    order = np.argsort(result.quality.ravel())
    driving = [i * len(frf.inputs) + j for i, a in enumerate(frf.outputs) for j, b in enumerate(frf.inputs) if a == b]
    remaining = list(range(len(names)))
    listed = list(dict.fromkeys([*order[:MAX_LISTED_RESPONSES // 2].tolist(), int(order[-1]), *driving,
                                 *remaining]))[:MAX_LISTED_RESPONSES]
    sets = []
    for k in listed:
        size = np.abs(measured[:, k])
        drawn_lines = extreme_samples(np.log(np.maximum(size, 1e-300)), DRAWN_RESPONSE_LINES)
        curves = [size[drawn_lines], np.abs(model[drawn_lines, k]), np.abs(measured[drawn_lines, k] - model[drawn_lines, k])]
        sets.append((f"{names[k]}: fit {100 * result.quality.ravel()[k]:.2f} %", frf.frequency[drawn_lines], curves))
    chart = figure("", 420)
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text=plain(f"{frf.quantity.capitalize()}, {frf.unit}"), type="log", dtick=1)
    mark_modes(chart, result.modes.frequency, (float(frf.frequency[0]), float(frf.frequency[-1])))
    list_words = ("" if len(listed) == len(names)
                  else f" {len(listed)} of {len(names)} responses are in the list, the worst first.")
    return ClickedSeries(chart, "", "", ("measured", "synthesised", "left over"), (COLOURS[0], COLOURS[1], COLOURS[6]), sets,
                         f"Left over: size of measured less synthesised.{list_words}", name, "Response")


def argand_by_mode(shape: ComplexArray, labels: Sequence[str], name: str = "argand") -> ClickedSeries:
    """Return the shape of a mode chosen by its label in the complex plane, a line from zero to every Dof, turned to its mean
    phase and scaled to its largest entry."""
    chart = figure("", 420)
    chart.update_xaxes(title_text="Real part", range=[-1.1, 1.1], constrain="domain", zeroline=True)
    chart.update_yaxes(title_text="Imaginary part", range=[-1.1, 1.1], scaleanchor="x", constrain="domain", zeroline=True)
    chart.update_layout(width=560, showlegend=False)
    sets = []
    for k, label in enumerate(labels):
        phi = shape[:, k] / max(float(np.abs(shape[:, k]).max()), 1e-300)
        # The phase that makes sum of phi^2 real and positive turns a real mode onto the real axis.
        phi = phi * np.exp(-0.5j * np.angle((phi**2).sum()))
        spokes = np.stack([np.zeros_like(phi), phi, np.full_like(phi, np.nan)], axis=1).ravel()
        sets.append((label, spokes.real, [spokes.imag]))
    return ClickedSeries(chart, "", "", ("Dofs",), COLOURS[:1], sets,
                         "A real mode lies on one line; what opens to a fan is complex, or carries noise.", name, "Mode",
                         "lines+markers")


def response_names(frf: Frf) -> list[str]:
    """Return output / input of every response, outputs first."""
    return [f"{o} / {i}" for o in frf.outputs for i in frf.inputs]
