"""Measure the wall that a cut leaves, as a workshop would: roughness behind a filter, and the lay over the area."""

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.simulation.milling import simulate
from toolpoint.cutting.surface.filters import gaussian, separate
from toolpoint.cutting.surface.roughness import areal_parameters, profile_parameters
from toolpoint.cutting.surface.topography import dynamic_wall, static_wall
from toolpoint.vibration import Dof, Modes

RADIUS, FEED, DEPTH = 8e-3, 0.4e-3, 1e-3


def main() -> float:
    """Return the height of the scallops over feed squared by eight radii of the trochoid's curvature, R (1 - f/2 pi R)^2."""
    modes = Modes([800.0, 820.0], [0.03, 0.03], np.diag([2.0, 2.0]), [Dof("tool", "+x"), Dof("tool", "+y")])
    cut = MillingProblem(Tool(2 * RADIUS, 2), Engagement.down(0.1), CuttingCoefficients(7e8, 2e8), modes, "tool:+x", "tool:+y",
                         feed_per_tooth=FEED)
    wall = static_wall(cut, 20 * FEED, points=4001)
    profile, spacing = wall.height[0], float(wall.x[1] - wall.x[0])
    parts = separate(profile, spacing, 2.5 * FEED, form_above=10 * FEED)
    waviness = gaussian(profile, spacing, 2.5 * FEED)
    print({name: f"{1e6 * value:.3f} um" for name, value in profile_parameters(profile - waviness, spacing).items()
           if name in ("Ra", "Rz", "Rt")}, f"form above {1e3 * parts.limits[1]:.1f} mm")
    run = simulate(cut, 9000.0, DEPTH, revolutions=60)
    moved = dynamic_wall(run, 10 * FEED, points=800, heights=np.linspace(0, DEPTH, 4))
    print({name: f"{1e6 * value:.3f} um" for name, value in areal_parameters(moved.height).items() if name in ("Sa", "Sz")})
    curvature = RADIUS * (1 - 2 * FEED / (2 * np.pi * RADIUS)) ** 2
    return float(np.ptp(profile) / (FEED**2 / (8 * curvature)))


if __name__ == "__main__":
    main()
