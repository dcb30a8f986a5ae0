"""A casting reduced with three six-DOF interfaces, by our reduction and by a plain one with CHOLMOD or SuperLU beside it.

Run: python benchmarks/bodies/casting_reduction.py [ours,CHOLMOD,SuperLU,COLAMD] [ELEMENT_SIZE_M[:HEIGHT_M] ...]
SuperLU is that of SciPy in symmetric mode with its minimum-degree ordering of A + A^T, the best that it can; COLAMD is what
`splu(K)` and `eigsh(K, sigma=...)` do where nothing is said: an ordering for unsymmetric matrices, pivots off the diagonal.
0.0299:1.22 gives 155 000 rows, 0.0165:1.4 505 000, 0.0125:1.37 a million.
Each way has a process of its own, one thread; CPU seconds (user and system) with assembly, and the largest memory of the
process. The plain way is what a script with that solver does: factor of K + s M, twenty modes by ARPACK without a count, 18
static responses. "Factor and modes" are those steps alone, ours not counted either.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np  # noqa: E402
from scipy.sparse import csc_array  # noqa: E402
from scipy.sparse.linalg import LinearOperator, eigsh, splu  # noqa: E402

from benchmarks.frame import CommandLine  # noqa: E402
from benchmarks.vibration.sparse_solvers import column  # noqa: E402
from toolpoint.bodies.solid import Patch, SolidModel  # noqa: E402
from toolpoint.machine.parts.elastic_body import reduce_solid  # noqa: E402
from toolpoint.vibration.sparse import factorise  # noqa: E402
from toolpoint.vibration.sparse.lanczos import modes_of  # noqa: E402
from toolpoint.vibration.sparse.pencil import Pencil  # noqa: E402

BAND = 900.0  # Hz: twenty elastic modes to 1.5 times that
SUPERLU_MOST = 200_000
PLACES = {"foot": Patch([0.22, 0.2, 0.0], [1, 0, 0], [0, -1, 0], 0.3, 0.3),
          "left": Patch([0.08, 0.44, 0.8], [0, 0, 1], [1, 0, 0], 0.12, 0.05),
          "right": Patch([0.36, 0.44, 0.8], [0, 0, 1], [1, 0, 0], 0.12, 0.05)}


def plain(model: SolidModel, solver: str) -> tuple[int, float]:
    """Reduce as a short script would; return the number of shapes, and the seconds of factor and modes."""
    k, m = model.assembled()
    loads = np.hstack([patch.averages(model).toarray() for patch in PLACES.values()])
    shift = (2 * np.pi * 0.1 * BAND) ** 2
    start = time.process_time()
    shifted = csc_array(k + shift * m)
    factors = splu(shifted) if solver == "COLAMD" else factorise(shifted, solver=solver)
    n = k.shape[0]
    inverse = LinearOperator((n, n), matvec=lambda x: factors.solve(x.reshape(n)), dtype=float)
    _, vectors = eigsh(k, 26, m, sigma=-shift, OPinv=inverse)
    used = time.process_time() - start
    shapes = np.hstack([vectors, factors.solve(loads)])
    small = shapes.T @ (k @ shapes), shapes.T @ (m @ shapes)
    return small[0].shape[0], used


def factor_and_modes(model: SolidModel) -> float:
    """Return the seconds of our factor and twenty-six modes (six of them rigid), not counted."""
    pencil = Pencil(*model.node_matrices(), (2 * np.pi * 0.1 * BAND) ** 2, coordinates=model.dof_places)
    start = time.process_time()
    modes_of(pencil, 26, is_counted=False)
    return time.process_time() - start


def run(solver: str, model: SolidModel) -> tuple[int, float]:
    """Return the number of shapes of one way, and the seconds of factor and modes where the way tells them."""
    return (reduce_solid(model, PLACES, band=BAND).modal_count, np.nan) if solver == "ours" else plain(model, solver)


def measure(solver: str, size: float, height: float) -> None:
    """Print coordinates, CPU seconds, those of factor and modes, memory and shapes of one way."""
    run(solver, column(0.09))
    start = time.process_time()
    model = column(size, height)
    shapes, alone = run(solver, model)
    used = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(model.size, used, factor_and_modes(model) if solver == "ours" else alone, peak, shapes)


def main() -> None:
    """Print one line a way and size; the last line is the figure."""
    parser = CommandLine(__doc__)
    parser.add_argument("words", nargs="*", help="solvers with commas between, then sizes of the elements, m")
    parser.add_argument("--one", nargs=3, metavar=("SOLVER", "SIZE", "HEIGHT"), help="measure one way in this process")
    options = parser.parse_args()
    if options.one:
        measure(options.one[0], float(options.one[1]), float(options.one[2]))
        return
    words = options.words
    solvers = words.pop(0).split(",") if words and words[0][0].isalpha() else ["ours", "CHOLMOD", "SuperLU"]
    for word in words or ["0.033"]:
        size, _, height = word.partition(":")
        rows, seconds, alone = 0, dict[str, float](), dict[str, float]()
        for solver in solvers:
            if solver in ("SuperLU", "COLAMD") and rows > SUPERLU_MOST:
                continue
            done = subprocess.run([sys.executable, __file__, "--one", solver, size, height or "1.5"], capture_output=True,
                                  text=True, check=False)
            if done.returncode:
                print(f"  {solver}: {(done.stderr.splitlines() or ['failed'])[-1]}")
                continue
            first, *numbers = done.stdout.split()
            rows, (seconds[solver], alone[solver], peak, shapes) = int(first), map(float, numbers)
            print(f"{rows} rows, {solver:8s} {seconds[solver]:7.1f} CPU s (factor and modes {alone[solver]:.1f}), "
                  f"{peak:.2f} GB, {shapes:.0f} shapes", flush=True)
        over = ", ".join(f"{seconds['ours'] / used:.2f} x {name} (factor and modes {alone['ours'] / alone[name]:.2f} x)"
                         for name, used in seconds.items() if name != "ours")
        print(f"{rows} rows: {seconds['ours']:.1f} CPU s, {over}")


if __name__ == "__main__":
    main()
