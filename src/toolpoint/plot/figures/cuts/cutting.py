"""Charts of cuts: stable intervals of a chart, simulated forces and vibration, spectra, surface location error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import StabilityChart
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.plot.figures.cuts.lobes import StabilityIntervals
from toolpoint.plot.figures.measured.frf import real_imaginary
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.page.charts import ClickedSeries
from toolpoint.vibration import Frf

if TYPE_CHECKING:
    import plotly.graph_objects as go


def intervals_of(chart: StabilityChart, name: str = "stable") -> StabilityIntervals:
    """Return a chart's stable intervals with chatter frequency and stated error at their upper ends, for drawing."""
    intervals, frequencies, errors = [], [], []
    for i in range(chart.speeds.size):
        stable = chart.intervals(i)
        speed_points = chart.points(i)
        nearest_points = [int(speed_points[np.argmin(np.abs(chart.depth[speed_points] - upper))]) if speed_points.size else -1
                          for _, upper in stable]
        # An interval that ends at no computed point has neither frequency nor error of its own.
        ends = [k if k >= 0 and abs(chart.depth[k] - upper) <= 1e-12 + 1e-9 * upper else -1
                for k, (_, upper) in zip(nearest_points, stable, strict=True)]
        frequencies.append(np.array([chart.frequency[k] if k >= 0 else np.nan for k in ends]))
        errors.append(np.array([chart.error[k] if k >= 0 else np.nan for k in ends]))
        intervals.append(np.where(stable >= chart.depth_max, np.inf, stable))
    return StabilityIntervals(chart.speeds, intervals, frequencies, errors, name)


def chatter_frequencies(chart: StabilityChart) -> go.Figure:
    """Return the chatter frequency at the first limit over spindle speed."""
    points = chart.limit_points()
    limited = np.flatnonzero(points >= 0)
    frequency = chart.frequency[points[limited]]
    figure_ = figure("Chatter frequency", 320)
    figure_.add_scatter(x=chart.speeds[limited], y=frequency, mode="markers", name="chatter frequency",
                        marker={"size": 5, "color": COLOURS[1]}, hovertemplate="%{x:.0f} rev/min<br>%{y:.1f} Hz<extra></extra>")
    figure_.update_xaxes(title_text="Spindle speed, rev/min", exponentformat="none",
                         range=[float(chart.speeds.min()), float(chart.speeds.max())])
    figure_.update_yaxes(title_text="Chatter frequency, Hz")
    return figure_


def surface_location(speeds: FloatArray, error: FloatArray, title: str = "") -> go.Figure:
    """Return the surface location error (m) over spindle speed (rev/min)."""
    chart = figure(title, 380)
    chart.add_scatter(x=speeds, y=1e6 * np.asarray(error), mode="lines", name="location error", line={"color": COLOURS[0]})
    chart.update_xaxes(title_text="Spindle speed, rev/min", exponentformat="none")
    chart.update_yaxes(title_text="Surface location error, µm")
    return chart


def chip_response(frf: Frf, lowest_real_part: tuple[float, float] | None = None) -> go.Figure:
    """Return real and imaginary part of the response of the chip's thickness; `lowest_real_part` marks that (Hz, m/N)."""
    chart = real_imaginary({"response": frf})
    if lowest_real_part is not None:
        chart.add_scatter(x=[lowest_real_part[0]], y=[lowest_real_part[1]], mode="markers", name="least real part",
                         marker={"size": 10, "symbol": "x", "color": COLOURS[1]},
                         hovertemplate="%{x:.5g} Hz<br>%{y:.4g} m/N", row=1, col=1)
    return chart


SIMULATED = "simulated cuts"
SYMBOLS = {"chatter": "x", "stable": "circle", "undecided": "circle-open"}


def with_simulations(chart: go.Figure, runs: Sequence[Simulation]) -> go.Figure:
    """Return a stability chart with simulated cuts as points, crosses where they chatter, open circles where it is undecided;
    each can be clicked."""
    states = [run.verdict().state for run in runs]
    chart.add_scatter(
        x=[run.speed for run in runs], y=[1e3 * run.depth for run in runs], mode="markers", name=SIMULATED,
        customdata=list(range(len(runs))), text=states,
        marker={"symbol": [SYMBOLS[state] for state in states], "size": 9, "color": "rgba(30,36,48,0.85)",
                "line": {"width": 1, "color": "white"}},
        hovertemplate="%{x:.0f} rev/min, %{y:.3g} mm<br>%{text} in the simulation, click to see it")
    return chart


