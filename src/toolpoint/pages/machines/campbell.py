"""The page of a Campbell diagram: frequencies over the spindle speed, whirl, critical speeds."""

from __future__ import annotations

import numpy as np

from toolpoint._rounding import number_text
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.machines.campbell import campbell_diagram
from toolpoint.studies.machines.campbell import SENSES, Campbell
from toolpoint.studies.machines.pose_words import pose_words


def campbell_page(result: Campbell) -> Report:
    """Return the page of a Campbell diagram: the diagram, the critical speeds (rev/min) and the assumptions.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription, SpinDescription
    >>> from toolpoint.studies import map_speeds
    >>> rotor = BodyDescription(4.0, inertia=InertiaDescription(0.03, 0.03, 0.02), spin=SpinDescription(2000.0))
    >>> bearings = JointDescription("ground", "rotor", stiffness={"rx": 4e5, "ry": 4e5})
    >>> spindle = build(MachineDescription("rotor", {"rotor": rotor}, {"bearings": bearings},
    ...                                    points={"nose": PointDescription("rotor")}, tool="nose"))
    >>> page = campbell_page(map_speeds(spindle, [0.0, 15000.0, 30000.0], 2))
    >>> page.summary.split(";")[0]
    '3 critical speeds lie between 0 and 30000 rev/min'
    """
    report = Report(f"Campbell diagram: {result.machine.name}", _answer(result),
                    subtitle=pose_words(result.machine, result.pose))
    chart = campbell_diagram(result.speeds, result.frequency, result.whirl, orders=result.orders)
    rows = [[f"{order:g}", f"{speed:.0f}", float(f), SENSES[w + 1]] for order, speed, f, w in result.critical]
    spread = np.ptp(result.frequency, axis=0)
    words = [f"mode {int(k) + 1} moves most: by {spread[k]:.4g} Hz over the range" for k in [np.argmax(spread)]]
    table = Table(["per revolution", "rev/min", "Hz", "whirl"], rows, "Critical speeds: where a line meets a mode")
    return report.with_section("Frequencies over the spindle speed", Chart(chart), *([table] if rows else []),
                               Notes(words, "note")).with_assumptions(
        "Natural frequencies without damping; the machine is linear about its pose.",
        f"Computed at {len(result.speeds)} speeds; between them lines are straight.",
        "A critical speed is where an excitation of a whole or given order meets a mode: how strongly it shakes is not told.")


def _answer(result: Campbell) -> str:
    """Return the number of critical speeds and the lowest of them, rev/min, in a sentence; or that there is none."""
    speed_min, speed_max = float(result.speeds[0]), float(result.speeds[-1])
    if not result.critical:
        return f"No critical speed lies between {speed_min:.0f} and {speed_max:.0f} rev/min for the orders looked at."
    order, speed, frequency, whirl = min(result.critical, key=lambda row: row[1])
    count = len(result.critical)
    return (f"{count} critical speed{'s lie' if count > 1 else ' lies'} between {speed_min:.0f} and {speed_max:.0f} rev/min; "
            f"the lowest is {speed:.0f} rev/min, where {order:g} per revolution meets {number_text(float(frequency))} Hz "
            f"({SENSES[whirl + 1]}).")

