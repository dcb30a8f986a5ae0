"""Walls in three meshes: does the error that a limit states for the mesh hold the limit of a finer one?

    python benchmarks/machining/mesh_intervals.py [--walls 20] [--seed 1]

Random plates are judged at five random speeds each: the mesh's error comes from one 1.5 times as coarse, as in a program, and
the limit beside it from one three times as fine in all directions. The last line is the figure.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.bodies.solid import Casting, Cuboid, Material, PlaneFaces, SolidModel
from toolpoint.bodies.solid.cut_solid import CutSolid
from toolpoint.cutting import Engagement, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.material_removal import MillShape, split_moves
from toolpoint.material_removal.sweep_times import SweepTimes
from toolpoint.studies import modal_dynamics, with_work
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.mesh_share import widen_by_mesh
from toolpoint.studies.machining.thin_walls.clamped_part import COARSE_MESH_RATIO, ClampedPart
from toolpoint.studies.machining.thin_walls.part_stages import StageCourse, estimate_mesh_error, solve_stage
from toolpoint.vibration import Modes

MM = 1e-3
ALUMINIUM = Material(70e9, 0.33, 2700.0)
CUT = CuttingDescription.of(diameter=16 * MM, teeth=3, tangential=1.2e9, normal=6e8)
NOWHERE = SweepTimes(split_moves([[9.0, 9, 9]], [[9.1, 9, 9]], step=1.0), (MillShape(0.01),))
FINE_RATIO, SPEEDS, DEPTH = 3.0, 5, 30 * MM


def wall_of(model: SolidModel, part: ClampedPart, place: np.ndarray) -> ToolDynamics:
    """Return the response of a plate along y at a place, twelve modes."""
    stage = solve_stage(CutSolid(model, part.nodes_of(model), NOWHERE), part, 0)
    shape = stage.shapes.reshape(-1, 3, stage.frequency.size)[int(np.linalg.norm(model.nodes - place, axis=1).argmin()), 1]
    return modal_dynamics(Modes(stage.frequency, stage.damping_ratio, shape[None], ("wall:+y",)), y="wall:+y")


def judge(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Return (limit, its stated error by the mesh, limit of the finer mesh), m, of one plate at some speeds."""
    length, height, thickness = rng.uniform([40, 25, 1.5], [80, 50, 4]) * MM
    size = rng.uniform(4.0, 9.0) * MM

    def mesh(edge: float) -> SolidModel:
        return Casting([Cuboid((0, 0, 0), (length, thickness, height))], {"body": ALUMINIUM}).meshed(edge)

    part = ClampedPart(mesh(size), (PlaneFaces((0, 0, 0), (0, 0, 1)),), damping_ratio=0.02,
                       compared=mesh(COARSE_MESH_RATIO * size))
    cut = CutSolid(part.model, part.held_nodes, NOWHERE)
    error = estimate_mesh_error(part, StageCourse(cut, (solve_stage(cut, part, 0),), np.zeros(0), False))
    assert error is not None
    corner = np.array([0.0, 0.0, height])
    tip = modal_dynamics(Modes([900.0, 1100.0], [0.03, 0.03], np.diag([1.0, 1.0]), ("tip:+x", "tip:+y")))
    walls = [wall_of(model, part, corner) for model in (part.model, mesh(size / FINE_RATIO))]
    entry = np.pi - np.arccos(1 - 2 * rng.uniform(0.03, 0.4))
    rows, speeds = [], rng.uniform(3000, 18000, SPEEDS)
    charts = []
    for wall in walls:
        both = with_work(tip, wall)
        problem = milling_problem(CUT.replaced(direction="slot"), both.response, both.x, y=both.y).changed(
            engagement=Engagement(float(entry), np.pi))
        charts.append((problem, stability.chart(problem, speeds, depth_max=DEPTH)))
    for k, speed in enumerate(speeds.tolist()):
        alone = stability.chart(charts[0][0], np.array([speed]), depth_max=DEPTH)
        point = int(alone.limit_points()[0])
        if point < 0 or not np.isfinite(charts[1][1].limit[k]):
            continue
        # Judged at a depth of its limit, where the verdict hangs on the error.
        widened = widen_by_mesh(alone, charts[0][0], walls[0], error=error, depth=float(alone.limit[0]))
        rows.append((float(widened.limit[0]), float(widened.error[point]), float(charts[1][1].limit[k])))
    return rows


def main() -> None:
    """Print the limits and the share of those that are held."""
    parser = CommandLine(__doc__)
    parser.cases("walls", 20)
    parser.seed(1)
    options = parser.parse_args()
    rows: list[tuple[float, float, float]] = []
    for k in range(options.walls):
        rows += (new := judge(np.random.default_rng(options.seed + k)))
        print(f"{k}: " + "; ".join(f"{1e3 * a:.3f} +- {1e3 * e:.3f} mm, finer {1e3 * b:.3f}" for a, e, b in new), flush=True)
    limit, error, fine = np.array(rows).T
    is_held, is_above = np.abs(fine - limit) <= error, fine >= limit - error
    print(f"{int(is_held.sum())} of {len(rows)} limits of a mesh {FINE_RATIO:g} times as fine lie within the stated error, "
          f"{int(is_above.sum())} above its lower end (median {100 * np.median(error / limit):.2g} % of a limit; the limits "
          f"differ by {100 * np.median(np.abs(fine / limit - 1)):.2g} % in the median, "
          f"{100 * np.abs(fine / limit - 1).max():.0f} % at most)")


if __name__ == "__main__":
    main()
