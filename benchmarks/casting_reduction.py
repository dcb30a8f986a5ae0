"""A casting reduced with three six-DOF interfaces, by our reduction and by a plain one with CHOLMOD or SuperLU beside it.

Run: python benchmarks/casting_reduction.py [ELEMENT_SIZE_M ...]      0.0285 gives 187 000 rows
Each way has a process of its own, one thread; CPU seconds with assembly, and the largest memory of the process. The plain
way is what a script with that solver does: factor of K + s M, twenty modes by ARPACK without a count, 18 static responses.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from scipy.sparse import csc_array  # noqa: E402
from scipy.sparse.linalg import LinearOperator, eigsh  # noqa: E402
from sparse_solvers import column  # noqa: E402

from toolpoint.bodies.solid import Patch, SolidModel  # noqa: E402
from toolpoint.machine.parts.elastic_body import reduce_solid  # noqa: E402
from toolpoint.vibration.sparse import factorise  # noqa: E402

BAND = 900.0  # Hz: twenty elastic modes to 1.5 times that
SUPERLU_MOST = 200_000
PLACES = {"foot": Patch([0.22, 0.2, 0.0], [1, 0, 0], [0, -1, 0], 0.3, 0.3),
          "left": Patch([0.08, 0.44, 0.8], [0, 0, 1], [1, 0, 0], 0.12, 0.05),
          "right": Patch([0.36, 0.44, 0.8], [0, 0, 1], [1, 0, 0], 0.12, 0.05)}


def plain(model: SolidModel, solver: str) -> int:
    """Reduce as a short script would; return the number of shapes."""
    k, m = model.assembled()
    loads = np.hstack([patch.averages(model).toarray() for patch in PLACES.values()])
    shift = (2 * np.pi * 0.1 * BAND) ** 2
    factors = factorise(csc_array(k + shift * m), solver=solver)
    n = k.shape[0]
    inverse = LinearOperator((n, n), matvec=lambda x: factors.solve(x.reshape(n)), dtype=float)
    _, vectors = eigsh(k, 26, m, sigma=-shift, OPinv=inverse)
    shapes = np.hstack([vectors, factors.solve(loads)])
    small = shapes.T @ (k @ shapes), shapes.T @ (m @ shapes)
    return small[0].shape[0]


def run(solver: str, size: float) -> None:
    """Print coordinates, CPU seconds, memory and shapes of one way."""
    warm = column(0.09)
    reduce_solid(warm, PLACES, band=BAND) if solver == "ours" else plain(warm, solver)
    start = time.process_time()
    model = column(size)
    shapes = reduce_solid(model, PLACES, band=BAND).modal_count if solver == "ours" else plain(model, solver)
    used = time.process_time() - start
    print(model.size, used, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, shapes)


def main() -> None:
    """Print one line a way and size; the last line is the figure."""
    if len(sys.argv) > 2 and sys.argv[1] == "--one":
        run(sys.argv[2], float(sys.argv[3]))
        return
    for size in [float(a) for a in sys.argv[1:]] or [0.033]:
        rows, seconds = 0, dict[str, float]()
        for solver in ("ours", "CHOLMOD", "SuperLU"):
            if solver == "SuperLU" and rows > SUPERLU_MOST:
                continue
            done = subprocess.run([sys.executable, __file__, "--one", solver, str(size)], capture_output=True, text=True,
                                  check=False)
            if done.returncode:
                print(f"  {solver}: {(done.stderr.splitlines() or ['failed'])[-1]}")
                continue
            words = done.stdout.split()
            rows, seconds[solver] = int(words[0]), float(words[1])
            print(f"{rows} rows, {solver:8s} {seconds[solver]:7.1f} CPU s, {float(words[2]):.2f} GB, {words[3]} shapes",
                  flush=True)
        over = ", ".join(f"{seconds['ours'] / used:.2f} x {name}" for name, used in seconds.items() if name != "ours")
        print(f"{rows} rows: {seconds['ours']:.1f} CPU s, {over}")


if __name__ == "__main__":
    main()
