"""Is the package slower than it was? CPU time of fixed work in two checkouts, in turn, least of several rounds.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/house/before_and_now.py --before OTHER_CHECKOUT [--rounds 5]

Every case runs in a process of its own with that checkout's package and its own test cases; the first call, which loads or
compiles kernels, is not counted. The load of the machine is printed beside: CPU times beside other work scatter by 10 to 30 %.
The last line is the largest ratio, now over before.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import ROOT, CommandLine

REPEATS = 3


def least(work: Callable[[], object]) -> float:
    """Return the least CPU seconds of some runs after a first one."""
    work()
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def planner() -> dict[str, float]:
    """Set points of 20 000 short blocks: reading, planning, sampling."""
    from benchmarks.drives.setpoints import program
    from toolpoint.drives import JerkLimits, plan_motion
    from toolpoint.io.program import gcode

    text = program(20_000)
    parsed = gcode.parse(text)
    plan = plan_motion(parsed.path, JerkLimits(1, 5, 200), corner_tolerance=5e-6)
    return {"planner: parse": least(lambda: gcode.parse(text)),
            "planner: plan": least(lambda: plan_motion(parsed.path, JerkLimits(1, 5, 200), corner_tolerance=5e-6)),
            "planner: sample": least(lambda: plan.command(1e-3, 2))}


def servo() -> dict[str, float]:
    """Seconds per simulated second of the benchmark's servo, of a stiff law, and of 200 structural modes."""
    from servo_cases import benchmark_command, benchmark_servo, lugre

    from benchmarks.drives.servo_simulation import large, speed

    command = benchmark_command(1.0)
    plain, extreme = benchmark_servo(), benchmark_servo(lugre(2.0, 400.0))
    return {"servo: two axes": speed(plain, command, 1, 5), "servo: two axes, stiff friction": speed(extreme, command, 1, 5),
            "servo: 200 modes": large()["two steps"]}


def trees() -> dict[str, float]:
    """Frequencies of 8192 poses of a robot of 18 freedoms, NumPy and compiled; 1000 poses with responses."""
    from elastic_robot import robot
    from toolpoint.machine import assemble
    from toolpoint.machine.frequencies import natural_frequencies
    from toolpoint.vibration import eigen, frequency_response

    machine, table = robot(), np.random.default_rng(0).uniform(-2, 2, (8192, 6))
    poses = {f"q{i + 1}": table[:, i] for i in range(6)}
    some, lines = {name: at[:1000] for name, at in poses.items()}, np.linspace(1, 200, 400)

    def respond() -> None:
        system = assemble(machine, some, ["flange:+x", "flange:+y", "flange:+z"], modal_damping=False)
        frequency_response.modal(eigen.solve_undamped(system).with_damping(0.02), lines)

    rows = {f"trees: 8192 poses, {path}": least(lambda path=path: natural_frequencies(machine, poses, 6, path=path))
            for path in ("numpy", "compiled")}
    return {**rows, "trees: 1000 poses with responses": least(respond)}


def vision() -> dict[str, float]:
    """Displacement of 100 windows in 200 frames of random texture that moves, by every method."""
    from toolpoint.vision.clip import clip_of
    from toolpoint.vision.displacement.measure import measure, scan
    from toolpoint.vision.displacement.points import windows_at

    rng = np.random.default_rng(1)
    wide = np.fft.rfft2(rng.standard_normal((320, 320)))
    smooth = np.exp(-(np.hypot(np.fft.fftfreq(320)[:, None], np.fft.rfftfreq(320)) / 0.08) ** 2)
    shift = np.exp(-2j * np.pi * np.fft.rfftfreq(320) * 0.4 * np.sin(0.3 * np.arange(200))[:, None, None])
    texture = np.fft.irfft2(wide * smooth * shift, s=(320, 320))
    frames = np.clip(128 + 40 * texture / texture.std() + rng.standard_normal(texture.shape), 0, 255).astype(np.uint8)
    scanned = scan(clip_of(frames, 100.0))
    centres = np.stack(np.meshgrid(np.arange(30, 300, 28), np.arange(30, 300, 28)), axis=-1).reshape(-1, 2)
    windows = windows_at(scanned.reference, centres, 17)
    return {f"vision: {method}": least(lambda method=method: measure(scanned, windows, method))
            for method in ("templates", "lucas-kanade", "phase")}


CASES = {case.__name__: case for case in (planner, servo, trees, vision)}


def run_in(checkout: Path, case: str) -> dict[str, float]:
    """Return the figures of a case with the package of a checkout."""
    folders = [checkout / part for part in ("src", "tests", "tests/drives")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders)), "OMP_NUM_THREADS": "1",
                   "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, __file__, "--run", case], env=environment, stdout=subprocess.PIPE, text=True,
                          check=True)
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return figures


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("--before", type=Path, help="the other checkout")
    parser.cases("rounds", 5)
    parser.part("cases", default=",".join(CASES))
    parser.add_argument("--run", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        print(json.dumps(CASES[options.run]()))
        return
    if options.before is None:
        parser.error("--before: the other checkout is missing")
    best: dict[str, list[float]] = {}
    for _ in range(options.rounds):
        for case in options.cases.split(","):
            for column, checkout in enumerate((options.before.resolve(), ROOT)):
                for name, seconds in run_in(checkout, case).items():
                    row = best.setdefault(name, [np.inf, np.inf])
                    row[column] = min(row[column], seconds)
    print(f"{'CPU seconds, least of ' + str(options.rounds):34s} {'before':>9s} {'now':>9s} {'ratio':>6s}")
    for name, (before, now) in best.items():
        print(f"{name:34s} {before:9.4f} {now:9.4f} {now / before:6.2f}")
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; largest ratio {max(b / a for a, b in best.values()):.2f}")


if __name__ == "__main__":
    main()
