"""Servo simulation: two dq axes, 20 structural modes, LuGre friction; seconds per simulated second beside the error.

The reference solution is DOP853 at 1e-12 between the same sampled controllers. Peers run the same plant in the same run:
scipy's solvers here; pathsim where the interpreter given by --peers has it (its own plant, the controllers' voltages held).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

CASES = str(Path(__file__).resolve().parents[1] / "tests" / "drives")
sys.path.insert(0, CASES)

PEER = """
import json, sys, time
import numpy as np
from pathsim import Simulation
from pathsim.blocks import ODE
from pathsim.solvers import RKDP54
d = np.load(sys.argv[1])
a, bw, sc, one, other, n = d["a"], d["bw"], d["sc"], d["one"], d["other"], int(d["n"])
sigma0, sigma1, fc, fs, vs = d["law"]
drive = d["drive"]
def rate(x, u, t):
    s = sc @ x[:n]
    v, z = s[:2], x[n:]
    g = fc + (fs - fc) * np.exp(-(v / vs) ** 2)
    dz = v - sigma0 * np.abs(v) * z / g
    w = np.concatenate([sigma0 * z + sigma1 * dz, s[one] * s[other]])
    return np.concatenate([a @ x[:n] + bw @ w + drive, dz])
block = ODE(rate, d["x"])
sim = Simulation([block], dt=1.25e-4, Solver=RKDP54, tolerance_lte_abs=1e-12,
                 tolerance_lte_rel=1e-8, log=False)
start = time.process_time()
sim.run(0.02)
print(json.dumps({"seconds per simulated second": (time.process_time() - start) / 0.02}))
"""


def speed(servo: object, command: object, substeps: int, runs: int) -> float:
    """Return the least CPU seconds of a simulation of one second."""
    from toolpoint.drives.kernel import run
    from toolpoint.drives.simulate import _prepare

    best = np.inf
    for _ in range(runs):
        arguments = _prepare(servo, command, substeps, substeps, None, None, None, 1.0, None).arguments  # type: ignore
        start = time.thread_time()
        run(*arguments)
        best = min(best, time.thread_time() - start)
    return best


def accuracy(servo: object, duration: float, angle: float, substeps: tuple[int, ...]) -> dict[str, float]:
    """Return the largest error of scale and tool, nm, for each number of steps in a current sample."""
    from servo_cases import benchmark_command, continuous

    from toolpoint.drives import simulate

    command = benchmark_command(duration, angle)
    states, _ = continuous(servo, command, duration)
    exact = states[:, :servo.plant.a.shape[0]] @ servo.plant.outputs.T  # type: ignore
    result = {}
    for n in substeps:
        made = simulate(servo, command, substeps=n, every=n)  # type: ignore
        m = min(len(exact), len(made.time))
        error = np.abs(made.outputs[:m].reshape(m, -1) - exact[:m]).reshape(m, -1, 7)[:, :, [2, 6]]
        result[str(n)] = 1e9 * float(error.max())
    return result


def scipy_speed(servo: object, method: str, tolerance: float, duration: float) -> float:
    """Return CPU seconds per simulated second of a scipy solver between the same controllers."""
    from servo_cases import benchmark_command, continuous

    start = time.process_time()
    continuous(servo, benchmark_command(duration, -0.06), duration, tolerance, method)
    return (time.process_time() - start) / duration


def peer(servo: object, interpreter: str) -> dict[str, object]:
    """Return pathsim's figure on the plant with constant voltages for 0.02 s."""
    from servo_cases import lugre

    p, law = servo.plant, lugre()  # type: ignore
    x = np.zeros(p.a.shape[0] + 2)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plant.npz"
        np.savez(path, a=p.a, bw=p.b_scalar, sc=p.scalars, one=p.products[:, 0], other=p.products[:, 1], n=p.a.shape[0],
                 law=[law.stiffness, law.damping, law.coulomb, law.static, law.stribeck_velocity],
                 drive=p.b_input @ np.array([0.0, 3.0, 0.0, 2.0]), x=x)
        run = subprocess.run([interpreter, "-c", PEER, str(path)], capture_output=True, text=True, check=False)
    if run.returncode:
        return {"error": run.stderr.strip().split("\n")[-1][:160]}
    return json.loads(run.stdout.strip().split("\n")[-1])


def measured(options: argparse.Namespace) -> dict[str, object]:
    """Return all figures."""
    from servo_cases import benchmark_command, benchmark_servo, lugre

    from toolpoint.drives import circular_test, simulate

    servo, extreme = benchmark_servo(), benchmark_servo(lugre(2.0, 400.0))
    command = benchmark_command(1.0)
    simulate(servo, command)
    two = simulate(servo, benchmark_command(2.0))
    last = two.time > 1.0
    return {
        "states": servo.plant.a.shape[0] + 2,
        "seconds per simulated second": {str(n): speed(servo, command, n, options.runs) for n in (1, 2)},
        "the same at F_s/F_c 400": {str(n): speed(extreme, command, n, options.runs) for n in (1, 2)},
        "error nm": accuracy(servo, options.duration, -0.5 * options.duration * 20 / 3, (1, 2, 4, 8)),
        "error nm at F_s/F_c 400": accuracy(extreme, 0.05, -0.15, (1, 2, 4, 8)),
        "circular deviation um": {name: 1e6 * circular_test(two.output(name)[last], 0.01).deviation
                                  for name in ("scale", "tool")},
        "scipy RK45 1e-8": scipy_speed(servo, "RK45", 1e-8, 0.02),
        "scipy Radau 1e-8": scipy_speed(servo, "Radau", 1e-8, 0.005),
        "scipy RK45 1e-8 at F_s/F_c 400": scipy_speed(extreme, "RK45", 1e-8, 0.02),
        "pathsim": peer(servo, options.peers),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--duration", type=float, default=0.1, help="s of the accuracy run, around a reversal")
    parser.add_argument("--peers", default=sys.executable, help="interpreter that has pathsim")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    result = measured(options)
    if options.json:
        print(json.dumps(result))
        return
    for key, value in result.items():
        shown = ", ".join(f"{k}: {v:.4g}" if isinstance(v, float) else f"{k}: {v}" for k, v in value.items()) if isinstance(
            value, dict) else f"{value:.4g}"
        print(f"{key:34s} {shown}")
    own, error = result["seconds per simulated second"], result["error nm"]
    best = next(n for n in ("1", "2") if error[n] <= 1.0 or n == "2")  # type: ignore[index]
    order = np.log2(error["2"] / error["4"])  # type: ignore[index]
    print(f"servo simulation: {own[best]:.4f} s per simulated second at {error[best]:.2f} nm "  # type: ignore[index]
          f"({best} steps a sample), order {order:.2f}, "
          f"{result['scipy RK45 1e-8'] / own[best]:.0f} times faster than scipy RK45")  # type: ignore[operator,index]


if __name__ == "__main__":
    main()
