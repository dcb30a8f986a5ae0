"""Modes, tool-point responses and stability of a machine at a pose, and the page of them (as `toolpoint report MACHINE`)."""

import tempfile
from importlib import resources

from toolpoint.cutting import ZeroOrder
from toolpoint.io import read_machine
from toolpoint.pages.machines.machine import machine_page
from toolpoint.studies import study_machine


def main() -> float:
    """Return the lowest natural frequency of the published machine, Hz."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine, text = read_machine(path), path.read_text(encoding="utf-8")
    result = study_machine(machine, {"X": 0.0, "Y": 0.0}, method=ZeroOrder())
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(machine_page(result, text, "three_axis_vertical.yaml").save(folder))
    return float(result.frequency[0])


if __name__ == "__main__":
    main()
