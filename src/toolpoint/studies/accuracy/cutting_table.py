"""Mean cutting force of every step of a revolution over feeds, and the regeneration of a linear force law."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.build import coefficients_of, engagement_of, tool_of, total_energy_of
from toolpoint.cutting.cut.coefficients import edge_matrix
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.laws import edge_field, rigid_forces
from toolpoint.vibration import Dof, Modes

_ANGLES_PER_STEP = 8  # angles in a step over which forces are averaged
_RUNOUT_FEEDS = 17  # rows of the table with run-out, where chips vanish tooth by tooth
_ZERO_FEED = 1e-12  # m a tooth: a feed of exactly zero has no chip


@dataclass(frozen=True, eq=False)
class CuttingTable:
    """Forces on the tool in cutter axes (feed, normal, tool axis): mean over every step of a revolution, (n_feeds, m, 3), N.

    largest_feed : m a tooth, of the last row; step : s; per_tooth : steps in a tooth period; regeneration : (m, 3, 3), N/m per
    metre of depth: the force is minus depth times it times the vibration less that a tooth period before; is_constant : whether
    the chip is the largest one wherever the tool is.
    """

    table: FloatArray
    largest_feed: float
    step: float
    per_tooth: int
    regeneration: FloatArray
    is_constant: bool = False

    def feed_shares(self, speed: FloatArray) -> FloatArray:
        """Return the chip at speeds along the path (m/s) over the largest one; 1 where it is constant."""
        if self.is_constant:
            return np.ones_like(speed)
        return np.clip(speed * self.step * self.per_tooth / self.largest_feed, 0.0, 1.0)

    @property
    def mean(self) -> FloatArray:
        """Mean force at the largest feed, N, (3,)."""
        return self.table[-1].mean(axis=0)


def cutting_problem(cut: CuttingDescription) -> MillingProblem:
    """Return tool, arc and coefficients of a described cut as a problem whose dynamics (one mode) play no part."""
    shape = np.full((2, 1), 1e-3)
    placeholder_modes = Modes(np.array([100.0]), np.array([0.05]), shape, (Dof("tip", "+x"), Dof("tip", "+y")))
    return MillingProblem(tool_of(cut), engagement_of(cut), coefficients_of(cut), placeholder_modes,
                          feed_per_tooth=cut.feed_per_tooth, law=total_energy_of(cut))


def cutting_table(problem: MillingProblem, *, speed: float, depth: float, largest_feed: float,
                  steps: int = 100) -> CuttingTable:
    """Return the forces of a cut at a speed (rev/min) and depth (m), `steps` of them in a tooth period."""
    positive("speed", speed)
    positive("largest_feed", largest_feed, 0.01)
    tool, number = problem.tool, count("steps", steps, 16)
    around = number * tool.teeth
    angle = (np.arange(around * _ANGLES_PER_STEP) + 0.5) * (2 * np.pi / (around * _ANGLES_PER_STEP))
    linear = tool.runout == 0 and tool.tilt == 0 and problem.law is None  # in the feed
    feeds = np.array([_ZERO_FEED, largest_feed]) if linear else np.linspace(_ZERO_FEED, largest_feed, _RUNOUT_FEEDS)
    table = [rigid_forces(problem.changed(feed_per_tooth=float(f)), depth, angle).force.reshape(around, _ANGLES_PER_STEP,
                                                                                                3).mean(axis=1)
             for f in feeds]
    return CuttingTable(np.ascontiguousarray(table), largest_feed, 60 / (speed * around), number,
                        _regeneration(problem, depth, angle, around))


def _regeneration(problem: MillingProblem, depth: float, angle: FloatArray, around: int) -> FloatArray:
    fed = problem.changed(feed_per_tooth=1e-4)
    phi, chip, kappa, _, share = edge_field(fed, depth, angle, slices=20)
    matrix = edge_matrix(problem.coefficients, phi, kappa[:, None]) * (chip > 0)[..., None, None]
    total = matrix.sum(axis=(1, 2)) * share / depth
    return np.ascontiguousarray(total.reshape(around, _ANGLES_PER_STEP, 3, 3).mean(axis=1))


def check_regeneration(problem: MillingProblem) -> None:
    """Raise ToolpointError for cutters whose teeth do not follow each other alike: they have several delays."""
    if not problem.tool.is_regular or problem.tool.runout or problem.tool.tilt:
        fail("regenerative", "a cutter of unequal pitch, helix or run-out", "needs one delay",
             remedy="leave regeneration out, or `toolpoint mill`")
