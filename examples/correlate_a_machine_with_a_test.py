"""A test beside a machine: paired points and modes, MAC, COMAC, and the page (as `toolpoint correlate`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.pages.measured.correlation import correlation_page
from toolpoint.studies import compare_with_test, gather_test
from toolpoint.studies.machines.virtual_test import surface_points, true_modes
from toolpoint.vibration.geometry import Geometry


def main() -> float:
    """Return the lowest MAC of the pairs of a machine and its own modes, measured at 40 points: it is 1."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    points = surface_points(machine, 40, np.random.default_rng(3))
    test = gather_test(true_modes(machine, points, 0.03), geometry=Geometry(points.coordinates, []), owner=points.components)
    result = compare_with_test(machine, test)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(correlation_page(result).save(folder))
    return min(float(result.correlation.mac[i, j]) for i, j in result.correlation.pairs.pairs)


if __name__ == "__main__":
    main()
