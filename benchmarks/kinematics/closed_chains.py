"""Closed chains: poses per second with loops closed and the six lowest modes, of the 3-RPS and of the hexapod; accuracy beside.

Run with one BLAS thread: OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/kinematics/closed_chains.py [--poses
100000] The poses run over a grid of the workspace, then at random; both paths are compared on some of them, and the legs of the
3-RPS with their closed form. The last line is the compiled path's poses per second of the 3-RPS over the grid.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np

import parallel_machines
from benchmarks.frame import CommandLine
from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.three_rps import ThreeRps
from toolpoint.machine import Machine
from toolpoint.machine.frequencies import natural_frequencies


def reference_height(machine: Machine) -> float:
    """Return the height of the platform at the reference pose, m."""
    assert isinstance(machine.chain, ClosedChain)  # what each of these machines has
    return float(machine.chain.axis("Z").reference_position)


def grid_poses(machine: Machine, count: int) -> dict[str, np.ndarray]:
    """Return task poses over height, tilt and azimuth, each a neighbour of the last."""
    each = round(count ** (1 / 3))
    z = reference_height(machine)
    heights, tilts = np.linspace(z - 0.1, z + 0.1, each), np.radians(np.linspace(0, 25, each))
    azimuth = np.linspace(-np.pi, np.pi, -(-count // each**2))
    rows = [(h, t, a) for h in heights for i, t in enumerate(tilts) for a in (azimuth if i % 2 else azimuth[::-1])]
    return dict(zip(("Z", "tilt", "azimuth"), np.array(rows[:count]).T, strict=True))


def random_poses(machine: Machine, count: int) -> dict[str, np.ndarray]:
    """Return task poses at random over the same span."""
    rng, z = np.random.default_rng(0), reference_height(machine)
    return {"Z": z + rng.uniform(-0.1, 0.1, count), "tilt": np.radians(rng.uniform(0, 25, count)),
            "azimuth": rng.uniform(-np.pi, np.pi, count)}


def rate(machine: Machine, legs: dict[str, np.ndarray], path: str) -> float:
    """Return poses per CPU-second, the best of three runs."""
    times = []
    for _ in range(3):
        start = time.process_time()
        natural_frequencies(machine, legs, 6, path=path)
        times.append(time.process_time() - start)
    return len(next(iter(legs.values()))) / min(times)


def main() -> None:
    """Print rates and differences."""
    parser = CommandLine(__doc__)
    parser.cases("poses", 100_000)
    count = parser.parse_args().poses
    first = 0.0
    for make in (parallel_machines.three_rps, parallel_machines.hexapod, parallel_machines.three_prs):
        machine = make(limb_mass=8.0) if make is parallel_machines.three_rps else make()
        names = [axis.name for axis in machine.chain.driven_axes]
        for kind, poses in (("grid", grid_poses(machine, count)), ("random", random_poses(machine, count))):
            some = {name: at[:2000] for name, at in poses.items()}
            start = time.process_time()
            legs = {name: np.concatenate([machine.chain.positions(part)[:, i] for part in machine.chain.chunks(poses, 4096)])
                    for i, name in enumerate(names)} if make is not parallel_machines.three_rps else dict(
                        zip(names, ThreeRps(0.35, 0.25).inverse(*poses.values()).T, strict=True))
            inverse = count / (time.process_time() - start)
            few = {name: at[:1000] for name, at in legs.items()}
            both = [natural_frequencies(machine, few, 6, path=path) for path in ("compiled", "numpy")]
            error = np.abs(both[0] / both[1] - 1).max()
            compiled, plain = rate(machine, legs, "compiled"), rate(machine, few, "numpy")
            closed = ""
            if make is parallel_machines.three_rps:
                exact = ThreeRps(0.35, 0.25).inverse(*some.values())
                closed = f", legs to the closed form {np.abs(machine.chain.positions(some) - exact).max():.1e} m"
            print(f"{machine.name:6s} {kind:7s} {compiled:9.0f} poses/s compiled, {plain:7.0f} NumPy, frequencies of both "
                  f"{error:.1e}{closed}" + ("" if closed else f", inverse {inverse:.0f} poses/s"))
            first = first or compiled
    print(f"{first:.0f} poses/s")


if __name__ == "__main__":
    main()
