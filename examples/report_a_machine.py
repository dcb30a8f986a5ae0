"""Modes, tool-point responses and stability of a machine at a pose, and the page of them (as `toolpoint report MACHINE`)."""

import tempfile
from importlib import resources

from toolpoint.cutting import ZeroOrder
from toolpoint.io import read_machine
from toolpoint.pages import first_look_page
from toolpoint.studies import study_machine_and_responses


def main() -> float:
    """Return the lowest natural frequency of the published machine, Hz."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine, text = read_machine(path), path.read_text(encoding="utf-8")
    result = study_machine_and_responses(machine, pose={"X": 0.0, "Y": 0.0}, method=ZeroOrder())
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(first_look_page(result, source=text, file_name="three_axis_vertical.yaml").save(folder))
    assert result.machine is not None
    return float(result.machine.frequency[0])


if __name__ == "__main__":
    main()
