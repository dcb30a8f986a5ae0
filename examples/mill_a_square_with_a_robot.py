"""Milling accuracy of a robot along a side of a square (as `toolpoint accuracy`)."""

import tempfile
from importlib import resources

from toolpoint.io import read_machine
from toolpoint.pages.robots.accuracy import accuracy_page
from toolpoint.studies import MillingSetup, mill_path, square


def main() -> float:
    """Return by how much twice the step and spacing change the mean error, relative."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        robot = read_machine(path)
    sides = square(0.2, centre=(0.77, 0, 0.26), first=(0, 1, 0), second=(0, 0, 1), feed=0.005, law="jerk-limited")
    result = mill_path(robot, sides[:1], MillingSetup(speed=15000, depth=0.5e-3, window=0.2, spacing=1e-3))
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(accuracy_page(result, teeth=2).save(folder))
    return max(0.01, result.sides[0].halving)


if __name__ == "__main__":
    main()
