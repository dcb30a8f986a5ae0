"""Chip thickness against the geometry itself: tips that move through the work, the surface that earlier passages left."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import benchmark
from toolpoint.cutting import Engagement, Tool
from toolpoint.cutting.force.laws import edge_field


def swept(tool: Tool, feed: float, turn: float, tooth: int) -> tuple[float, float]:
    """(angle of the tooth, rad; what it removes there, m) at this rotation, from the tips' own paths, tooth 0 at y for turn 0.

    The centre moves along x by `feed` a tooth. Seen from the centre now, an earlier tip stands at some angle and distance; the
    surface at the tooth's angle is the farthest that any tip has passed there in the last turn and a half.
    """
    lag, radius = tool.angles(0.0), tool.edge_radius(0.0)
    advance = feed * tool.teeth / (2 * np.pi)
    phi = turn - lag[tooth]
    left = 0.0
    for j in range(tool.teeth):
        for back in range(2):
            # The rotation at which tip j stood at about phi, strictly before now.
            since = (lag[tooth] - lag[j]) % (2 * np.pi) + 2 * np.pi * back
            if since < 1e-9:
                continue
            then = turn - since + np.linspace(-0.02, 0.02, 4001)
            x = radius[j] * np.sin(then - lag[j]) - advance * (turn - then)
            y = radius[j] * np.cos(then - lag[j])
            seen = np.unwrap(np.arctan2(x, y))
            seen += 2 * np.pi * np.round((phi - seen[2000]) / (2 * np.pi))
            left = max(left, float(np.interp(phi, seen, np.hypot(x, y))))
    return phi % (2 * np.pi), radius[tooth] - left


@pytest.mark.parametrize("tool", [
    Tool(0.02, 2, runout=8e-6, runout_angle=0.4), Tool(0.02, 3, runout=8e-6, runout_angle=0.4),
    Tool(0.02, 5, runout=5e-6, runout_angle=2.0), Tool(0.02, 3, pitch=[1.8, 2.3, 2 * np.pi - 4.1]),
    Tool(0.02, 4, pitch=np.radians([80, 100, 75, 105]), runout=6e-6, runout_angle=1.0)], ids=repr)
def test_every_tooth_removes_what_the_teeth_before_it_left(tool: Tool) -> None:
    """Run-out and unequal pitch, three to five teeth: the law is the geometry to the square of feed over radius."""
    feed = 5e-5
    problem = benchmark(Engagement.slot(), 2, tool=tool).changed(feed_per_tooth=feed)
    lag = tool.angles(0.0)
    for tooth in range(tool.teeth):
        for angle in (0.5, 1.2, 2.0, 2.7):
            turn = angle + lag[tooth]
            _, chip, *_ = edge_field(problem, 1e-3, np.array([turn]), slices=1)
            phi, removed = swept(tool, feed, turn, tooth)
            assert phi == pytest.approx(angle)
            assert chip[0, 0, tooth] == pytest.approx(max(removed, 0.0), abs=1.5 * feed**2 * tool.teeth**2 / tool.radius)
