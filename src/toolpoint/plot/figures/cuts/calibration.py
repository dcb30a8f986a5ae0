"""Charts of a calibration: measured and fitted forces over one revolution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.total_energy import TotalEnergy
from toolpoint.cutting.force.energy_fit import EnergyAtFeeds
from toolpoint.plot.figures.theme import COLOURS, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go


def plot_force_fit(angle: FloatArray, measured: FloatArray, fitted: FloatArray, *, title: str = "") -> go.Figure:
    """Return measured (points) and fitted (lines) forces, N, of one record over the rotation (rad) of its samples."""
    chart = figure(title, 380)
    degrees = np.degrees(angle)
    for k, way in enumerate("xyz"[:measured.shape[1]]):
        chart.add_scatter(x=degrees, y=measured[:, k], name=f"F{way} measured", mode="markers",
                         marker={"color": COLOURS[k], "size": 5, "opacity": 0.5})
        chart.add_scatter(x=degrees, y=fitted[:, k], name=f"F{way} fitted", mode="lines",
                         line={"color": COLOURS[k], "width": 1.3})
    chart.update_xaxes(title_text="Rotation, °", range=[0, 360], dtick=45)
    chart.update_yaxes(title_text="Force on the tool, N")
    return chart


def mean_forces(feeds: FloatArray, measured: FloatArray, fitted: FloatArray) -> go.Figure:
    """Return mean forces (points) and the fitted line over the feed per tooth (m)."""
    chart = figure("", 340)
    order = np.argsort(feeds)
    for k, way in enumerate("xyz"[:measured.shape[1]]):
        chart.add_scatter(x=1e3 * feeds, y=measured[:, k], name=f"mean F{way}", mode="markers",
                         marker={"color": COLOURS[k], "size": 8})
        chart.add_scatter(x=1e3 * feeds[order], y=fitted[order, k], mode="lines", line={"color": COLOURS[k]}, showlegend=False)
    chart.update_xaxes(title_text="Feed per tooth, mm")
    chart.update_yaxes(title_text="Mean force on the tool, N")
    return chart


def plot_energy(energies: EnergyAtFeeds, law: TotalEnergy) -> go.Figure:
    """Return the energy per volume of each feed (points) and of the law (line) over the mean chip thickness."""
    chart = figure("", 340)
    chip = np.geomspace(energies.chip.min() / 1.2, energies.chip.max() * 1.2, 60)
    chart.add_scatter(x=1e3 * energies.chip, y=energies.energy / 1e6, name="each feed by itself", mode="markers",
                      marker={"color": COLOURS[0], "size": 8})
    chart.add_scatter(x=1e3 * chip, y=[law.specific(float(h)) / 1e6 for h in chip], name="law of all feeds", mode="lines",
                      line={"color": COLOURS[0]})
    chart.update_xaxes(title_text="Mean chip thickness, mm", type="log", nticks=8)
    chart.update_yaxes(title_text="Energy per volume, N/mm²", type="log")
    return chart


def plot_ratios(energies: EnergyAtFeeds, law: TotalEnergy) -> go.Figure:
    """Return the force ratios of each feed (points) and of the law (lines) over the mean chip thickness."""
    chart = figure("", 300)
    for k, (name, ratios, fitted) in enumerate((("normal", energies.normal_ratio, law.normal_ratio),
                                                ("axial", energies.axial_ratio, law.axial_ratio))):
        if not np.isfinite(ratios).all():
            continue
        chart.add_scatter(x=1e3 * energies.chip, y=ratios, name=f"{name} over tangential force", mode="markers",
                          marker={"color": COLOURS[k], "size": 8})
        chart.add_scatter(x=1e3 * energies.chip[[0, -1]], y=[fitted, fitted], mode="lines", line={"color": COLOURS[k]},
                          showlegend=False)
    chart.update_xaxes(title_text="Mean chip thickness, mm", type="log", nticks=8)
    chart.update_yaxes(title_text="Force ratio", rangemode="tozero")
    return chart
