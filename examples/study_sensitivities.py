"""Which joint moves which frequency and shape (as `toolpoint sensitivity`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.pages.machines.sensitivity import sensitivity_page
from toolpoint.studies import study_sensitivity


def main() -> float:
    """Return the sum of the relative sensitivities to all stiffnesses: 1/2, as frequency goes with the root of stiffness."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    result = study_sensitivity(machine, None, 6)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(sensitivity_page(result, machine, 0.1).save(folder))
    return float(np.mean(sum(result.cumulative("stiffness").values())))


if __name__ == "__main__":
    main()
