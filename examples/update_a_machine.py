"""A machine brought to agree with measured modes; what the data cannot tell stays (as `toolpoint update --modes`)."""

import tempfile
from importlib import resources

from toolpoint.io import read_machine, write_machine
from toolpoint.machine import assemble
from toolpoint.pages.measured.update import update_page
from toolpoint.studies import Measurement, update_machine
from toolpoint.vibration import eigen

PATH = "joints.foundation.stiffness.rx"


def main() -> float:
    """Return the updated stiffness over the published one; the update began at 70 % of it."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    labels = [f"{point}:+{way}" for point in machine.description.points for way in "xyz"]
    measured = eigen.solve_undamped(assemble(machine, None, labels), 6)
    wrong = machine.with_values({PATH: 0.7 * machine.value(PATH)})
    result = update_machine(wrong, [Measurement(measured)], [PATH])
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        write_machine(result.machine.description, f"{folder}/updated.yaml")
        print(update_page(result).save(folder))
    return result.machine.value(PATH) / machine.value(PATH)


if __name__ == "__main__":
    main()
