"""Two tests of one state: how often a frequency or a shape that did not change is said to have, and one that did is not.

Run: python benchmarks/studies/two_states.py [--repeats 200]    the last line is the figure
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.studies import compare_two_states
from toolpoint.vibration import Dof, Modes

DOFS = [Dof(point, way) for point in range(20) for way in ("+x", "+y", "+z")]
FREQUENCY = np.array([20.0, 35.0, 50.0, 70.0, 90.0, 120.0])


def measured(shape: np.ndarray, frequency: np.ndarray, rng: np.random.Generator) -> Modes:
    """Return modes with 1 % noise of the shapes and 0.05 % of the frequencies, stated."""
    noise, spread = 0.01 * np.abs(shape).max(axis=0) * np.ones_like(shape), 5e-4
    covariance = (spread * frequency[:, None, None]) ** 2 * np.diag([1.0, 0.0])
    return Modes(frequency * (1 + spread * rng.standard_normal(len(frequency))), 0.02,
                 shape + noise * rng.standard_normal(shape.shape), DOFS, covariance=covariance, shape_variance=noise**2)


def main() -> None:
    """Print the shares."""
    parser = CommandLine(__doc__)
    parser.cases("repeats", 200)
    repeats = parser.parse_args().repeats
    rng = np.random.default_rng(1)
    moved, turned, missed, places = [], [], [], []
    for _ in range(repeats):
        shape = rng.normal(size=(len(DOFS), len(FREQUENCY)))
        first = measured(shape, FREQUENCY, rng)
        same = compare_two_states(("a", (first, None)), ("b", (measured(shape, FREQUENCY, rng), None)), rng=rng)
        moved.append(same.moved)
        turned.append(same.turned)
        bent = np.array(shape)
        point = int(rng.integers(20))
        bent[3 * point:3 * point + 3] += 0.1 * np.abs(shape).max(axis=0) * rng.choice([-1, 1], (3, len(FREQUENCY)))
        other = compare_two_states(("a", (first, None)), ("b", (measured(bent, FREQUENCY * (1 - 3e-3), rng), None)), rng=rng)
        missed.append(~other.moved)
        places.append(other.points[0].point == point and other.points[0].stands_out)
    print(f"unchanged, said to have moved: frequencies {100 * np.mean(moved):.1f} %, shapes {100 * np.mean(turned):.1f} % "
          f"(5 wanted); moved by 0.3 % and not said: {100 * np.mean(missed):.1f} %; a point bent by a tenth named first: "
          f"{100 * np.mean(places):.1f} %")


if __name__ == "__main__":
    main()
