"""Honesty of the stability engine's error estimate: random cuts against converged collocation.

For every problem the first loss of stability is compared with the root of the spectral radius by collocation with many
nodes (another formulation: monodromy matrix of the delay equation), and the stable/unstable verdict 1 % inside and
outside it. The last line is the share of points whose stated error bounds the true one.

The collocation values take nearly all the time. With ``--truth FILE`` they are kept, one JSON line a problem, and a later
run (of a changed engine, or one that was stopped) takes from the file what it needs; a value is used again only when the
engine's depth is within 1e-4 of the one it was computed from.

``--method hill`` judges HillDeterminant on measured responses: receptances of the modes to 1.3-4 times the highest of them
(at most 110 harmonics of the spindle), from the first line, 5 or 20 Hz on, every 0.5, 1 or 2 Hz. The collocation keeps the
modes, so what the band lacks and what the interpolation between lines does is in the true error.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, eigs

from benchmarks.frame import CommandLine
from toolpoint import Modes
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    Tool,
    stability,
)
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.methods.collocation import Cut, _monodromy
from toolpoint.vibration import frequency_response

TOP = 0.01
SLICES = 8  # axial slices of helical and rounded edges in the collocation; twice as many with helix


def random_problem(rng: np.random.Generator) -> MillingProblem:
    """1-20 modes in any direction of the plane, any engagement, 1-5 teeth."""
    n = int(rng.integers(1, 21))
    f, zeta, k = np.sort(rng.uniform(200, 3000, n)), rng.uniform(0.005, 0.06, n), 5e6 * rng.uniform(1, 20, n)
    angle = rng.uniform(0, np.pi, n)
    shape = 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)])
    start = rng.uniform(0, np.pi - 0.2)
    kt = rng.uniform(5e8, 2e9)
    return MillingProblem(Tool(0.016, int(rng.integers(1, 6))), Engagement(start, rng.uniform(start + 0.1, np.pi)),
                          CuttingCoefficients(kt, kt * rng.uniform(0.05, 0.7)), Modes(f, zeta, shape, ("t:+x", "t:+y")))


def general_problem(rng: np.random.Generator) -> MillingProblem:
    """A random cut that has no single delay: unequal pitch, helix (equal or each its own), process damping, rounded edges."""
    problem = random_problem(rng)
    n = int(rng.integers(2, 5))
    pitch = 2 * np.pi / n * (1 + 0.25 * (rng.uniform(-1, 1, n)))
    kind = int(rng.integers(0, 5))
    tools = (Tool(0.016, n, pitch=pitch * 2 * np.pi / pitch.sum()), Tool(0.016, n, helix=rng.uniform(0.3, 0.8)),
             Tool(0.016, n, helix=rng.uniform(0.4, 0.7, n)), Tool(0.016, n),
             Tool(0.016, n, corner_radius=rng.uniform(0.001, 0.008)))
    if kind == 4:  # where the arc of cut changes along the edge the slices of the collocation converge slowly
        alike = (Engagement.slot(), Engagement.up(0.5), Engagement.down(0.5))
        problem = problem.changed(engagement=alike[int(rng.integers(0, 3))])
    modes = problem.dynamics.selected(list(range(min(6, problem.dynamics.frequency.size))))  # type: ignore[union-attr]
    return problem.changed(tool=tools[kind], process_damping=2e4 * rng.uniform(0.1, 1) if kind == 3 else 0.0, dynamics=modes)


def measured(problem: MillingProblem, speed: float, rng: np.random.Generator) -> MillingProblem:
    """The same cut with lines of its receptance, at most 110 harmonics of the spindle (larger matrices are refused)."""
    top = float(problem.plane.span[1])
    step = rng.choice([0.5, 1.0, 2.0])
    end = min(rng.uniform(1.3, 4.0) * max(top, 1000.0), 110 * speed / 60)
    f = np.arange(rng.choice([step, 5.0, 20.0]), end, step)
    return problem.changed(dynamics=frequency_response.modal(problem.dynamics, f))  # type: ignore[arg-type]


def largest(problem: MillingProblem, speed: float, depth: float, slices: int = SLICES) -> complex:
    """The largest multiplier by converged collocation (Arnoldi on the dense matrix where it is large)."""
    plain = not problem.tool.has_helix and problem.tool.corner_radius == 0
    matrix = _monodromy(problem.plane, Cut(problem, speed, depth, 1 if plain else slices), 14 if plain else 8)
    if matrix.shape[0] > 250:
        try:
            values = eigs(matrix, k=6, ncv=60, tol=1e-13, return_eigenvectors=False, v0=np.ones(matrix.shape[0]))
        except ArpackNoConvergence:
            values = np.linalg.eigvals(matrix)
    else:
        values = np.linalg.eigvals(matrix)
    return complex(values[np.argmax(np.abs(values))])


def converged(problem: MillingProblem, speed: float, near: float) -> tuple[float, float]:
    """(depth, its own error): with helix the slices have an error, taken as the change from half as many of them."""
    if not problem.tool.has_helix:
        return root(problem, speed, near), 0.0
    few, many = root(problem, speed, near), root(problem, speed, near, 2 * SLICES)
    return many, abs(many - few)


def root(problem: MillingProblem, speed: float, near: float, slices: int = SLICES) -> float:
    """Depth near `near` where the largest multiplier has modulus one, by the secant rule."""
    a, b = near * (1 - 1e-5), near * (1 + 1e-5)
    ga, gb = (float(np.log(abs(largest(problem, speed, w, slices)))) for w in (a, b))
    for _ in range(6):
        if gb == ga:
            return np.inf
        c = b - gb * (b - a) / (gb - ga)
        if not 0 < c < 2 * near:
            return np.inf
        gc = float(np.log(abs(largest(problem, speed, c, slices))))
        a, ga, b, gb = b, gb, c, gc
        if abs(gc) < 1e-12 or abs(b - a) < 1e-13 * b:
            break
    return b


def truth(problem: MillingProblem, speed: float, near: float | None) -> dict[str, float | bool | None]:
    """Collocation's depth and verdicts 1 % inside and outside; without a depth the verdict at 0.99 of the range."""
    if near is None:
        return {"near": None, "stable": abs(largest(problem, speed, 0.99 * TOP)) < 1 + 1e-6}
    outside = 1.01 * near
    depth, own = converged(problem, speed, near)
    slices = 2 * SLICES if problem.tool.has_helix else SLICES
    return {"near": near, "depth": depth, "own": own, "inside": abs(largest(problem, speed, 0.99 * near, slices)) < 1,
            "outside": abs(largest(problem, speed, outside, slices)) < 1 if outside < TOP else None}


