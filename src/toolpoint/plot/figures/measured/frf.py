"""Figures of frequency responses: magnitude and phase, real and imaginary part, Nyquist circles, coherence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from toolpoint._check import Array, fail
from toolpoint.plot.figures.theme import COLOURS, DASHES, TEMPLATE, figure, mark_modes, plain
from toolpoint.vibration import Dof, Frf, Modes

Labels = Iterable[Dof | str | int] | Dof | str | int | None
_MAX_FRF_CURVES = 24  # curves of one figure


@dataclass(frozen=True, eq=False)
class _Curve:
    name: str
    group: str
    colour: str
    dash: str
    frequency: Array
    values: Array
    coherence: Array | None


def bode(
    frfs: Frf | Mapping[str, Frf],
    outputs: Labels = None,
    inputs: Labels = None,
    *, modes: Modes | None = None,

    with_coherence: bool = True,
    log_frequency: bool = False,
    title: str = "",
) -> go.Figure:
    """Return magnitude (logarithmic) over phase (deg), with the coherence beneath where one is carried.

    Parameters
    ----------
    frfs : Frf, or mapping from name to Frf
        One pose each, one quantity; several are overlaid (measured, synthesised), each name with its own line style.
    outputs, inputs : labels or indices, optional
        Responses and forces drawn, all where none are given; at most 24 curves.
    modes : Modes, optional
        Natural frequencies marked by vertical lines (one pose).
    with_coherence : bool
        Whether to draw the coherence of the Frfs that carry one.
    log_frequency : bool
        Logarithmic frequency axis.
    title : str

    Raises
    ------
    ToolpointError
        For batches of poses, mixed quantities, unknown labels, more than 24 curves.

    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([100.0], [0.02], [[0.1]], ["tip:+x"])
    >>> figure = bode(frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tip:+x"], inputs=["tip:+x"]))
    >>> figure.layout.yaxis.type
    'log'
    """
    named, curves = _curves(frfs, outputs, inputs)
    has_coherence = with_coherence and any(curve.coherence is not None for curve in curves)
    heights = [0.56, 0.25, 0.19] if has_coherence else [0.68, 0.32]
    chart = _stacked(heights, title, 620 if has_coherence else 540)
    for curve in curves:
        size = np.abs(curve.values)
        # A logarithmic axis has no zero: the line is interrupted there.
        _line(chart, curve, np.where(size > 0, size, np.nan), 1, True, "%{y:.4g} " + _unit(named))
        _line(chart, curve, np.angle(curve.values, deg=True), 2, False, "%{y:.1f}°")
        if has_coherence and curve.coherence is not None:
            _line(chart, curve, curve.coherence, 3, False, "coherence %{y:.3f}")
    chart.update_yaxes(type="log", dtick=1, title_text=_quantity(named), row=1, col=1)
    # A little more than a half turn each way, so that phases of 180 degrees are not cut.
    chart.update_yaxes(title_text="Phase, °", range=[-190, 190], tickvals=[-180, -90, 0, 90, 180], row=2, col=1)
    if has_coherence:
        chart.update_yaxes(title_text="Coherence", range=[0, 1.05], tickvals=[0, 0.5, 1], row=3, col=1)
    return _finished(chart, modes, named, log_frequency, len(heights))


def real_imaginary(
    frfs: Frf | Mapping[str, Frf],
    outputs: Labels = None,
    inputs: Labels = None,
    *, modes: Modes | None = None,

    log_frequency: bool = False,
    title: str = "",
) -> go.Figure:
    """Return the real part over the imaginary part; parameters as for `bode`.

    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([100.0], [0.02], [[0.1]], ["tip:+x"])
    >>> figure = real_imaginary(frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tip:+x"], inputs=["tip:+x"]))
    >>> len(figure.data)  # real over imaginary part
    2
    """
    named, curves = _curves(frfs, outputs, inputs)
    chart = _stacked([0.5, 0.5], title, 540)
    for curve in curves:
        _line(chart, curve, curve.values.real, 1, True, "%{y:.4g} " + _unit(named))
        _line(chart, curve, curve.values.imag, 2, False, "%{y:.4g} " + _unit(named))
    chart.update_yaxes(title_text=f"Real, {_unit(named)}", row=1, col=1)
    chart.update_yaxes(title_text=f"Imaginary, {_unit(named)}", row=2, col=1)
    return _finished(chart, modes, named, log_frequency, 2)


def nyquist(
    frfs: Frf | Mapping[str, Frf], outputs: Labels = None, inputs: Labels = None, *, title: str = ""
) -> go.Figure:
    """Return imaginary against real part at equal scales, the frequency on hover; parameters as for `bode`.

    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([100.0], [0.02], [[0.1]], ["tip:+x"])
    >>> figure = nyquist(frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tip:+x"], inputs=["tip:+x"]))
    >>> bool(max(figure.data[0].y) < 0)  # a receptance at its own driving point lies below the real axis
    True
    """
    named, curves = _curves(frfs, outputs, inputs)
    chart = figure(title, 540)
    for curve in curves:
        chart.add_scatter(
            x=_single_precision(curve.values.real), y=_single_precision(curve.values.imag),
            customdata=_single_precision(curve.frequency),
            name=plain(curve.name), mode="lines+markers",
            line={"color": curve.colour, "dash": curve.dash, "width": 1.4},
            marker={"size": 4}, hovertemplate="%{customdata:.6g} Hz<br>%{x:.4g} + i (%{y:.4g}) " + _unit(named))
    chart.update_xaxes(title_text=f"Real, {_unit(named)}", zeroline=True, zerolinecolor="rgba(127,127,127,0.5)")
    chart.update_yaxes(title_text=f"Imaginary, {_unit(named)}", scaleanchor="x", zeroline=True,
                      zerolinecolor="rgba(127,127,127,0.5)")
    return chart


def coherence(
    frfs: Frf | Mapping[str, Frf], outputs: Labels = None, inputs: Labels = None, *, title: str = ""
) -> go.Figure:
    """Return the coherence over frequency; an Frf without one is refused. Parameters as for `bode`.

    >>> frf = Frf([10.0, 20.0], np.full((2, 1, 1), 1e-8 + 0j), ["tip:+x"], ["tip:+x"], coherence=np.full((2, 1, 1), 0.75))
    >>> coherence(frf).data[0].y.tolist()
    [0.75, 0.75]
    """
    named, curves = _curves(frfs, outputs, inputs)
    without = [name for name, frf in named.items() if frf.coherence is None]
    if without:
        fail("frfs", f"no coherence in {without[0] or 'the Frf'}", "must carry one",
             remedy="estimate it from several averages")
    chart = _stacked([1.0], title, 320)
    for curve in curves:
        _line(chart, curve, curve.coherence, 1, True, "%{y:.3f}")
    chart.update_yaxes(title_text="Coherence", range=[0, 1.03])
    return _finished(chart, None, named, False, 1)


def _curves(frfs: Frf | Mapping[str, Frf], outputs: Labels, inputs: Labels) -> tuple[dict[str, Frf], list[_Curve]]:
    named = {"": frfs} if isinstance(frfs, Frf) else dict(frfs)
    if not named:
        fail("frfs", "none", "must be at least one Frf")
    first = next(iter(named.values()))
    for name, frf in named.items():
        if frf.values.ndim != 3:
            fail("frfs", f"{name or 'the Frf'} has {frf.values.shape[0]} poses", "must be one pose",
                 remedy="use frf.at_pose(i)")
        if frf.quantity != first.quantity:
            fail("frfs", f"{name} is {frf.quantity} beside {first.quantity}", "must be one quantity",
                 remedy=f"use frf.converted_to({first.quantity!r})")
    chosen = {name: frf.selected(_label_list(outputs), _label_list(inputs)) for name, frf in named.items()}
    count = sum(frf.values[0].size for frf in chosen.values())
    if count > _MAX_FRF_CURVES:
        fail("frfs", f"{count} curves", f"must be at most {_MAX_FRF_CURVES} to be readable",
             remedy="choose outputs=[...] and inputs=[...]")
    return chosen, list(_iterate_curves(chosen))


def _iterate_curves(chosen: Mapping[str, Frf]) -> Iterator[_Curve]:
    """Yield every response of every Frf: colours by pair, dashes by name; by name where there is one pair only."""
    pairs: dict[str, int] = {}
    for frf in chosen.values():
        for out in frf.outputs:
            for into in frf.inputs:
                pairs.setdefault(f"{out} / {into}", len(pairs))
    for number, (name, frf) in enumerate(chosen.items()):
        for i, out in enumerate(frf.outputs):
            for j, into in enumerate(frf.inputs):
                pair = f"{out} / {into}"
                colour_number = pairs[pair] if len(pairs) > 1 else number
                words = name if name and len(pairs) == 1 else f"{name}, {pair}" if name else pair
                yield _Curve(words, f"{number}-{i}-{j}", COLOURS[colour_number % len(COLOURS)], DASHES[number % len(DASHES)],
                             frf.frequency, frf.values[:, i, j],
                             None if frf.coherence is None else frf.coherence[:, i, j])


def _label_list(labels: Labels) -> list[Dof | str | int] | None:
    if labels is None:
        return None
    return [labels] if isinstance(labels, (str, int, Dof)) else list(labels)


def _stacked(heights: list[float], title: str, height: int) -> go.Figure:
    """Return an empty figure of charts above each other with a common frequency axis."""
    chart = make_subplots(rows=len(heights), cols=1, shared_xaxes=True, vertical_spacing=0.045, row_heights=heights)
    chart.update_layout(template=TEMPLATE, height=height)
    if title:
        chart.update_layout(title={"text": plain(title)})
    return chart


def _line(chart: go.Figure, curve: _Curve, values: Array | None, row: int, legend: bool, words: str) -> None:
    chart.add_trace(go.Scatter(
        x=_single_precision(curve.frequency), y=_single_precision(values), name=plain(curve.name), legendgroup=curve.group,
        showlegend=legend,
        mode="lines", line={"color": curve.colour, "dash": curve.dash, "width": 1.6},
        hovertemplate="%{x:.6g} Hz<br>" + words), row=row, col=1)


def _finished(
    chart: go.Figure, modes: Modes | None, named: Mapping[str, Frf], log_frequency: bool, rows: int
) -> go.Figure:
    """Return the figure with its modes marked and its frequency axis titled."""
    frequency_min = min(float(frf.frequency[0]) for frf in named.values())
    frequency_max = max(float(frf.frequency[-1]) for frf in named.values())
    if modes is not None:
        if modes.frequency.ndim > 1:
            fail("modes", f"{modes.frequency.shape[0]} poses", "must be one pose", remedy="use modes.at_pose(i)")
        marked = modes.frequency[(modes.frequency >= frequency_min) & (modes.frequency <= frequency_max)]
        mark_modes(chart, marked, (frequency_min, frequency_max), logarithmic=log_frequency, row=1, col=1)
        for row in range(2, rows + 1):
            mark_modes(chart, marked, row=row, col=1)
    chart.update_xaxes(type="log" if log_frequency else "linear")
    chart.update_xaxes(title_text="Frequency, Hz", row=rows, col=1)
    if not log_frequency:
        chart.update_xaxes(range=[frequency_min, frequency_max])
    chart.update_layout(showlegend=True)
    return chart


def _single_precision(values: Array | None) -> Array:
    """Return values in single precision, which halves the page and shows no difference."""
    return np.asarray(values, np.float32)


def _unit(named: Mapping[str, Frf]) -> str:
    return next(iter(named.values())).unit.replace("^2", "²")


def _quantity(named: Mapping[str, Frf]) -> str:
    return f"{next(iter(named.values())).quantity.capitalize()}, {_unit(named)}"
