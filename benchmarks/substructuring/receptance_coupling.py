"""Receptance coupling: pieces against the whole up to beta l = 30, time of 2000 lines x 3 segments, coverage of the 95 % band.

Run: python benchmarks/substructuring/receptance_coupling.py [--tests 200] [--noise 0.001]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.substructuring import PlaneReceptance, SegmentDescription, ShaftDescription, couple_tool
from toolpoint.substructuring.gauge import identify_base
from toolpoint.substructuring.receptance import complex_noise
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Frf

MODES = ((300.0, 0.04, 1.2e8, 4.0), (900.0, 0.03, 1.6e8, 12.0), (1700.0, 0.02, 2.5e8, -25.0), (3200.0, 0.03, 4e8, 9.0))
GAUGE = ShaftDescription({"gauge": SegmentDescription(0.06, 0.04, loss_factor=1e-3)}, stations={"1": 0.055, "2": 0.015})
TOOL = ShaftDescription({"holder": SegmentDescription(0.04, 0.03), "shank": SegmentDescription(0.06, 0.016, material="carbide"),
                         "flutes": SegmentDescription(0.06, 0.016, material="carbide", fluted=True)})


def spindle(frequency: np.ndarray) -> np.ndarray:
    """Four modes in deflection and slope, and what lies above them."""
    values = np.zeros((frequency.size, 2, 2), complex) + np.diag([1e-9, 4e-6])
    for f, ratio, stiffness, slope in MODES:
        q = frequency / f
        values += (np.outer([1, slope], [1, slope]) / stiffness) / (1 - q**2 + 2j * ratio * q)[:, None, None]
    return values


def split_error() -> float:
    """Largest relative difference of a rod in three pieces and whole, beta l up to 30."""
    lines = np.linspace(20, 18500, 1000)

    def rod(*shares: float) -> ShaftDescription:
        return ShaftDescription({str(k): SegmentDescription(0.35 * s, 0.012, loss_factor=1e-3) for k, s in enumerate(shares)})

    base = PlaneReceptance(lines, spindle(lines))
    whole, parts = (couple_tool(base, shaft).values for shaft in (rod(1.0), rod(0.37, 0.4, 0.23)))
    return float(np.max(np.abs(whole - parts) / np.abs(whole)))


def coverage(tests: int, noise: float) -> np.ndarray:
    """Share of lines whose real and imaginary part the band holds, in each test."""
    lines, generator = np.linspace(50, 5000, 400), np.random.default_rng(5)
    truth = couple_tool(PlaneReceptance(lines, spindle(lines)), TOOL).values[:, 0, 0]
    stiffness = station_stiffness(GAUGE, lines)
    whole = stiffness.matrix.copy()
    whole[:, :2, :2] += np.linalg.inv(spindle(lines))
    at = [2 * k for k in stiffness.sections.values()]
    clean, labels = np.linalg.inv(whole)[:, at][:, :, at], ["1:+x", "2:+x"]
    variance = (noise * np.abs(clean)) ** 2
    shares = []
    for _ in range(tests):
        frf = Frf(lines, clean + complex_noise(variance, 1, generator)[0], labels, labels, variance=variance)
        low, high = couple_tool(identify_base(frf, GAUGE, generator=generator), TOOL).band()
        shares.append([np.mean((low.real <= truth.real) & (truth.real <= high.real)),
                       np.mean((low.imag <= truth.imag) & (truth.imag <= high.imag))])
    return np.array(shares)


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("tests", 200)
    parser.add_argument("--noise", type=float, default=0.001)
    given = parser.parse_args()
    print(f"pieces against the whole, beta l up to 30: {split_error():.1e}")
    lines = np.linspace(10, 5000, 2000)
    base = PlaneReceptance(lines, spindle(lines))
    times = []
    for _ in range(21):
        start = time.perf_counter()
        couple_tool(base, TOOL)
        times.append(time.perf_counter() - start)
    print(f"2000 lines x 3 segments: {1e3 * np.median(times[1:]):.2f} ms")
    shares = coverage(given.tests, given.noise)
    print(f"95 % band over {given.tests} tests with {100 * given.noise:g} % noise: holds {100 * shares.mean():.1f} % of all "
          f"lines, {100 * shares.min():.1f} .. {100 * shares.max():.1f} % in a test")


if __name__ == "__main__":
    main()
