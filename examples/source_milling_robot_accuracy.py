"""The milling robot of its source along one side of its square: spectrum of the error at the tooth passing and twice that."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import MillingSetup, mill_path, square

TOOTH_PASSING = 500.0  # Hz: 15000 rev/min, two teeth


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        robot = read_machine(path)
    sides = square(0.2, centre=(0.77, 0, 0.26), first=(0, 1, 0), second=(0, 0, 1), feed=0.005, law="quintic")
    setup = MillingSetup(speed=15000, depth=0.5e-3, window=1.0, chip="constant")
    frequency, amplitude = mill_path(robot, sides[:1], setup).sides[0].spectrum()
    numbers: dict[str, Any] = {}
    for harmonic in (1, 2):
        line = 1e6 * amplitude[int(np.abs(frequency - harmonic * TOOTH_PASSING).argmin())]
        numbers |= {f"error_{harmonic}": line[:3].max(), f"roll_{harmonic}": line[3], f"turn_{harmonic}": line[4:].max()}
    between = amplitude[(frequency > 1.05 * TOOTH_PASSING) & (frequency < 1.95 * TOOTH_PASSING), :3]
    return numbers | {"error_between": 1e6 * between.max()}


if __name__ == "__main__":
    print(main())
