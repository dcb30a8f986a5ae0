"""Stability charts: spindle speed against depth of cut, as limit curves or as stable intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, increasing, nonnegative
from toolpoint._rounding import text_below
from toolpoint.plot.figures.theme import COLOURS, MARK, STABLE, figure, plain, with_alpha

_MIN_LABEL_SHARE = 0.15  # of the chart's height, below which a label under a curve has no room
_LABEL_END_SHARE = 0.15  # of the speeds: nearer to an end a label stands to the inside of its place


@dataclass(frozen=True, eq=False)
class StabilityCurve:
    """A limit depth over spindle speed.

    Parameters
    ----------
    speed_rpm : (n,) floats
        Spindle speed, rev/min, increasing.
    depth : (n,) floats
        Limit depth of cut, m; infinite or NaN where there is no limit in the range looked at.
    name : str
    chatter_frequency : (n,) floats, optional
        Hz, shown on hover.
    error : (n,) floats, optional
        Stated error of the depth, m, shown on hover.
    kind : (n,) str, optional
        Type of instability (Hopf, flip, fold), shown on hover.
    lowest : (rev/min, m), optional
        Least limit between the charted speeds, which the label on the curve names in place of the least charted one.

    >>> curve = StabilityCurve(np.array([6000.0, 8000.0]), np.array([1e-3, 2e-3]))
    >>> stability_chart(curve).layout.yaxis.title.text
    'Axial depth of cut, mm'
    """

    speed_rpm: FloatArray
    depth: FloatArray
    name: str = "limit"
    chatter_frequency: FloatArray | None = None
    error: FloatArray | None = None
    kind: Sequence[str] | None = None
    lowest: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        speed = increasing("speed_rpm", floats("speed_rpm", self.speed_rpm))
        depth = floats("depth", self.depth, (speed.size,), finite=False)
        if (depth < 0).any():
            fail("depth", f"value {np.nanmin(depth):g} m", "must not be negative")
        object.__setattr__(self, "speed_rpm", speed)
        object.__setattr__(self, "depth", depth)
        for what in ("chatter_frequency", "error", "kind"):
            _same_length(self, what, speed.size)


@dataclass(frozen=True, eq=False)
class StabilityIntervals:
    """Stable intervals of depth at each speed: islands and re-stable bands included.

    Parameters
    ----------
    speed_rpm : (n,) floats
        Spindle speed, rev/min, increasing.
    intervals : n arrays (k, 2)
        Stable from, to; m; an open end is infinite. k may differ from speed to speed and may be 0.
    chatter_frequency : n arrays (k,), optional
        Hz at the upper end of each interval.
    error : n arrays (k,), optional
        Stated error of the upper end, m.
    name : str

    >>> islands = StabilityIntervals(np.array([6000.0]), [[[0.0, 1e-3], [2e-3, 2.5e-3]]])
    >>> len(islands.intervals[0])  # stable again between 2 and 2.5 mm
    2
    """

    speed_rpm: FloatArray
    intervals: Sequence[ArrayLike]
    chatter_frequency: Sequence[ArrayLike] | None = None
    error: Sequence[ArrayLike] | None = None
    name: str = "stable"

    def __post_init__(self) -> None:
        speed = increasing("speed_rpm", floats("speed_rpm", self.speed_rpm))
        object.__setattr__(self, "speed_rpm", speed)
        for what in ("intervals", "chatter_frequency", "error"):
            _same_length(self, what, speed.size)
        checked = tuple(_checked_intervals(i, value) for i, value in enumerate(self.intervals))
        object.__setattr__(self, "intervals", checked)
        for what in ("chatter_frequency", "error"):
            if getattr(self, what) is not None:
                object.__setattr__(self, what, tuple(
                    floats(f"{what}[{i}]", row, (len(checked[i]),), finite=False)
                    for i, row in enumerate(getattr(self, what))))


def stability_chart(
    limits: StabilityCurve | StabilityIntervals | Iterable[StabilityCurve | StabilityIntervals],
    *,
    max_depth: float | None = None,
    points: Iterable[tuple[float, float, str]] = (),
    title: str = "",
    depth_name: str = "Axial depth of cut",
) -> go.Figure:
    """Return the chart of spindle speed (rev/min) against depth of cut (mm).

    Parameters
    ----------
    limits : one or several curves or sets of intervals
        The stable side is tinted for intervals and for a single curve.
    max_depth : float, optional
        Top of the chart, m; 1.15 times the largest finite depth where none is given (at most 8 times the median one, so
        that a lobe's peak does not flatten the rest).
    points : (speed rev/min, depth m, words), optional
        Cuts marked on the chart.

    >>> curve = StabilityCurve(np.array([6000.0, 8000.0]), np.array([1e-3, 2e-3]))
    >>> float(max(stability_chart(curve).data[0].y))  # mm
    2.0
    """
    parts = [limits] if isinstance(limits, (StabilityCurve, StabilityIntervals)) else list(limits)
    if not parts:
        fail("limits", "none", "must be at least one StabilityCurve or StabilityIntervals")
    depth_top = _chart_top(parts) if max_depth is None else max_depth
    if not np.isfinite(depth_top) or depth_top <= 0:
        fail("max_depth", f"{depth_top:g} m", "must be above zero and finite")
    chart = figure(title, 460)
    for number, part in enumerate(parts):
        colour = COLOURS[number % len(COLOURS)]
        if isinstance(part, StabilityCurve):
            _draw_curve(chart, part, colour, depth_top, len(parts) == 1)
        else:
            _draw_region(chart, part, colour, depth_top)
    for number, (speed, depth, words) in enumerate(points):
        chart.add_scatter(x=[speed], y=[1e3 * depth], name=plain(words), mode="markers", cliponaxis=False,
                         marker={"size": 11, "symbol": "x", "color": COLOURS[(len(parts) + number) % len(COLOURS)]},
                         hovertemplate="%{x:.0f} rev/min<br>%{y:.4g} mm")
    curves = [part for part in parts if isinstance(part, StabilityCurve)]
    if len(curves) == 1:
        _label_least(chart, curves[0], depth_top)
    chart.update_xaxes(title_text="Spindle speed, rev/min", range=_speed_range(parts), exponentformat="none")
    chart.update_yaxes(title_text=f"{plain(depth_name)}, mm", range=[0, 1e3 * depth_top])
    chart.update_layout(showlegend=True)
    return chart


def _draw_curve(chart: go.Figure, curve: StabilityCurve, colour: str, depth_top: float, is_filled: bool) -> None:
    words, hover_values = ["%{x:.0f} rev/min", "limit %{text} mm"], list[Any]()
    for values, text in ((curve.chatter_frequency, "chatter %{{customdata[{}]:.1f}} Hz"),
                         (None if curve.error is None else 1e3 * curve.error, "error ± %{{customdata[{}]:.2g}} mm"),
                         (curve.kind, "%{{customdata[{}]}}")):
        if values is not None:
            words.append(text.format(len(hover_values)))
            hover_values.append(values)
    depth = np.where(np.isnan(curve.depth), np.inf, curve.depth)
    chart.add_scatter(
        # An infinite limit is drawn far above the chart, so that the line leaves it and the tint below stays closed.
        x=curve.speed_rpm, y=1e3 * np.minimum(depth, 3 * depth_top), name=plain(curve.name), mode="lines",
        text=[f"{1e3 * d:.4g}" if np.isfinite(d) else "none found, above range" for d in depth],
        line={"color": colour, "width": 2}, fill="tozeroy" if is_filled else None, fillcolor=STABLE if is_filled else None,
        customdata=list(zip(*hover_values)) if hover_values else None, hovertemplate="<br>".join(words))


def _label_least(chart: go.Figure, curve: StabilityCurve, depth_top: float) -> None:
    """Write the least limit of the charted speeds on its curve, below it, where there is room."""
    depth = np.where(np.isfinite(curve.depth), curve.depth, np.inf)
    lowest = int(np.argmin(depth))
    if not np.isfinite(depth[lowest]) or not _MIN_LABEL_SHARE * depth_top < depth[lowest] < depth_top:
        return
    share = lowest / max(depth.size - 1, 1)
    speed, least_depth = curve.lowest or (float(curve.speed_rpm[lowest]), float(depth[lowest]))
    what = "least" if curve.lowest else "least charted"
    chart.add_annotation(
        x=speed, y=1e3 * least_depth, ax=0, ay=30, arrowhead=0, arrowwidth=1, arrowcolor=MARK,
        text=f"{plain(curve.name)}, {what} {text_below(1e3 * least_depth)} mm", font={"size": 11}, yanchor="top",
        xanchor="left" if share < _LABEL_END_SHARE else "right" if share > 1 - _LABEL_END_SHARE else "center")


def _draw_region(chart: go.Figure, part: StabilityIntervals, colour: str, depth_top: float) -> None:
    """Draw the stable depths as one region: between neighbouring speeds intervals that overlap are joined by straight lines,
    as the limit's line joins its points; hover tells what was computed at each speed."""
    x, y = _outlines(part.speed_rpm, [_clip_intervals(np.asarray(row), depth_top) for row in part.intervals])
    chart.add_scatter(x=x, y=y, mode="lines", line={"width": 0}, fill="toself", fillcolor=with_alpha(colour, 0.34),
                      name=plain(part.name), hoverinfo="skip", legendgroup=part.name)
    ends = [(float(part.speed_rpm[i]), 1e3 * min(upper, depth_top), _interval_words(part, i, k))
            for i, row in enumerate(part.intervals) for k, (lower, upper) in enumerate(np.asarray(row)) if lower < depth_top]
    chart.add_scatter(x=[e[0] for e in ends], y=[e[1] for e in ends], mode="markers", marker={"size": 9, "opacity": 0},
                      customdata=[e[2] for e in ends], hovertemplate="%{x:.0f} rev/min<br>%{customdata}<extra></extra>",
                      showlegend=False, name=plain(part.name), legendgroup=part.name)


def _clip_intervals(intervals: FloatArray, depth_top: float) -> FloatArray:
    """Return the intervals that begin below the top of the chart, cut there."""
    return np.minimum(intervals[intervals[:, 0] < depth_top], depth_top)


def _outlines(speed: FloatArray, rows: Sequence[FloatArray]) -> tuple[list[float | None], list[float | None]]:
    """Return the outlines (rev/min, mm) of four-sided pieces, parted by None."""
    x: list[float | None] = []
    y: list[float | None] = []
    half_width = 0.2 * _spacing(speed)  # of an interval of one speed alone
    for i, row in enumerate(rows):
        for lower, upper in row:
            overlapping = [other for other in (rows[i + 1] if i + 1 < len(rows) else ()) if other[0] < upper
                           and other[1] > lower]
            pieces = [(speed[i], speed[i + 1], other[0], other[1]) for other in overlapping]
            if not pieces and not _is_joined(rows, i, lower, upper):
                pieces = [(speed[i] - half_width, speed[i] + half_width, lower, upper)]
            for left, right, next_lower, next_upper in pieces:
                x += [float(left), float(right), float(right), float(left), None]
                y += [1e3 * float(v) for v in (lower, next_lower, next_upper, upper)] + [None]
    return x, y


def _is_joined(rows: Sequence[FloatArray], i: int, lower: float, upper: float) -> bool:
    """Return whether an interval overlaps one of the speed before."""
    return i > 0 and any(other[0] < upper and other[1] > lower for other in rows[i - 1])


def _interval_words(part: StabilityIntervals, i: int, k: int) -> str:
    lower, upper = np.asarray(part.intervals[i])[k]
    words = f"stable {1e3 * lower:.5g} … " + (f"{1e3 * upper:.5g} mm" if np.isfinite(upper) else "no limit found")
    if part.chatter_frequency is not None and np.isfinite(np.asarray(part.chatter_frequency[i])[k]):
        words += f"<br>chatter above {np.asarray(part.chatter_frequency[i])[k]:.1f} Hz"
    if part.error is not None and np.isfinite(np.asarray(part.error[i])[k]):
        words += f"<br>error ± {1e3 * np.asarray(part.error[i])[k]:.2g} mm"
    return words


def _spacing(speed: FloatArray) -> float:
    """Return the smallest step of speed, rev/min; a twentieth of the speed where there is only one."""
    return 0.05 * float(speed[0]) if speed.size == 1 else float(np.diff(speed).min())


def _chart_top(parts: Sequence[StabilityCurve | StabilityIntervals]) -> float:
    """Return the top of a chart, m: 1.15 of the largest depth, but at most 8 median depths."""
    depths: list[Array] = [part.depth if isinstance(part, StabilityCurve)
                          else np.concatenate([np.asarray(i).ravel() for i in part.intervals]) for part in parts]
    depth = np.concatenate(depths)
    depth = depth[np.isfinite(depth) & (depth > 0)]
    if depth.size == 0:
        fail("limits", "no finite depth", "a depth must be finite", remedy="give max_depth, m, for the top of the chart")
    # A lobe's peak may be a hundred times the usual limit: the chart ends where the other limits can still be read.
    return 1.15 * float(min(depth.max(), 8 * np.median(depth)))


def _speed_range(parts: Sequence[StabilityCurve | StabilityIntervals]) -> list[float]:
    """Return the ends of the speed axis, rev/min."""
    speed_min, speed_max = min(part.speed_rpm[0] for part in parts), max(part.speed_rpm[-1] for part in parts)
    return [float(speed_min), float(speed_max)] if speed_max > speed_min else [0.9 * float(speed_min), 1.1 * float(speed_max)]


def _checked_intervals(number: int, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, float)
    array = array.reshape(-1, 2) if array.size == 0 else floats(f"intervals[{number}]", array, (None, 2), finite=False)
    if np.isnan(array).any() or (array[:, 1] <= array[:, 0]).any():
        fail(f"intervals[{number}]", repr(array.tolist()), "must be pairs from < to, m")
    return nonnegative(f"intervals[{number}]", array)


def _same_length(part: Any, what: str, count: int) -> None:
    value = getattr(part, what)
    if value is not None and len(value) != count:
        fail(what, f"{len(value)} entries", f"must be {count}, one for each speed")
    if what in ("chatter_frequency", "error") and value is not None and isinstance(part, StabilityCurve):
        object.__setattr__(part, what, floats(what, value, (count,), finite=False))
