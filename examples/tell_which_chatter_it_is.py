"""Chatter of a turning tool in closed form, and of a soft robot, where two modes couple without any lobe."""

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.stability.methods.mode_coupling import mode_coupling
from toolpoint.cutting.stability.methods.turning import least_width, lobe_tips
from toolpoint.vibration import Dof, Modes

STIFFNESS, DAMPING, CUTTING = 2e7, 0.03, 2e9


def main() -> float:
    """Return the least stable width of the turning tool over its closed form."""
    width = least_width(STIFFNESS, DAMPING, CUTTING)
    tips = np.round(lobe_tips(250.0, DAMPING, 3))
    print(f"turning: stable at every speed below {1e3 * width:.3f} mm, least at {tips} rev/min")
    turn = np.radians(30)
    soft = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) * [0.03, 0.0295]
    robot = Modes([10.0, 10.4], [0.01, 0.01], soft, [Dof("tool", "+x"), Dof("tool", "+y")])
    cut = MillingProblem(Tool(8e-3, 4), Engagement.down(0.5), CuttingCoefficients(8e8, 3e8), robot, "tool:+x", "tool:+y")
    for degrees in (0.0, 45.0, 90.0, 135.0):
        print(f"robot, feed at {degrees:3g} deg: {mode_coupling(cut.at_feed_angle(np.radians(degrees)))}")
    return float(width / (2 * STIFFNESS * DAMPING * (1 + DAMPING) / CUTTING))


if __name__ == "__main__":
    main()
