"""786 responses of 2000 lines to a universal file and back, beside pyuff; bit-exactness, CPU time and memory beside time.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/io/uff_responses.py [--runs 5] [--peers PYTHON] [--json]

Times are the best of the runs (pyuff writes once, its writing takes long). Text holds 13 digits, as the format has no more:
what is read from it must have the bits that Python's float gives of every written number. Memory is the peak of what is
allocated beyond the responses themselves, as tracemalloc sees it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import Dof, Frf
from toolpoint.io import uff

PEER = """
import json, os, sys, time
import numpy as np, pyuff
values, axis = np.load(sys.argv[1]), np.arange(2000) * 0.25
flat = values.reshape(2000, -1).T
digits = np.load(sys.argv[3])
result = {}
for binary, wanted in ((1, values), (0, digits)):
    sets = [dict(type=58, binary=binary, func_type=4, rsp_node=i // 2 + 1, rsp_dir=1, ref_node=i % 2 + 1, ref_dir=1, x=axis,
                 data=np.ascontiguousarray(row), abscissa_spacing=1, abscissa_spec_data_type=18,
                 ordinate_spec_data_type=12, orddenom_spec_data_type=13) for i, row in enumerate(flat)]
    start = time.perf_counter()
    pyuff.UFF(sys.argv[2]).write_sets(sets, "add")
    wrote = time.perf_counter() - start
    reads = []
    for _ in range(3):
        start = time.perf_counter()
        back = pyuff.UFF(sys.argv[2]).read_sets()
        reads.append(time.perf_counter() - start)
    exact = all(np.array_equal(one["data"], row) for one, row in zip(back, wanted.reshape(2000, -1).T))
    result["binary" if binary else "text"] = {"write_s": wrote, "read_s": min(reads), "exact": bool(exact),
                                              "mb": os.path.getsize(sys.argv[2]) / 1e6}
    os.remove(sys.argv[2])
print(json.dumps(result))
"""


def timed(act: Callable[[], object], runs: int) -> tuple[float, float]:
    """Return the least wall and CPU time of an act."""
    walls, cpus = [], []
    for _ in range(runs):
        wall, cpu = time.perf_counter(), time.process_time()
        act()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return min(walls), min(cpus)


def peak(act: Callable[[], object]) -> float:
    tracemalloc.start()
    act()
    top = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return top / 1e6


def measured(frf: Frf, path: Path, text: bool, wanted: np.ndarray, runs: int) -> dict[str, object]:
    write = timed(lambda: uff.write(path, frf, text=text), runs)
    read = timed(lambda: uff.read_frf(path), runs)
    heads = timed(lambda: uff.headers(path), runs)
    return {"write_s": write[0], "write_cpu_s": write[1], "read_s": read[0], "read_cpu_s": read[1], "headers_s": heads[0],
            "sets": len(uff.headers(path)), "exact": bool(np.array_equal(uff.read_frf(path).values, wanted)),
            "mb": path.stat().st_size / 1e6, "write_peak_mb": peak(lambda: uff.write(path, frf, text=text)),
            "read_peak_mb": peak(lambda: uff.read_frf(path))}


def thirteen_digits(values: np.ndarray) -> np.ndarray:
    """Return what Python's float makes of the numbers written with 13 digits."""
    flat = [float(f"{number:.12E}") for number in values.reshape(-1).view(float).tolist()]
    return np.array(flat).view(complex).reshape(values.shape)


def main() -> None:
    parser = CommandLine(__doc__)
    parser.cases("runs", 5)
    parser.peers("interpreter that has pyuff")
    parser.json()
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    values = rng.standard_normal((2000, 393, 2)) + 1j * rng.standard_normal((2000, 393, 2))
    digits = thirteen_digits(values)
    dofs = [Dof(point + 1, way) for point in range(131) for way in ("+x", "+y", "+z")]
    frf = Frf(np.arange(2000) * 0.25, values, dofs, dofs[:2], "accelerance")
    with tempfile.TemporaryDirectory() as folder:
        result: dict[str, dict[str, object]] = {
            "binary": measured(frf, Path(folder) / "b.unv", False, values, options.runs),
            "text": measured(frf, Path(folder) / "t.unv", True, digits, options.runs)}
        np.save(Path(folder) / "v.npy", values)
        np.save(Path(folder) / "d.npy", digits)
        run = subprocess.run([options.peers, "-c", PEER, f"{folder}/v.npy", f"{folder}/p.unv", f"{folder}/d.npy"],
                             capture_output=True, text=True, check=False)
    peers = json.loads(run.stdout) if run.returncode == 0 else {
        "": {"error": (run.stderr.strip().split("\n") or [""])[-1][:120]}}
    result |= {f"pyuff {name}".strip(): entry for name, entry in peers.items()}
    if options.json:
        print(json.dumps(result))
        return
    for name, entry in result.items():
        print(f"{name:12s} " + ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in entry.items()))
    print("universal file: " + "; ".join(
        f"{name} written in {one['write_s']:.2f} s, read in {one['read_s']:.2f} s, exact {one['exact']}"
        for name, one in result.items() if name in ("binary", "text")))


if __name__ == "__main__":
    main()
