"""How far a machining centre yields with its drives on, off and braked: which of it is the loops', which the structure's."""

import tempfile
from importlib.resources import files

import numpy as np

from toolpoint import studies
from toolpoint.io import read_drives, read_machine
from toolpoint.pages.machines.driven_responses import driven_responses_page


def main() -> float:
    """Return how much less the tool yields against the table along y with the drives on than with braked motors, as a share."""
    folder = files("toolpoint.app") / "machines"
    machine = read_machine(folder / "three_axis_vertical_drives.yaml")
    drives = read_drives(folder / "three_axis_vertical_servo_on_structure.yaml")
    result = studies.study_driven_responses(machine, drives, frequency=np.linspace(2.0, 400.0, 400))
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(driven_responses_page(result).save(folder))
    on, braked = (np.abs(result.frfs[state].values[:, 1, 1]).max() for state in ("on", "braked"))
    print(f"Along y the loops damp what braked motors leave: {1e9 * on:.0f} for {1e9 * braked:.0f} nm/N")
    return float(1 - on / braked)


if __name__ == "__main__":
    main()
