"""786 responses of 2000 lines to a universal file and back, beside pyuff; bit-exactness beside time.

    OMP_NUM_THREADS=1 python benchmarks/modal_uff.py [--peers PYTHON] [--json]
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

from toolpoint import Dof, Frf
from toolpoint.io import uff

PEER = """
import json, sys, time
import numpy as np, pyuff
values, axis = np.load(sys.argv[1]), np.arange(2000) * 0.25
flat = values.reshape(2000, -1).T
sets = [dict(type=58, binary=1, func_type=4, rsp_node=i // 2 + 1, rsp_dir=1, ref_node=i % 2 + 1, ref_dir=1, x=axis,
             data=np.ascontiguousarray(row), abscissa_spacing=1, abscissa_spec_data_type=18, ordinate_spec_data_type=12,
             orddenom_spec_data_type=13) for i, row in enumerate(flat)]
start = time.perf_counter()
pyuff.UFF(sys.argv[2]).write_sets(sets, "add")
middle = time.perf_counter()
back = pyuff.UFF(sys.argv[2]).read_sets()
end = time.perf_counter()
exact = all(np.array_equal(one["data"], row) for one, row in zip(back, flat))
print(json.dumps({"write_s": middle - start, "read_s": end - middle, "exact": bool(exact)}))
"""


def measured(frf: Frf, path: Path, text: bool) -> dict[str, object]:
    start = time.perf_counter()
    uff.write(path, frf, text=text)
    middle = time.perf_counter()
    back = uff.read_frf(path)
    end = time.perf_counter()
    heads = uff.headers(path)
    last = time.perf_counter()
    return {"write_s": middle - start, "read_s": end - middle, "headers_s": last - end, "sets": len(heads),
            "exact": bool(np.array_equal(back.values, frf.values)), "mb": path.stat().st_size / 1e6}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", default=sys.executable, help="interpreter that has pyuff")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    values = rng.standard_normal((2000, 393, 2)) + 1j * rng.standard_normal((2000, 393, 2))
    dofs = [Dof(point + 1, way) for point in range(131) for way in ("+x", "+y", "+z")]
    frf = Frf(np.arange(2000) * 0.25, values, dofs, dofs[:2], "accelerance")
    with tempfile.TemporaryDirectory() as folder:
        result = {"binary": measured(frf, Path(folder) / "b.unv", False),
                  "text": measured(frf, Path(folder) / "t.unv", True)}
        np.save(Path(folder) / "v.npy", values)
        run = subprocess.run([options.peers, "-c", PEER, f"{folder}/v.npy", f"{folder}/p.unv"], capture_output=True,
                             text=True, check=False)
    result["pyuff"] = json.loads(run.stdout) if run.returncode == 0 else {
        "error": (run.stderr.strip().split("\n") or [""])[-1][:120]}
    if options.json:
        print(json.dumps(result))
        return
    for name, entry in result.items():
        print(f"{name:8s} " + ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in entry.items()))
    best = result["binary"]
    print(f"universal file: written in {best['write_s']:.2f} s, read in {best['read_s']:.2f} s, exact {best['exact']}")


if __name__ == "__main__":
    main()
