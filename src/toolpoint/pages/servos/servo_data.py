"""The page of a controller's record: doubts first, the quantities, and what was measured at every constant speed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.servos.drives import friction_points
from toolpoint.studies.servos.axis_findings import AxisFindings
from toolpoint.studies.servos.servo_data import ServoData

MIN_SCATTER_RATIO = 1e-9  # of the load: below it the scatter is rounding


def servo_data_page(result: ServoData, *, warnings: Sequence[str] = ()) -> Report:
    """Return the page of findings; `warnings` are those of the run.

    >>> import tempfile
    >>> from pathlib import Path
    >>> from toolpoint.io import read_servo_data
    >>> from toolpoint.samples import write_samples
    >>> from toolpoint.studies import judge_servo_data
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     trace = write_samples("servo", Path(folder, "servo")).folder / "trace.csv"
    ...     page = servo_data_page(judge_servo_data(read_servo_data(trace)))
    >>> "25 1/s" in page.summary  # the gain that was put in
    True
    """
    report = Report(f"Servo data: {PurePath(result.source).name}", _answer(result)).with_doubts(*result.doubts(), *warnings)
    report = report.with_section("Result", Table(["axis", "quantity", "value"], result.rows()))
    for axis in result.axes:
        if axis.runs.velocity.size:
            charts = [Chart(friction_points(axis.runs.velocity, axis.runs.current, axis.force_unit, unit=axis.unit))] \
                if np.isfinite(axis.runs.current).any() else []
            report = report.with_section(f"Constant speeds of axis {axis.axis}", _runs(axis), *charts)
    parts: list[Notes | Table] = [Notes([*result.notes, "Signals are what their names say; nothing else tells what they are."],
                                        "assumed")]
    if result.signals:
        parts.append(Table(["signal and what it is taken for"], [[name] for name in result.signals]))
    return report.with_section("Inputs and assumptions", *parts)


def _answer(result: ServoData) -> str:
    """Return the first quantities of every axis in a sentence."""
    rows = [row for row in result.rows() if row[2]]
    if not rows:
        return "The record holds nothing that could be judged."
    words = "; ".join(f"{f'{axis}: ' if axis else ''}{quantity} {value}" for axis, quantity, value in rows[:3])
    further_text = f"; {len(rows) - 3} more below" if len(rows) > 3 else ""
    return f"{words}{further_text}."


def _runs(axis: AxisFindings) -> Table:
    """Return load, scatter and following error of every constant speed."""
    factor, unit = (180 / np.pi, "°") if axis.unit == "rad" else (1e3, "mm")
    runs = axis.runs
    rows = [[f"{factor * v:.5g}", f"{t:.3g}", f"{i:.4g}", f"{s:.2g}" if s > MIN_SCATTER_RATIO * abs(i) else "none",
             f"{factor * e:.6g}"] for v, t, i, s, e in
            zip(runs.velocity, runs.duration, runs.current, runs.scatter, runs.following_error, strict=True)]
    heads = [f"speed, {unit}/s", "duration, s", f"load, {axis.force_unit or '-'}", "scatter", f"following error, {unit}"]
    return Table(heads, rows)
