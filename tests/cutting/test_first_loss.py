"""Law: the search for the first loss of stability alone overlooks none that the counts of unstable multipliers know."""

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, FloquetDeterminant, MillingProblem, PanelArnoldi, Tool, stability
from toolpoint.studies.machines.tool_point import depth_limit
from toolpoint.vibration import Modes


def slow_cut(rng: np.random.Generator) -> tuple[MillingProblem, float, float]:
    """A straight tool on 3 to 6 modes, speed (rev/min) of a tooth period of 1 to 6 vibrations, depth to search (m)."""
    number = int(rng.integers(3, 7))
    hertz = np.sort(rng.uniform(30, 60) * 2 ** rng.uniform(0, 2, number))
    damping, stiffness = rng.uniform(0.01, 0.04, number), 1e7 * 10 ** rng.uniform(0, 1, number)
    angle = rng.uniform(0, np.pi, number)
    shapes = 2 * np.pi * hertz / np.sqrt(stiffness) * np.stack([np.cos(angle), np.sin(angle)])
    tool, arc = Tool(0.05, int(rng.integers(3, 7))), Engagement.down(float(rng.uniform(0.1, 0.6)))
    problem = MillingProblem(tool, arc, CuttingCoefficients(8e8, 3e8), Modes(hertz, damping, shapes, ("t:+x", "t:+y")))
    speed = float(60 * hertz[-1] / tool.teeth / rng.uniform(1, 6))
    return problem, speed, min(depth_limit(problem) * 10 ** rng.uniform(0, 2), 0.3)


def limits(seed: int) -> tuple[float, float]:
    """First loss by the search alone, and by counts that look just as deep, m."""
    problem, speed, depth = slow_cut(np.random.default_rng(seed))
    alone = min(float(stability.chart(problem, [speed], PanelArnoldi(first_only=True), depth_max=depth).limit[0]), depth)
    counted = stability.chart(problem, [speed], FloquetDeterminant(), depth_max=1.02 * alone)
    return alone, min(float(counted.limit[0]), alone)


@pytest.mark.parametrize("seed", [963, 1253, 100276, 203120, 300560, 301040, 302306])
def test_narrow_first_losses_are_not_overlooked(seed):
    """Flip lobes that open and close below a wider loss, a few per cent of the depth wide."""
    alone, counted = limits(seed)
    assert alone == pytest.approx(counted, rel=1e-3)
