"""Servo simulation: two dq axes, 20 structural modes, LuGre friction; seconds per simulated second beside the error.

The reference solution is DOP853 at 1e-12 between the same sampled controllers. Peers run the same plant in the same run:
scipy's solvers here; pathsim (the same plant, voltages held, no controllers) and motulator (two drives of one dq motor and
two masses each with its own current and speed control: no frame, no friction law) where the interpreter given by --peers
has them.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import ROOT, CommandLine

CASES = str(ROOT / "tests" / "drives")
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
spent = (time.process_time() - start) / 0.02
from scipy.integrate import solve_ivp
exact = solve_ivp(lambda t, x: rate(x, None, t), (0.0, 0.02), d["x"], "DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
error = d["scale"] @ (block.engine.get() - exact)[:n]
print(json.dumps({"seconds per simulated second": spent, "error nm": 1e9 * float(np.abs(error).max())}))
"""

MOTULATOR = """
import json, sys, time
import numpy as np
from motulator.drive import model
import motulator.drive.control.sm as control
from motulator.drive.utils import SynchronousMachinePars, TwoMassMechanicalSystemPars
d = np.load(sys.argv[1])
p, R, Ld, Lq, psi = d["motor"]
J, JL, K, C, B = d["masses"]
par = SynchronousMachinePars(n_p=int(p), R_s=R, L_d=Ld, L_q=Lq, psi_f=psi)
two = TwoMassMechanicalSystemPars(J_M=J, J_L=JL, K_S=K, C_S=C, B_L=B)
def run(span, max_step):
    drive = model.Drive(model.VoltageSourceConverter(u_dc=554.0), model.SynchronousMachine(par),
                        model.TwoMassMechanicalSystem(two))
    ctrl = control.CurrentVectorControl(par, control.CurrentReferenceCfg(par, nom_w_m=2 * np.pi * 100, max_i_s=60.0),
                                        T_s=1.25e-4, J=J + JL, alpha_c=2 * np.pi * 500, sensorless=False)
    ctrl.speed_ctrl = control.SpeedController(J + JL, 2 * np.pi * 25)
    ctrl.ref.w_m = lambda t: p * 40.0 * np.sin(6.67 * t)
    sim = model.Simulation(drive, ctrl)
    start = time.process_time()
    sim.simulate(t_stop=span, max_step=max_step)
    return (time.process_time() - start) / span, drive.mechanics.state.w_M
spent, one = run(0.1, np.inf)
other = run(0.02, 5e-6)[1]
coarse = run(0.02, np.inf)[1]
print(json.dumps({"seconds per simulated second": 2 * spent, "relative error of the speed": float(abs(coarse / other - 1))}))
"""


def speed(servo: object, command: object, substeps: int, runs: int) -> float:
    """Return the least CPU seconds of a simulation of one second."""
    from toolpoint.drives.simulation.kernel import run
    from toolpoint.drives.simulation.simulate import prepare

    best = np.inf
    for _ in range(runs):
        arguments = prepare(servo, command, substeps=substeps, record_interval=substeps, duration=1.0).arguments  # type: ignore
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
        made = simulate(servo, command, substeps=n, record_interval=n)  # type: ignore
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


def peers(servo: object, interpreter: str) -> dict[str, dict[str, object]]:
    """Return pathsim's figure on the plant with constant voltages for 0.02 s, and motulator's on two simpler drives."""
    from servo_cases import MOTOR, RATIO, lugre

    p, law = servo.plant, lugre()  # type: ignore
    motor = [MOTOR.pole_pairs, MOTOR.resistance, MOTOR.inductance_d, MOTOR.inductance_q, MOTOR.flux]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plant.npz"
        np.savez(path, a=p.a, bw=p.b_scalar, sc=p.scalars, one=p.products[:, 0], other=p.products[:, 1], n=p.a.shape[0],
                 law=[law.stiffness, law.damping, law.coulomb, law.static, law.stribeck_velocity],
                 drive=p.b_input @ np.array([0.0, 3.0, 0.0, 2.0]), x=np.zeros(p.a.shape[0] + 2),
                 scale=p.outputs.reshape(2, 7, -1)[:, 2], motor=motor,
                 masses=[0.008, 400.0 * RATIO**2, 1.2e8 * RATIO**2, 6e3 * RATIO**2, 0.01])
        return {name: _peer(interpreter, script, path) for name, script in (("pathsim", PEER), ("motulator", MOTULATOR))}


