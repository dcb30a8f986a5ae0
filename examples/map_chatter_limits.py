"""How deep a cut may be over the workspace and feed directions (as `toolpoint map-chatter`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.cutting import ZeroOrder
from toolpoint.io import read_machine
from toolpoint.pages.cuts.chatter_map import chatter_map_page
from toolpoint.studies import map_chatter


def main() -> float:
    """Return the worst limit over the deepest cut that is stable everywhere at the same speed; it is 1."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical_drives.yaml") as path:
        machine = read_machine(path)
    result = map_chatter(machine, {"X": [-0.2, 0.2], "Z": [0.0, 0.3]}, speeds=np.linspace(900, 1600, 15),
                         feed_angles=np.radians([0, 90]), method=ZeroOrder())
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(chatter_map_page(result, machine, result.notes).save(folder))
    return result.worst().depth / float(result.everywhere.min())


if __name__ == "__main__":
    main()
