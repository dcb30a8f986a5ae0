"""Do the stated errors of limits from noisy measured FRFs hold? Random structures, cuts and noise; last line: per cent held.

The true limit is that of the modes, exact; the measured response is theirs on lines with noise. 95 % of the limits should lie
within their stated error. Run: python benchmarks/cutting/noise.py --cuts 200 --noise 0.01
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.vibration import Frf, Modes, frequency_response


def noisy(modes: Modes, noise: float, rng: np.random.Generator, *, step: float, stated: bool) -> Frf:
    """Measured lines of modes: complex noise of this share of the response's root mean square, on every line alike."""
    clean = frequency_response.modal(modes, np.arange(20.0, 3000.0, step))
    level = noise * np.sqrt((np.abs(clean.values) ** 2).mean())
    pair = rng.standard_normal(clean.values.shape) + 1j * rng.standard_normal(clean.values.shape)
    variance = np.full(clean.values.shape, level**2) if stated else None
    return Frf(clean.frequency, clean.values + level * pair / np.sqrt(2), clean.outputs, clean.inputs, "receptance",
               variance=variance)


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("cuts", 100)
    parser.add_argument("--noise", type=float, default=0.01)
    parser.seed(0)
    parser.add_argument("--stated", action="store_true", help="the FRF states its variance")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(options.seed)
    held, ratios = [], []
    for _ in range(options.cuts):
        count = int(rng.integers(1, 5))
        modes = Modes(np.sort(rng.uniform(300, 1500, count)), 10 ** rng.uniform(-1.9, -1.2, count),
                      rng.standard_normal((2, count)) / np.sqrt(2), ("tool:+x", "tool:+y"))
        engagement = Engagement.down(float(rng.choice([0.1, 0.3, 0.6, 1.0])))
        cut = {"tool": Tool(0.016, int(rng.integers(2, 5))), "engagement": engagement,
               "coefficients": CuttingCoefficients(7e8, 2.5e8)}
        speed = np.array([rng.uniform(3000, 14000)])
        frf = noisy(modes, options.noise, rng, step=2.0, stated=options.stated)
        exact = stability.chart(MillingProblem(dynamics=modes, **cut), speed, depth_max=0.03)
        if not np.isfinite(exact.limit[0]):
            continue
        chart = stability.chart(MillingProblem(dynamics=frf, **cut), speed, HillDeterminant(), depth_max=0.03)
        point = chart.limit_points()[0]
        off = abs(chart.limit[0] - exact.limit[0])
        error = chart.error[point] if point >= 0 else np.inf
        held.append(off <= error)
        ratios.append(off / error if np.isfinite(error) else np.nan)
        print(f"{speed[0]:.0f} rev/min: {1e3 * exact.limit[0]:.4f} mm, measured {1e3 * chart.limit[0]:.4f} +- {1e3 * error:.4f}"
              f"{'' if held[-1] else '   OUTSIDE'}", flush=True)
    print(f"median stated over true error {1 / np.nanmedian(ratios):.2f}, worst {np.nanmax(ratios):.2f} times outside")
    print(f"{100 * np.mean(held):.1f} % of {len(held)} limits within their stated 95 % error")


if __name__ == "__main__":
    main()
