"""Natural frequencies over the workspace (as `toolpoint modes` and `toolpoint map`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.pages.machines.frequency_map import frequency_map_page
from toolpoint.studies import map_frequencies, solve_modes


def main() -> float:
    """Return the largest difference of the map at the reference pose from the modes there, relative."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    alone = solve_modes(machine, {"X": 0.0}, 6)
    print(alone.table())
    result = map_frequencies(machine, {"X": np.linspace(-0.3, 0.3, 7), "Y": [0.0, 0.2]}, 6)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(frequency_map_page(result, machine.name).save(folder))
    return float(np.abs(result.frequency[3, 0] / alone.frequency - 1).max())


if __name__ == "__main__":
    main()
