"""The page of a Campbell diagram: frequencies over the spindle speed, whirl, critical speeds."""

from __future__ import annotations

import numpy as np

from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.campbell import campbell_diagram
from toolpoint.studies.machines.campbell import SENSES, Campbell
from toolpoint.studies.machines.pose_words import pose_words


def campbell_page(result: Campbell) -> Report:
    """Return the page of a Campbell diagram."""
    report = Report(f"Campbell diagram: {result.machine.name}", "Natural frequencies without damping while the spindle turns.",
                    subtitle=pose_words(result.machine, result.pose))
    chart = campbell_diagram(result.speeds, result.frequency, result.whirl, orders=result.orders)
    rows = [[f"{order:g}", round(speed, 1), round(f, 3), SENSES[w + 1]] for order, speed, f, w in result.critical]
    spread = np.ptp(result.frequency, axis=0)
    words = [f"mode {int(k) + 1} moves most: by {spread[k]:.4g} Hz over the range" for k in [np.argmax(spread)]]
    table = Table(["per revolution", "rev/min", "Hz", "whirl"], rows, "Critical speeds: where a line meets a mode")
    return report.with_section("Frequencies over the spindle speed", Chart(chart), *([table] if rows else []),
                               Notes(words, "note"))
