"""Modes from 786 frequency responses: accuracy, honesty of the intervals, CPU time and memory, beside other packages.

The structure: 131 points x 3 directions x 2 references, 2000 lines to 499.75 Hz, 12 modes in the band 20 .. 490 Hz and
three above, 1 % and 5 % noise (see tests/modal_identification/modal_case.py). Run with one BLAS thread:

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/modal_identification/many_responses.py [--seeds 100] [--json]

Peers run only where they import (sdypy-EMA, pyFBS, SDynPy); of their poles of order 60 those nearest to the true
frequencies are taken, a hint that no user has; toolpoint finds its modes alone.
`--peers PYTHON` runs them with another interpreter (a virtual environment of their own) that needs no toolpoint.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import ROOT, CommandLine

CASES = str(ROOT / "tests" / "modal_identification")
sys.path.insert(0, CASES)

# Peak memory of this process alone: getrusage would report that of the parent it was forked from.
PEAK = """
def peak():
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
"""

CHILD = PEAK + """
import json, sys, time
import numpy as np
from toolpoint import Frf
from toolpoint.modal_identification import identify
import scipy.linalg, scipy.optimize
from modal_case import labels
values, lines = np.load(sys.argv[1]), np.arange(2000) * 0.25
dofs = labels(131)
frf = Frf(lines, values, dofs, dofs[:2], "accelerance")
del values
start = time.process_time()
found = identify(frf, band=(20.0, 490.0))
cpu = time.process_time() - start
print(json.dumps({"cpu": cpu, "mb": peak(), "modes": found.modes.count}))
"""

PEERS = PEAK + """
import contextlib, io, json, sys, time, warnings
warnings.filterwarnings("ignore")
import numpy as np
values, hint = np.load(sys.argv[1]), np.array(json.loads(sys.argv[2]))
lines = np.arange(2000) * 0.25
flat = np.ascontiguousarray(values.reshape(2000, -1).T)
def sdypy():
    from sdypy import EMA
    model = EMA.Model(flat, lines, lower=20, upper=490, pol_order_high=60, frf_type="accelerance")
    model.get_poles(show_progress=False)
    return nearest(np.array(model.pole_freq[-1]), np.array(model.pole_xi[-1]))
def nearest(f, z):
    good = (z > 0.001) & (z < 0.1)
    f, z = f[good], z[good]
    at = [int(np.argmin(np.abs(f - one))) for one in hint]
    return f[at], z[at]
def pyfbs():
    from pyfbs.modal_id.modal_id import ModalID
    inside = (lines >= 20) & (lines <= 490)
    model = ModalID(lines[inside], values[inside])
    model.p_lscf(60)
    s = np.array(model.poles[-1]).ravel()
    return nearest(np.abs(s) / 2 / np.pi, -s.real / np.abs(s))
def sdynpy():
    import sdynpy as sd
    from sdynpy.modal.sdynpy_polypy import PolyPy
    out = sd.coordinate_array(np.arange(393)[:, None] + 1, 1)
    ref = sd.coordinate_array(np.array([1, 2]), 1)
    pairs = np.stack(np.broadcast_arrays(out, ref), axis=-1)
    kind = sd.data.FunctionTypes.FREQUENCY_RESPONSE_FUNCTION
    frf = sd.data_array(kind, lines, np.moveaxis(values, 0, -1), pairs)
    model = PolyPy(frf, 20, 490, 2)
    model.compute_poles(np.arange(2, 61, 2))
    last = max(model.pole_list, key=len)
    return nearest(np.abs(last["omega"]) / 2 / np.pi, last["zeta"])
name = sys.argv[3]
with contextlib.redirect_stdout(io.StringIO()):
    start = time.process_time()
    try:
        f, z = {"sdypy-EMA": sdypy, "pyFBS": pyfbs, "SDynPy": sdynpy}[name]()
        result = {"f": f.tolist(), "z": z.tolist()}
    except Exception as error:
        result = {"error": f"{type(error).__name__}: {error}"[:120]}
    result |= {"cpu": time.process_time() - start, "mb": peak()}
