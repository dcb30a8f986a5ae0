"""Chatter map of the source's 50 mm grid by the exact engine: every reachable pose of the milling robot, 200 speeds, two teeth,
helix 42 degrees.

Prints the poses, CPU seconds a pose (those of the workers included) and the wall time; the last line is the figure. A short run
(`--poses`) takes runs of neighbours evenly over the grid, as charts of neighbours share panels.
"""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import MACHINE_TEMPLATES, CommandLine
from toolpoint.io import read_machine
from toolpoint.studies import Dask, Serial, map_chatter, place_grid
from toolpoint.studies.machines.reach import reach_places

SPEEDS = 200
RUN = 5  # neighbours in a short run


def cpu_seconds() -> float:
    """CPU seconds of this process and of those that it has ended."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def some_of(poses: list[dict[str, float]], count: int) -> list[dict[str, float]]:
    """Runs of neighbours evenly over the list, `count` poses in all."""
    runs = -(-count // RUN)
    starts = np.linspace(0, len(poses) - RUN, runs).astype(int) if runs > 1 else [len(poses) // 2]
    return [pose for start in starts for pose in poses[start:start + RUN]][:count]


def main() -> None:
    """Print the time of the map and what its limits are worth."""
    parser = CommandLine(__doc__)
    parser.add_argument("--workers", type=int, default=2)
    parser.cases("poses", 0, "only so many, evenly over the grid")
    parser.add_argument("--save", help="a file for the limits, m")
    options = parser.parse_args()
    robot = read_machine(MACHINE_TEMPLATES / "milling_robot.yaml")
    grid = place_grid({"x": np.arange(-0.2, 0.701, 0.05), "z": np.arange(-0.3, 0.701, 0.05)})
    places = grid.places.reshape(-1, 3)
    poses = [pose for pose in reach_places(robot, places, point="wrist").poses if pose is not None]
    used = some_of(poses, options.poses) if options.poses else poses
    print(f"{len(poses)} of {len(places)} places are reached; {len(used)} charted")
    before, start = cpu_seconds(), time.perf_counter()
    found = map_chatter(robot, used, speeds=np.linspace(*robot.description.cutting.speeds, SPEEDS),
                        engine=Dask(options.workers) if options.workers > 1 else Serial(),
                        progress=lambda done, every: print(f"  {done} of {every}", file=sys.stderr, flush=True))
    wall, cpu = time.perf_counter() - start, cpu_seconds() - before
    if options.save:
        np.save(options.save, found.limit)
    limited = np.isfinite(found.limit)
    print(f"limits at {100 * limited.mean():.1f} % of the speeds, {1e3 * np.nanmin(found.limit[limited]):.4g} to "
          f"{1e3 * found.limit[limited].max():.4g} mm; {len(found.failures)} failures")
    print(f"{cpu / len(used):.2f} CPU s a pose")
    print(f"{wall:.0f} s of wall time for {len(used)} poses with {options.workers} workers"
          + ("" if len(used) == len(poses) else f"; {len(poses)} poses would take {wall * len(poses) / len(used):.0f} s"))


if __name__ == "__main__":
    main()
