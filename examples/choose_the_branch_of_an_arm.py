"""Elbow up or down, front or back: which way to reach along a path leaves the tool's tip stiffest."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import PlaceQuantity, choose_turns, compare_branches


def main() -> float:
    """Return the weakest direction's stiffness of the best branch over that of the worst, means along the path."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        robot = read_machine(path)
    places = np.stack([np.full(5, 0.65), np.linspace(-0.1, 0.1, 5), np.full(5, 0.1)], axis=1)
    branches = compare_branches(robot, places, quantity=PlaceQuantity("static"))
    print(branches.table())
    path = np.stack([np.full(6, 0.65), np.linspace(0.05, 0.1, 6), np.full(6, 0.1)], axis=1)
    print(choose_turns(robot, path, turns=np.radians([-30.0, 0.0, 30.0]), branch="front up no flip").table())
    means = [float(mean.min()) for _, _, mean, _ in branches.rows]
    return means[0] / means[-1]


if __name__ == "__main__":
    main()
