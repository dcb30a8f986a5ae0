"""Peak-to-peak vibration over speed and depth; vibration once a tooth shows a stable cut, or a chatter of period three."""

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.simulation.milling import peak_to_peak_map, simulate
from toolpoint.vibration import Dof, Modes


def main() -> float:
    """Print the map; return after how many teeth the chatter at 17500 rev/min repeats."""
    mode = Modes([922.0], [0.011], np.array([[1 / np.sqrt(0.03993)]]), [Dof("tool", "+y")])
    cut = MillingProblem(Tool(8e-3, 2), Engagement.down(0.05), CuttingCoefficients(6e8, 2e8), mode, None, "tool:+y",
                         feed_per_tooth=1e-4)
    speeds, depths = np.array([17500.0, 18300.0, 18600.0]), np.array([0.5e-3, 1e-3, 2e-3])
    size = 1e6 * peak_to_peak_map(cut, speeds, depths)[:, :, 1]
    print("rev/min   " + "".join(f"{1e3 * depth:>9.1f} mm" for depth in depths))
    for speed, row in zip(speeds, size):
        print(f"{speed:9.0f} " + "".join(f"{value:>9.1f} um" for value in row))
    repeats = 0
    for speed, depth, what in ((18600.0, 1e-3, "stable"), (17500.0, 2e-3, "every third tooth")):
        once = np.round(1e6 * simulate(cut, speed, depth, revolutions=150).once_per_tooth()[-6:, 1], 1)
        print(f"{speed:.0f} rev/min, {1e3 * depth:g} mm, {what}: " + " ".join(f"{value:.1f}" for value in once) + " um")
        repeats = len(set(once))
    return float(repeats)


if __name__ == "__main__":
    main()
