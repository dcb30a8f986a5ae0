"""Stability lobes of a tool with one mode in each direction, and the lowest limit by hand beside the chart's."""

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, ZeroOrder, stability
from toolpoint.vibration import Modes

MASS, RATIO, FREQUENCY = 0.03993, 0.011, 922.0


def main() -> float:
    """Return the lowest stable depth of the slot, mm."""
    modes = Modes([FREQUENCY, FREQUENCY], [RATIO, RATIO], np.eye(2) / np.sqrt(MASS), ("tip:+x", "tip:+y"))
    problem = MillingProblem(Tool(0.012, 2), Engagement.slot(), CuttingCoefficients(6e8, 2e8), modes)
    chart = stability.chart(problem, np.linspace(5000, 25000, 200), ZeroOrder(), depth_max=0.002)
    lowest = 1e3 * float(chart.limit.min())
    print(f"{chart!r}\nstable at every speed below {lowest:.4f} mm")
    return lowest


if __name__ == "__main__":
    main()