def usable(known: dict | None, near: float | None) -> bool:  # type: ignore[type-arg]
    """Whether a kept value answers for this depth."""
    if known is None or (known["near"] is None) != (near is None):
        return False
    return near is None or abs(known["near"] - near) <= 1e-4 * near


Judged = FloquetDeterminant | PanelArnoldi | HillDeterminant


def judged(problem: MillingProblem, speed: float, method: Judged, known: dict | None, given: MillingProblem) -> tuple:  # type: ignore
    """((depth, stated error, true error, verdicts right), truth); a depth of NaN where both find no limit. `given` is what the
    method solves, the problem itself or the same with measured lines."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # short bands are meant
        chart = stability.chart(given, [speed], method, depth_max=TOP)
    p = chart.limit_points()[0]
    near = None if p < 0 else float(chart.depth[p])
    fact = known if usable(known, near) else truth(problem, speed, near)
    assert fact is not None
    if near is None:
        return (np.nan, 0.0, 0.0, bool(fact["stable"])), fact
    bands = chart.intervals(0)
    outside = any(low <= 1.01 * near <= high for low, high in bands)
    # A stated error beyond the 1 % at which the verdicts are taken promises nothing about them.
    right = (fact["inside"] and fact["outside"] in (None, outside)) or chart.error[p] > 0.01 * near
    return (near, float(chart.error[p]), max(0.0, abs(fact["depth"] - near) - fact.get("own", 0.0)), bool(right)), fact


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("problems", 600)
    parser.seed(1)
    parser.add_argument("--truth", type=Path, help="file of collocation values to take up and go on with")
    parser.add_argument("--method", choices=("floquet", "panel", "hill"), default="floquet")
    parser.add_argument("--general", action="store_true", help="unequal pitch, helix, process damping, rounded edges")
    parser.json()
    options = parser.parse_args()
    kept = {}
    if options.truth is not None and options.truth.exists():
        kept = {row["number"]: row for row in map(json.loads, options.truth.read_text().splitlines())}
    hill, panel = options.method == "hill", options.method == "panel" or options.general
    method: Judged = HillDeterminant() if hill else PanelArnoldi() if panel else FloquetDeterminant()
    make = general_problem if options.general else random_problem
    rows, start = [], time.perf_counter()
    for number in range(options.problems):
        rng = np.random.default_rng([options.seed, number])
        problem, speed = make(rng), float(rng.uniform(3000, 15000))
        row, fact = judged(problem, speed, method, kept.get(number), measured(problem, speed, rng) if hill else problem)
        rows.append(row)
        if options.truth is not None and fact is not kept.get(number):
            with options.truth.open("a") as file:
                file.write(json.dumps({"number": number, **fact}) + "\n")
        if not options.json and (row[2] > row[1] + 1e-11 * row[0] or not row[3]):
            print(f"problem {number}, {speed:.0f} rev/min: depth {1e3 * row[0]:.6f} mm, stated {row[1]:.2e} m, true "
                  f"{row[2]:.2e} m, verdicts {'right' if row[3] else 'WRONG'}", flush=True)
    table = np.array(rows, float)
    limit = np.isfinite(table[:, 0])
    held = float(np.mean((table[:, 2] <= table[:, 1] + 1e-11 * table[:, 0])[limit]))
    result = {"problems": options.problems, "with a limit": int(limit.sum()), "bounded": held,
              "median true relative error": float(np.median((table[:, 2] / table[:, 0])[limit])),
              "median stated relative error": float(np.median((table[:, 1] / table[:, 0])[limit])),
              "verdicts right": float(np.mean(table[:, 3])), "seconds": time.perf_counter() - start}
    if options.json:
        print(json.dumps(result))
        return
    for name, value in result.items():
        print(f"{name:<30}{value:.6g}")
    print(f"stated error bounds the true one in {100 * held:.2f} % of {int(limit.sum())} points (target 99 %)")


if __name__ == "__main__":
    main()
