"""Limits of width in turning beside closed forms written here, over random structures; measured lines that cannot carry them.

The receptance is summed over modes here; a width b chatters where 1 + b [K_f (1 - exp(-i w T)) + i w C/v] G(w) = 0, so the
first limit at a speed is the least positive b over the frequencies at which that product is real, and the width that is stable
at every speed is -1/(2 K_f min Re G).
"""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.studies import TurningCut, chart_turning
from toolpoint.studies.cuts.tool_dynamics import modal_dynamics, response_dynamics
from toolpoint.studies.cuts.turning.study import TurningStudy
from toolpoint.vibration import Dof, Frf, Modes

LABELS = ("t:+x", "t:+y", "t:+z")


@dataclass
class Structure:
    """Modes of a random tool, and a cut in a random direction."""

    frequency: np.ndarray
    ratio: np.ndarray
    shape: np.ndarray
    normal: np.ndarray
    velocity: np.ndarray
    kf: float
    kt: float
    damping: float
    surface_speed: float

    def chip_response(self, f: np.ndarray) -> np.ndarray:
        """Return n^T G (n + K_t/K_f c), m/N."""
        force = self.normal + self.kt / self.kf * self.velocity
        w, wn = 2 * np.pi * f[:, None], 2 * np.pi * self.frequency
        each = (self.normal @ self.shape) * (force @ self.shape) / (wn**2 - w**2 + 2j * self.ratio * wn * w)
        return np.asarray(each.sum(axis=1))

    def grid(self) -> np.ndarray:
        """Return frequencies close enough for interpolation to 1e-4, Hz."""
        around = [f * (1 + z * np.linspace(-10, 10, 4001)) for f, z in zip(self.frequency, self.ratio, strict=True)]
        f = np.unique(np.concatenate([np.linspace(0.01, 3000, 300_001), *around]))
        return np.asarray(f[f > 0])

    def limit(self, f: np.ndarray, g: np.ndarray, speed: float) -> float:
        """Return the first limit at a speed, m."""
        w = 2 * np.pi * f
        loop = (self.kf * (1 - np.exp(-60j * w / speed)) + 1j * w * self.damping / self.surface_speed) * g
        at = np.flatnonzero(loop.imag[1:] * loop.imag[:-1] < 0)
        share = loop.imag[at] / (loop.imag[at] - loop.imag[at + 1])
        real = loop.real[at] + share * (loop.real[at + 1] - loop.real[at])
        return float((-1 / real[real < 0]).min()) if (real < 0).any() else float("inf")


def random_structure(rng: np.random.Generator, *, damped: bool = False) -> Structure:
    """Return a structure of one to six modes of any directions."""
    n = int(rng.integers(1, 7))
    normal = rng.standard_normal(3)
    normal /= np.linalg.norm(normal)
    velocity = np.cross(normal, rng.standard_normal(3))
    kf = 10 ** rng.uniform(8, 9.5)
    shape = rng.standard_normal((3, n)) / np.sqrt(rng.uniform(0.5, 50, n))
    return Structure(np.sort(rng.uniform(40, 900, n)), rng.uniform(0.005, 0.1, n), shape, normal,
                     velocity / np.linalg.norm(velocity), kf, kf * rng.uniform(0, 2),
                     10 ** rng.uniform(3, 5) if damped else 0.0, rng.uniform(1, 4))


def study(s: Structure, response: Modes | Frf, speeds: np.ndarray) -> TurningStudy:
    """Return what the package says of the cut."""
    dynamics = modal_dynamics(response) if isinstance(response, Modes) else response_dynamics(response)
    cut = TurningCut(s.kf, s.kt, tuple(s.normal), tuple(s.velocity), s.damping, s.surface_speed if s.damping else None)
    return chart_turning(dynamics, cut, speeds)


def lines(s: Structure, f: np.ndarray, noise: float, rng: np.random.Generator) -> Frf:
    """Return measured lines with noise, m/N rms of each part."""
    w, wn = 2 * np.pi * f[:, None], 2 * np.pi * s.frequency
    values = np.einsum("ir,fr,jr->fij", s.shape, 1 / (wn**2 - w**2 + 2j * s.ratio * wn * w), s.shape)
    values = values + noise * (rng.standard_normal(values.shape) + 1j * rng.standard_normal(values.shape))
    labels = tuple(Dof.parse(name) for name in LABELS)
    return Frf(f, values, labels, labels)


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 60)
    parser.seed(0)
    parser.json()
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    worst: dict[str, float] = {"stable at every speed": 0.0, "chart": 0.0, "chart with process damping": 0.0}
    for k in range(options.runs):
        s = random_structure(rng, damped=bool(k % 2))
        f = s.grid()
        g, speeds = s.chip_response(f), np.sort(rng.uniform(300, 6000, 3))
        result = study(s, Modes(s.frequency, s.ratio, s.shape, LABELS), speeds)
        if result.limit is not None and g.real.min() < 0:
            worst["stable at every speed"] = max(worst["stable at every speed"],
                                                 abs(result.limit.width * -2 * s.kf * g.real.min() - 1))
        name = "chart with process damping" if s.damping else "chart"
        for speed, limit in zip(speeds, result.chart.limit, strict=True):
            true = s.limit(f, g, speed)
            if true < 0.99 * result.chart.depth_max or np.isfinite(limit):
                worst[name] = max(worst[name], abs(limit / true - 1))
    tally = measured(rng, options.runs)
    rows: dict[str, Any] = {f"largest relative error, {name}": value for name, value in worst.items()} | tally
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<64}{value:.3g}")
    print(f"limits within {max(worst.values()):.1e} of the closed form; measured lines more than 10 % off: "
          f"{100 * tally['wrong ones doubted']:.0f} % doubted, right ones {100 * tally['right ones doubted']:.0f} %")


def measured(rng: np.random.Generator, runs: int) -> dict[str, float]:
    """Return how often measured lines are doubted: lines of a narrow band, noisy, far apart, or good ones."""
    wrong, right = [], []
    for k in range(runs):
        s = random_structure(rng)
        f = s.grid()
        g = s.chip_response(f)
        if g.real.min() >= 0:
            continue
        low, high, step, noise = 5.0, 1500.0, 0.25, 1e-4
        if k % 4 == 1:
            high = float(rng.uniform(60, 500))
        elif k % 4 == 2:
            noise = 10 ** rng.uniform(-2.5, 0.3)
        elif k % 4 == 3:
            step = float(rng.uniform(0.5, 15))
        frf = lines(s, np.arange(low, high, step), -noise * float(g.real.min()), rng)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = study(s, frf, np.array([1000.0]))
        assert result.limit is not None
        off = abs(result.limit.width * -2 * s.kf * g.real.min() - 1) > 0.1
        doubts = [doubt for doubt in result.doubts if doubt.what in ("stable at every speed", "limits")]
        (wrong if off else right).append(bool(doubts))
        if off and not doubts:
            print(f"not doubted: case {k % 4}, band to {high:.4g} Hz, step {step:.3g} Hz, noise {noise:.2g}")
    return {"wrong ones": len(wrong), "wrong ones doubted": float(np.mean(wrong)), "right ones": len(right),
            "right ones doubted": float(np.mean(right))}


if __name__ == "__main__":
    main()