def simulation_series(runs: Sequence[Simulation], follows: str, revolutions: int = 4, *, samples: int = 400) -> ClickedSeries:
    """Return the vibration over the last revolutions of every simulated cut, shown when its point is clicked."""
    chart = figure("", 380)
    chart.update_xaxes(title_text="Time, s")
    chart.update_yaxes(title_text="Displacement, µm")
    sets = []
    for run in runs:
        last_samples = run.displacement[-revolutions * run.steps_per_revolution:]
        # Every step-th sample: a page holds the curves of all simulated cuts.
        step = max(1, len(last_samples) // samples)
        words = f"{run.speed:.0f} rev/min, {1e3 * run.depth:.3g} mm: {run.verdict().state}"
        sets.append((words, run.time[-len(last_samples):][::step], [1e6 * last_samples[::step, k] for k in range(2)]))
    return ClickedSeries(chart, follows, SIMULATED, ("vibration x", "vibration y"), COLOURS[:2], sets,
                         "Simulated vibration of the point last clicked on the chart.", "simulated")


def simulation_charts(run: Simulation, shown_revolutions: int = 6) -> dict[str, go.Figure]:
    """Return charts of the last revolutions: force, vibration, spectrum with its lines marked, once-per-revolution samples."""
    last_samples = slice(-shown_revolutions * run.steps_per_revolution, None)
    step = max(1, run.displacement[last_samples].shape[0] // 4000)
    time = run.time[last_samples][::step]
    force, vibration = figure("", 360), figure("", 360)
    for k, way in enumerate("xy"):
        force.add_scatter(x=time, y=run.force[last_samples, k][::step], name=f"force {way}", line={"color": COLOURS[k]})
        vibration.add_scatter(x=time, y=1e6 * run.displacement[last_samples, k][::step], name=f"vibration {way}",
                              line={"color": COLOURS[k]})
    for chart, name in ((force, "Force on the tool, N"), (vibration, "Displacement, µm")):
        chart.update_xaxes(title_text="Time, s")
        chart.update_yaxes(title_text=name)
    return {"Force": force, "Vibration": vibration, "Spectrum of the vibration": _spectrum(run),
            "Spectrum of the force": _force_spectrum(run),
            "Once-per-revolution samples": _samples(run)}


def _spectrum(run: Simulation) -> go.Figure:
    """Return the spectrum of the vibration, the lines of tooth passing and chatter marked."""
    chart = figure("", 400)
    for k, way in enumerate("xy"):
        spectrum = run.spectrum("displacement", k)
        # Half above the highest mode or the fourth tooth passing: beyond, a spectrum to half the rate of the simulation is
        # empty.
        keep = spectrum.frequency <= 1.5 * max(run.problem.plane.span[1], 4 * run.problem.tool.teeth * run.speed / 60)
        chart.add_scatter(x=spectrum.frequency[keep], y=1e6 * spectrum.amplitude[keep], name=f"vibration {way}",
                         line={"color": COLOURS[k]})
        if k == 0:
            for line_frequency, _, kind in spectrum.lines()[:12]:
                chart.add_vline(x=line_frequency, line={"width": 1, "dash": "dot", "color": "rgba(127,127,127,0.7)"},
                                annotation_text=kind,
                               annotation_textangle=-90, annotation_font_size=10)
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Amplitude, µm", type="log", exponentformat="power")
    return chart


def _force_spectrum(run: Simulation) -> go.Figure:
    """Return the spectrum of the force on the tool along x and y over the same lines as that of the vibration."""
    chart = figure("", 340)
    for k, way in enumerate("xy"):
        spectrum = run.spectrum("force", k)
        keep = spectrum.frequency <= 1.5 * max(run.problem.plane.span[1], 4 * run.problem.tool.teeth * run.speed / 60)
        chart.add_scatter(x=spectrum.frequency[keep], y=spectrum.amplitude[keep], name=f"force {way}",
                          line={"color": COLOURS[k]})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Amplitude, N", type="log", exponentformat="power")
    return chart


def plot_wall(place: FloatArray, profile: FloatArray, bands: Mapping[str, FloatArray]) -> go.Figure:
    """Return the profile of a wall (m) along the feed (m) and the bands that add up to it, each less its own mean."""
    chart = figure("", 380)
    chart.add_scatter(x=1e3 * place, y=1e6 * (profile - profile.mean()), name="profile",
                      line={"color": "rgba(127,127,127,0.8)"})
    for k, (name, band) in enumerate(bands.items()):
        chart.add_scatter(x=1e3 * place, y=1e6 * (band - band.mean()), name=name, line={"color": COLOURS[k], "width": 1.3})
    chart.update_xaxes(title_text="Along the feed, mm")
    chart.update_yaxes(title_text="Height less its mean, µm")
    return chart


def _samples(run: Simulation) -> go.Figure:
    """Return the once-per-revolution samples: one point where the cut is stable, a closed curve with chatter."""
    chart = figure("", 420)
    points = 1e6 * run.once_per_revolution()[2:]
    chart.add_scatter(x=points[:, 0], y=points[:, 1], mode="markers", name="each revolution",
                     marker={"color": np.arange(len(points)), "colorscale": "Viridis", "size": 7})
    chart.update_xaxes(title_text="x, µm")
    chart.update_yaxes(title_text="y, µm")
    return chart
