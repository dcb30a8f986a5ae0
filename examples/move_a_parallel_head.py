"""A parallel head from its file: legs for a tilt, what comes with it, why a pose cannot be, stiffness over tilt and azimuth."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.kinematics.three_rps import ThreeRps
from toolpoint.studies import map_stiffness


def main() -> float:
    """Return the largest difference of the legs from the closed form, in parts of a leg."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        head = read_machine(folder / "three_rps_head.yaml")
    pose = {"Z": -0.9, "tilt": np.radians(20), "azimuth": np.radians(210)}
    legs = head.chain.positions(pose)[0]
    # The head hangs: seen from above, its closed form is that of the head that stands, tilted the other way.
    exact = ThreeRps(base=0.35, platform=0.25).inverse(0.9, np.radians(20), np.radians(30))
    print(f"legs {1e3 * legs} mm; closed form {1e3 * exact} mm")
    _, reasons = head.chain.reachable({"L1": 0.6, "L2": 1.2, "L3": 1.2})
    print(f"condition number {pose_condition(head.chain, pose).actuation[0]:.1f}; legs of 0.6, 1.2, 1.2 m: {reasons[0]}")
    stiffness = map_stiffness(head, {"tilt": np.radians([0, 15, 30]), "azimuth": np.radians([0, 60, 120, 180])})
    print(stiffness.table())
    return float(np.abs(legs / exact - 1).max())


if __name__ == "__main__":
    main()