print(json.dumps(result))
"""


def accuracy(seeds: int, noise: float, placed: bool) -> dict[str, float]:
    """Return worst errors over all seeds, the coverage of the 95 % intervals, and the modes missed or invented."""
    from modal_case import BAND, DAMPING, IN_BAND, benchmark, with_noise

    from toolpoint.modal_identification import identify
    from toolpoint.vibration.correlation import mac

    frequency, damping, shape, inside, wrong, cpu, standard = [], [], [], [], 0, [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        case = benchmark(rng, placed=placed)
        frf = with_noise(case.frf, noise, rng)
        start = time.process_time()
        found = identify(frf, band=BAND).modes
        cpu.append(time.process_time() - start)
        if found.count != IN_BAND.size:
            wrong += 1
            continue
        frequency.append(np.abs(found.frequency / IN_BAND - 1))
        damping.append(np.abs(found.damping_ratio / DAMPING - 1))
        shape.append(np.diag(mac(found.shape, case.modes.shape[:, :IN_BAND.size])))
        standard.append([(found.frequency - IN_BAND) / found.frequency_interval * 1.96,
                         (found.damping_ratio - DAMPING) / found.damping_interval * 1.96])
        inside.append([np.abs(found.frequency - IN_BAND) < found.frequency_interval,
                       np.abs(found.damping_ratio - DAMPING) < found.damping_interval])
    covered = np.array(inside)
    return {
        "noise": noise, "seeds": seeds, "wrong_count": wrong,
        "worst_frequency_percent": 100 * float(np.max(frequency)), "worst_damping_percent": 100 * float(np.max(damping)),
        "median_worst_frequency_percent": 100 * float(np.median(np.max(frequency, axis=1))),
        "median_worst_damping_percent": 100 * float(np.median(np.max(damping, axis=1))),
        "lowest_mac": float(np.min(shape)), "median_lowest_mac": float(np.median(np.min(shape, axis=1))),
        "coverage_frequency": float(covered[:, 0].mean()), "coverage_damping": float(covered[:, 1].mean()),
        # 1: errors are those of an efficient estimator (Cramer-Rao), so a larger error is the data's, not the method's.
        "error_over_standard_deviation": float(np.sqrt(np.mean(np.square(standard)))),
        "median_cpu": float(np.median(cpu)),
    }


def fresh_process(noise: float) -> dict[str, float]:
    """Return CPU time and peak memory of one identification in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = _saved(Path(folder), noise)
        code = f"import sys; sys.path.insert(0, {CASES!r})\n" + CHILD
        runs = [json.loads(subprocess.run([sys.executable, "-c", code, path], check=True, capture_output=True,
                                          text=True).stdout) for _ in range(5)]
    return min(runs, key=lambda run: run["cpu"])


def _saved(folder: Path, noise: float) -> str:
    from modal_case import benchmark, with_noise

    rng = np.random.default_rng(0)
    np.save(folder / "frf.npy", with_noise(benchmark(rng).frf, noise, rng).values)
    return str(folder / "frf.npy")


def peers(interpreter: str, noise: float) -> dict[str, dict[str, object]]:
    """Return the same figures of the peers that import."""
    from modal_case import DAMPING, IN_BAND

    table: dict[str, dict[str, object]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = _saved(Path(folder), noise)
        for name in ("sdypy-EMA", "pyFBS", "SDynPy"):
            run = subprocess.run([interpreter, "-c", PEERS, path, json.dumps(IN_BAND.tolist()), name],
                                 capture_output=True, text=True, check=False,
                                 env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
            if run.returncode:
                table[name] = {"error": run.stderr.strip().split("\n")[-1][:120]}
                continue
            result = json.loads(run.stdout.strip().split("\n")[-1])
            entry: dict[str, object] = {"cpu": result["cpu"], "mb": result["mb"]}
            if "f" in result:
                f, z = np.array(result["f"]), np.array(result["z"])
                entry["worst_frequency_percent"] = 100 * float(np.abs(f / IN_BAND - 1).max())
                entry["worst_damping_percent"] = 100 * float(np.abs(z / DAMPING - 1).max())
            else:
                entry["error"] = result["error"]
            table[name] = entry
    return table


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("seeds", 100)
    parser.peers("interpreter that has the peers")
    parser.add_argument("--references", choices=("placed", "random"), default="placed",
                        help="where a tester would put them, or anywhere (a mode may then hardly be seen)")
    parser.json()
    options = parser.parse_args()
    result = {"toolpoint": {f"{noise:g}": accuracy(options.seeds, noise, options.references == "placed")
                            | fresh_process(noise) for noise in (0.01, 0.05)},
              "peers": {f"{noise:g}": peers(options.peers, noise) for noise in (0.01, 0.05)}}
    if options.json:
        print(json.dumps(result))
        return
    for noise in ("0.01", "0.05"):
        print(f"noise {noise}")
        for key, value in result["toolpoint"][noise].items():
            print(f"  {key:34s} {value:.6g}")
        for name, entry in result["peers"][noise].items():
            print(f"  {name}: " + ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}"
                                            for k, v in entry.items()))
    best = result["toolpoint"]["0.01"]
    print(f"modal identification: {best['cpu']:.2f} s CPU, {best['mb']:.0f} MB, worst damping error "
          f"{best['worst_damping_percent']:.3f} %, {best['wrong_count']} of {best['seeds']} seeds with a wrong count")


if __name__ == "__main__":
    main()
