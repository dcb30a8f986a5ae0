r"""Surfaces left by milling: profile and topography of the finished wall from the paths of the edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, one_of, positive
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.simulation.simulated_run import Simulation


@dataclass(frozen=True, eq=False)
class Wall(NotebookText):
    """Finished wall of a peripheral cut.

    Parameters
    ----------
    x : (n,) floats
        Position along the feed, m.
    z : (m,) floats
        Height above the tool's tip, m.
    height : (m, n) floats
        Material left above the ideal wall (positive: undercut), m.
    """

    x: FloatArray
    z: FloatArray
    height: FloatArray

    @property
    def profile(self) -> FloatArray:
        """Profile along the feed at the tool's tip, m."""
        return self.height[0]

    @property
    def location_error(self) -> float:
        """Mean height of the lowest points of the feed marks at the tip, m (least over each feed mark)."""
        return float(self.profile.min())

    def __repr__(self) -> str:
        return f"Wall({self.x.size} x {self.z.size} points, {1e3 * np.ptp(self.x):.3g} mm along the feed)"


def static_wall(problem: MillingProblem, length: float, points: int = 1000, *, heights: FloatArray | None = None,
                side: str = "exit") -> Wall:
    r"""Return the wall that a rigid tool leaves: the envelope of the edges' trochoids, with helix and run-out.

    The scallop between two marks is :math:`f_z^2/8R` for equal edges and small feed.

    Parameters
    ----------
    problem : MillingProblem
        `feed_per_tooth` above zero.
    length : float
        Along the feed, m.
    points : int
        Along the feed.
    heights : (m,) floats, optional
        Heights above the tip, m; the tip alone where left out.
    side : str
        ``exit`` (down-milling wall) or ``entry`` (up-milling wall).
    """
    return _wall(problem, length, points, heights, side, None)


def dynamic_wall(run: Simulation, length: float, points: int = 1000, *, heights: FloatArray | None = None,
                 side: str = "exit") -> Wall:
    """Return the wall that a simulated cut leaves: edge paths with the vibration of its last revolutions."""
    return _wall(run.problem, length, points, heights, side, run)


def _wall(problem: MillingProblem, length: float, points: int, heights: FloatArray | None, side: str,
          run: Simulation | None) -> Wall:
    one_of("side", side, ("exit", "entry"))
    tool, feed = problem.tool, problem.feed_per_tooth * problem.tool.teeth
    if feed <= 0:
        fail("MillingProblem.feed_per_tooth", "0", "must be above zero", remedy="problem.changed(feed_per_tooth=...)")
    z = np.zeros(1) if heights is None else floats("heights", heights, (None,))
    x = np.linspace(0, positive("length", length), count("points", points, 3))
    lag, radius = tool.angles(z), tool.edge_radius(z)
    turns = np.arange(-2, int(np.ceil(length / feed)) + 3)
    height = np.full((z.size, x.size), np.inf)
    # Edges leave their mark within a feed of their deepest place: farther ones are covered by the next tooth.
    reach = 2.5 * feed / tool.radius
    wall_angle = np.pi if side == "exit" else 0.0
    for level in range(z.size):
        for tooth in range(tool.teeth):
            for turn in turns.tolist():
                path = _edge_path(problem, x, float(lag[level, tooth]), float(radius[level, tooth]), turn,
                                  wall_angle, reach, run)
                height[level] = np.minimum(height[level], path)
    return Wall(x, z, height)


def _edge_path(problem: MillingProblem, x: FloatArray, lag: float, radius: float, turn: int, wall: float, reach: float,
               run: Simulation | None) -> FloatArray:
    """Return the distance of the edge's path from the ideal wall over x (infinite where it does not pass), m."""
    feed = problem.feed_per_tooth * problem.tool.teeth
    angle = wall + lag + 2 * np.pi * turn  # rotation of tooth 0 when this edge points at the wall
    span = np.linspace(-reach, reach, 1201)
    centre = feed * (angle + span) / (2 * np.pi)
    px = centre + radius * np.sin(wall + span)
    gap = problem.tool.radius - radius * np.abs(np.cos(wall + span))
    if run is not None:
        dx, dy = _vibration(run, angle + span)
        px = px + dx
        gap = gap + (dy if wall > 0 else -dy)
    if wall > 0:
        px, gap = px[::-1], gap[::-1]
    keep = np.concatenate([[True], np.diff(np.maximum.accumulate(px)) > 0])
    out = np.full(x.size, np.inf)
    inside = (x >= px[keep][0]) & (x <= px[keep][-1])
    out[inside] = np.interp(x[inside], px[keep], gap[keep])
    return out


def _vibration(run: Simulation, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the displacement when tooth 0 has turned by `angle`, from the middle of the last revolutions (wrapped around)."""
    step = 2 * np.pi / run.steps_per_revolution
    turn_count = (run.time.size - 1) // run.steps_per_revolution
    turns = max(1, turn_count // 2)
    begin = (turn_count - turns) * run.steps_per_revolution
    sample = ((angle - run.problem.engagement.entry) / step) % (turns * run.steps_per_revolution) + begin
    lower_index = np.minimum(sample.astype(int), run.time.size - 2)
    part = (sample - lower_index)[:, None]
    r = run.displacement[lower_index] * (1 - part) + run.displacement[lower_index + 1] * part
    return r[:, 0], r[:, 1]
