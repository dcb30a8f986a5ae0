"""The page of a controller's record: doubts first, the quantities, and what was measured at every constant speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.drives import friction_points
from toolpoint.studies.servos.servo_data import AxisFindings, ServoData


def servo_data_page(result: ServoData, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of findings; `warnings` are those of the run."""
    report = Report(f"Servo data: {result.source}", "Friction, gains, margins and positioning from records of a controller.")
    first = [Notes(result.doubts(), "warning")] if result.doubts() else []
    report = report.with_section("Result", *first, Table(["axis", "quantity", "value"], result.rows()))
    for axis in result.axes:
        if axis.runs.velocity.size:
            charts = [Chart(friction_points(axis.runs.velocity, axis.runs.current, axis.force_unit, unit=axis.unit))] \
                if np.isfinite(axis.runs.current).any() else []
            report = report.with_section(f"Constant speeds of axis {axis.axis}", _runs(axis), *charts)
    notes = list(dict.fromkeys([*result.notes, *warnings]))
    parts: list[Notes | Table] = [Notes(notes, "assumed")] if notes else []
    if result.signals:
        parts.append(Table(["signal and what it is taken for"], [[name] for name in result.signals]))
    return report.with_section("Inputs and assumptions", *parts) if parts else report


def _runs(axis: AxisFindings) -> Table:
    factor, unit = (180 / np.pi, "deg") if axis.unit == "rad" else (1e3, "mm")
    runs = axis.runs
    rows = [[f"{factor * v:.5g}", f"{t:.3g}", f"{i:.4g}", f"{s:.2g}", f"{factor * e:.6g}"] for v, t, i, s, e in
            zip(runs.velocity, runs.duration, runs.current, runs.scatter, runs.following_error, strict=True)]
    heads = [f"speed, {unit}/s", "duration, s", f"load, {axis.force_unit or '-'}", "scatter", f"following error, {unit}"]
    return Table(heads, rows)
