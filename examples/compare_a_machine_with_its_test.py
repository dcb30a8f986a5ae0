"""Build the published three-axis machine from its file and compare its natural frequencies with the measured ones."""

from importlib import resources

import numpy as np

from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble
from toolpoint.vibration import eigen


def main() -> float:
    """Return the largest deviation from the experiment, in per cent."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = machine_file.read(path)
    modes = eigen.solve_undamped(assemble(machine))
    measured = np.array(machine.description.reference[0].frequencies)
    deviation = 100 * (modes.frequency / measured - 1)
    for computed, known, error in zip(modes.frequency, measured, deviation, strict=True):
        print(f"{computed:8.2f} Hz   measured {known:5.1f} Hz   {error:+.1f} %")
    return float(np.abs(deviation).max())


if __name__ == "__main__":
    main()