def _peer(interpreter: str, script: str, path: Path) -> dict[str, object]:
    run = subprocess.run([interpreter, "-c", script, str(path)], capture_output=True, text=True, check=False)
    if run.returncode:
        return {"error": run.stderr.strip().split("\n")[-1][:160]}
    return json.loads(run.stdout.strip().split("\n")[-1])


def large(modes: int = 200) -> dict[str, float]:
    """Return states and least CPU seconds per simulated second of two axes on a frame of many modes; also dense."""
    from servo_cases import benchmark_command, benchmark_servo, lugre

    from toolpoint.drives import Servo, Structure, build_plant
    from toolpoint.drives.simulation.exact_step import step_matrices
    from toolpoint.drives.simulation.kernel import run
    from toolpoint.drives.simulation.simulate import prepare
    from toolpoint.vibration import Modes

    rng, base = np.random.default_rng(0), benchmark_servo(lugre())
    places = ("base:+x", "base:+y", "tool:+x", "tool:+y")
    shape = Modes(np.sort(rng.uniform(30, 2000, modes)), np.full(modes, 0.02), 5e-3 * rng.standard_normal((4, modes)), places)
    frame = Structure.from_modes(shape, {"x.base": places[0], "y.base": places[1]}, {"x": places[2], "y": places[3]})
    servo = Servo(build_plant(base.plant.axes, frame), base.controllers)
    matrices = step_matrices(servo.plant, servo.controllers[0].sample_times[0] / 2, dense=True)
    arguments = prepare(servo, benchmark_command(1.0), substeps=2, record_interval=2, duration=1.0, matrices=matrices).arguments
    start = time.thread_time()
    run(*arguments)
    dense = time.thread_time() - start
    return {"states": servo.plant.a.shape[0] + 2, "two steps": speed(servo, benchmark_command(1.0), 2, 5), "dense": dense}


def two_drives() -> float:
    """Return the own least CPU seconds per simulated second on motulator's plant: two dq motors with two masses each."""
    from servo_cases import MOTOR, RATIO, benchmark_command, controller

    from toolpoint.drives import DriveAxis, Servo, build_plant, two_mass_axis

    axes = [DriveAxis(name, MOTOR, two_mass_axis(0.008, 400.0, RATIO, stiffness=1.2e8, damping=6e3,
                                                 motor_damping=0.01)) for name in "xy"]
    return speed(Servo(build_plant(axes), (controller(), controller())), benchmark_command(1.0), 1, 10)


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
        "200 structural modes": large(),
        "two drives alone": two_drives(),
        **peers(servo, options.peers),
    }


def _ratio(result: dict[str, object], name: str, own: float) -> str:
    found = result[name].get("seconds per simulated second")  # type: ignore[attr-defined]
    return f", than {name} {found / own:.0f}" if found else f", {name} not installed"


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("runs", 20)
    parser.add_argument("--duration", type=float, default=0.1, help="s of the accuracy run, around a reversal")
    parser.peers("interpreter that has pathsim and motulator")
    parser.json()
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
          f"{result['scipy RK45 1e-8'] / own[best]:.0f} times faster than scipy RK45"  # type: ignore[operator,index]
          + _ratio(result, "pathsim", own[best]) + _ratio(result, "motulator", result["two drives alone"]))  # type: ignore


if __name__ == "__main__":
    main()
