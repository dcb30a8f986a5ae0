"""One casting by every solver that is present: factor, twenty modes, a reduction's static solutions; CPU seconds, one thread.

    python benchmarks/vibration/sparse_solvers.py [ELEMENT_SIZE_M ...]

Sizes 0.0285 and 0.0155 give about 150 000 and 500 000 coordinates.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np  # noqa: E402

from benchmarks.frame import CommandLine  # noqa: E402
from toolpoint import ToolpointError  # noqa: E402
from toolpoint.bodies.solid import CAST_IRON, STEEL, Casting, Cuboid, SolidModel  # noqa: E402
from toolpoint.vibration.sparse import factorise, modes  # noqa: E402

_SUPERLU_MOST = 200_000


def column(size: float, height: float = 1.5) -> SolidModel:
    """Hollow ribbed column 0.44 x 0.40 x 1.5 m with a web, openings and two steel rails."""
    b, d, h, wall = 0.44, 0.40, height, 0.03
    boxes = [Cuboid([0, 0, 0], [b, d, h]), Cuboid([wall, wall, wall], [b - wall, d - wall, h - wall], is_window=True)]
    for z in (0.3, 0.6, 0.9, 1.2):
        boxes += [Cuboid([wall, wall, z], [b - wall, d - wall, z + 0.02]),
                  Cuboid([0.15, 0.13, z], [0.29, 0.27, z + 0.02], is_window=True)]
    boxes += [Cuboid([0.21, wall, wall], [0.23, d - wall, h - wall]),
              Cuboid([0.15, 0.13, wall], [0.29, 0.27, h - wall], is_window=True),
              Cuboid([0.05, d, 0], [0.11, d + 0.04, h], "rail"), Cuboid([0.33, d, 0], [0.39, d + 0.04, h], "rail")]
    return Casting(boxes, {"body": CAST_IRON, "rail": STEEL}).meshed(size)


def timed(work, *args, **options):
    """Return a result and its CPU seconds."""
    start = time.process_time()
    return work(*args, **options), time.process_time() - start


def judge(k, m, places, solver: str) -> None:
    """Print the figures of one solver."""
    loads = np.random.default_rng(0).standard_normal((k.shape[0], 18))
    factors, factor = timed(factorise, k, coordinates=places, solver=solver)
    name = factors.name
    x, static = timed(factors.solve, loads)
    error = abs(k @ x - loads).max()
    del factors
    pairs, plain = timed(modes, k, m, 20, coordinates=places, solver=solver, is_counted=False)
    counted = timed(modes, k, m, 20, coordinates=places, solver=solver)[1] if solver == "multifrontal" else np.nan
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"  {name:52s} factor {factor:6.2f}  18 static {static:5.2f}  20 modes with their factor {plain:6.2f} "
          f"(counted {counted:6.2f})  residual {error:.0e}  f {pairs.frequency[0]:.4f} .. {pairs.frequency[-1]:.4f} Hz  "
          f"peak so far {peak:.1f} GB", flush=True)


def main() -> None:
    """Print one line a solver and size."""
    parser = CommandLine(__doc__)
    parser.add_argument("sizes", nargs="*", type=float, default=[0.033], help="of the elements, m")
    sizes = parser.parse_args().sizes
    warm = column(0.09)
    modes(warm.stiffness(), warm.mass(), 8, coordinates=warm.dof_places, solver="multifrontal")
    for size in sizes:
        model = column(size)
        stiffness, assembly = timed(model.stiffness)
        mass = model.mass()
        free = model.free_coordinates(model.nodes_in([-1, -1, 0], [1, 1, 0]))
        k, m, places = stiffness[free][:, free], mass[free][:, free], model.dof_places[free]
        del stiffness, mass, model
        print(f"{len(free)} coordinates, {k.nnz / 1e6:.1f} M entries, assembly {assembly:.1f} s", flush=True)
        for solver, at in (("multifrontal", places), ("multifrontal", None), ("CHOLMOD", None), ("SuperLU", None)):
            try:
                if solver != "SuperLU" or len(free) < _SUPERLU_MOST:
                    judge(k, m, at, solver)
            except ToolpointError as error:
                print(f"  {solver}: {error}")


if __name__ == "__main__":
    main()
