"""Set points: a 200 000-line program parsed and planned, and random moves against ruckig; seconds beside the checks."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, import_peer
from toolpoint.drives import JerkLimits, plan_motion, seven_phase
from toolpoint.io.program import gcode


def program(lines: int) -> str:
    """Return a program of short straight blocks."""
    rng = np.random.default_rng(0)
    points = np.cumsum(rng.normal(0, 0.2, (lines, 2)), axis=0)
    return "G64 G1 F3000\n" + "\n".join(f"N{i} G1 X{x:.3f} Y{y:.3f}" for i, (x, y) in enumerate(points))


def planner(lines: int) -> dict[str, float]:
    """Return CPU seconds of each stage (the compiled kernels' first load included) and the end point's error."""
    text, clock = program(lines), [time.process_time()]
    parsed = gcode.parse(text)
    clock.append(time.process_time())
    plan = plan_motion(parsed.path, JerkLimits(1, 5, 200), corner_tolerance=5e-6)
    clock.append(time.process_time())
    command = plan.command(1e-3, 2)
    clock.append(time.process_time())
    parse, look, sample = np.diff(clock)
    return {"lines": lines, "parse s": parse, "plan s": look, "sample s": sample, "path m": plan.path.lengths.sum(),
            "end error m": float(np.abs(command.position[-1] - parsed.end[-1, :2]).max()), "duration s": plan.duration}


def against_ruckig(moves: int) -> dict[str, float]:
    """Return the largest difference of durations and the time per move of both; empty where ruckig is not installed."""
    ruckig = import_peer("ruckig")
    if ruckig is None:
        return {}
    rng, worst, own, other = np.random.default_rng(2), 0.0, 0.0, 0.0
    for _ in range(moves):
        limits, length = JerkLimits(*(10 ** rng.uniform([-2, -1, 0], [1, 2, 3]))), 10 ** rng.uniform(-5, 1)
        start = time.perf_counter()
        mine = seven_phase(length, limits).duration
        own += time.perf_counter() - start
        given = ruckig.InputParameter(1)
        given.target_position, given.max_velocity = [length], [limits.speed]
        given.max_acceleration, given.max_jerk = [limits.acceleration], [limits.jerk]
        found, solver = ruckig.Trajectory(1), ruckig.Ruckig(1)
        start = time.perf_counter()
        solver.calculate(given, found)
        other += time.perf_counter() - start
        worst = max(worst, abs(mine - found.duration) / max(1.0, found.duration))
    return {"moves": moves, "largest difference": worst, "us per move": 1e6 * own / moves,
            "ruckig us per move": 1e6 * other / moves}


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("--lines", type=int, default=200_000)
    parser.cases("moves", 10_000)
    parser.json()
    options = parser.parse_args()
    result = {"program": planner(options.lines), "ruckig": against_ruckig(options.moves)}
    if options.json:
        print(json.dumps(result))
        return
    for name, part in result.items():
        print(name, ", ".join(f"{k}: {v:.6g}" for k, v in part.items()) or "not installed")
    p = result["program"]
    print(f"set points: {p['lines']} lines parsed and planned in {p['parse s'] + p['plan s']:.2f} s")


if __name__ == "__main__":
    main()
