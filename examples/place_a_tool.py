"""Where the axes of a machine stand for a place of the tool over the table, forward and back."""

import numpy as np

from toolpoint.kinematics import cartesian


def main() -> float:
    """Return how far from the asked place the tool stands, m."""
    chain = cartesian(["Z"], ["Y", "X"])  # the tool moves along Z; the table carries X on Y
    head, table = (0, (0.0, 0.0, 0.5)), (2, (0.0, 0.0, 0.0))
    asked = np.array([0.12, -0.05, 0.3])
    pose = chain.inverse(asked, head, table)
    print({name: f"{1e3 * float(value):.1f} mm" for name, value in pose.items()})
    return float(np.abs(chain.relative_position(pose, head, table)[0] - asked).max())


if __name__ == "__main__":
    main()
