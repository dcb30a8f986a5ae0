"""CPU seconds a speed of a stability chart straight from a measured FRF of 5000 lines; last line: that figure.

Run: python benchmarks/cutting/measured_chart.py
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.vibration import Frf, Modes, frequency_response

SPEEDS = np.linspace(4000, 12000, 60)


def main() -> None:
    CommandLine(__doc__).parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(0)
    modes = Modes([400.0, 650.0, 1200.0, 2100.0], [0.04, 0.03, 0.02, 0.02],
                  np.array([[0.7, 0.2, 0.3, 0.1], [0.1, 0.8, 0.2, 0.3]]), ("tool:+x", "tool:+y"))
    clean = frequency_response.modal(modes, np.linspace(20, 5000, 5000))
    pair = rng.standard_normal(clean.values.shape) + 1j * rng.standard_normal(clean.values.shape)
    frf = Frf(clean.frequency, clean.values + 0.002 * np.abs(clean.values).mean() * pair, clean.outputs, clean.inputs)
    problem = MillingProblem(Tool(0.016, 3), Engagement.down(0.3), CuttingCoefficients(7e8, 2.5e8), frf)
    stability.chart(problem, SPEEDS[:1], depth_max=0.02)
    start = time.process_time()
    chart = stability.chart(problem, SPEEDS, depth_max=0.02)
    seconds = (time.process_time() - start) / SPEEDS.size
    exact = stability.chart(problem.changed(dynamics=modes), SPEEDS, depth_max=0.02)
    both = np.isfinite(chart.limit) & np.isfinite(exact.limit)
    off = np.abs(chart.limit / exact.limit - 1)[both]
    print(f"limits of {both.sum()} speeds within {100 * off.max():.2g} % of those of the modes, "
          f"median {100 * np.median(off):.2g} %")
    print(f"{seconds:.3f} s a speed")


if __name__ == "__main__":
    main()
