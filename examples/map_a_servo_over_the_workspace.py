"""All that `toolpoint drive --map` does: margins of the loops at every pose of the machine, the structure in the loop."""

import tempfile
import warnings
from importlib import resources
from pathlib import Path

import numpy as np

from toolpoint import ToolpointWarning
from toolpoint.io import read_drives, read_machine
from toolpoint.pages.servos.servo_map import servo_map_page
from toolpoint.studies import map_servo


def main() -> float:
    """Return the smallest phase margin of the velocity loops, degrees."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        drives = read_drives(folder / "three_axis_vertical_servo_on_structure.yaml")
        machine = read_machine(folder / "three_axis_vertical_drives.yaml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        result = map_servo(drives, machine=machine, grid={"X": np.linspace(-0.3, 0.3, 3)})
    print(result.table())
    pose, axis = result.worst()
    print(f"{result.status}; least phase margin at {dict(result.poses[pose])}, axis {axis}")
    with tempfile.TemporaryDirectory() as pages:
        print(servo_map_page(result).save(Path(pages) / "map.html").name)
    return float(np.nanmin(result.velocity_phase_margin))


if __name__ == "__main__":
    main()
