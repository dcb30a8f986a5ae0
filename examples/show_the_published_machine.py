"""The published machine without and with its feed drives, and their page (as `toolpoint demo`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.cutting import ZeroOrder
from toolpoint.io import read_machine
from toolpoint.pages.machines.demo import demo_page
from toolpoint.studies import study_machine, study_modes


def main() -> float:
    """Return the largest deviation of a frequency from the model of the paper, per cent."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as machines:
        paths = [machines / "three_axis_vertical.yaml", machines / "three_axis_vertical_drives.yaml"]
        casting, built = (read_machine(path) for path in paths)
        files = [(path.name, path.read_text(encoding="utf-8")) for path in paths]
    modes, drives = study_modes(casting), study_machine(built, method=ZeroOrder())
    print(modes.table())
    print("\n".join(drives.limit_lines()))
    with tempfile.TemporaryDirectory() as folder:
        print(demo_page(modes, drives, files).save(folder))
    published = np.array(casting.description.reference[1].frequencies)
    return float(100 * np.abs(modes.frequency / published - 1).max())


if __name__ == "__main__":
    main()
