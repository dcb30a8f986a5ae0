"""Where a robot is most even along a segment of 200 mm, and how it gets there (as `toolpoint region` and `toolpoint reach`)."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import map_places, place_grid, plane_directions, search_regions, study_reach


def main() -> float:
    """Return how far the tool's tip is from where it shall be, m."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        robot = read_machine(path)
    grid = place_grid({"x": np.arange(0.3, 0.61, 0.1), "z": np.arange(-0.2, 0.41, 0.1)})
    print(map_places(robot, grid, point="wrist").table())
    print(search_regions(robot, grid.places.reshape(-1, 3), plane_directions([1, 0, 0], [0, 0, 1]), point="wrist").table())
    study = study_reach(robot, [0.69, 0.02, 0.1])
    print(study.table())
    return max(each.miss for each in study.poses)


if __name__ == "__main__":
    main()
