"""Frequencies over the places that a robot reaches, and its most even segments, as a page (as `toolpoint region`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.pages import place_page
from toolpoint.studies import place_grid, study_region
from toolpoint.studies.machines.reach import reach_places


def main() -> float:
    """Return the spread over the most even segment, over that of five poses along it."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        robot = read_machine(path)
    grid = place_grid({"x": np.arange(0.3, 0.61, 0.1), "z": np.arange(-0.2, 0.41, 0.1)})
    study = study_region(robot, grid, point="wrist")
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(place_page(study.map, study.search, "milling robot").save(folder))
    assert study.search is not None
    best = study.search.best
    reach = reach_places(robot, np.linspace(best.start, best.end, 5), branch=best.branch, point="wrist")
    return best.total / float(np.ptp(natural_frequencies(robot, reach.batch(), best.values.shape[1]), axis=0).sum())


if __name__ == "__main__":
    main()
