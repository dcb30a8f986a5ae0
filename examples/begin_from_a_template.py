"""Begin with a template: write it, check it in words, put a number of your own in, ask the machine.

toolpoint new machine mine.yaml --template three-axis-vertical; toolpoint check mine.yaml
"""

import tempfile
from pathlib import Path

from toolpoint.io import read_machine
from toolpoint.io.template_files import list_templates, write_template
from toolpoint.studies import solve_modes
from toolpoint.studies.machines.check.machine_check import check_machine


def main() -> float:
    """Return the ratio of all natural frequencies of the gantry after every mass was made four times as large."""
    with tempfile.TemporaryDirectory() as folder:
        for name, words in list_templates().items():
            machine = read_machine(write_template(Path(folder) / f"{name}.yaml", "machine", name))
            print(words, len(check_machine(machine).doubts), "doubts")
        machine = read_machine(Path(folder) / "gantry.yaml")
        print(check_machine(machine).table())
    heavy = machine.with_values({f"bodies.{name}.mass": 4 * body.mass for name, body in machine.description.bodies.items()})
    ratios = solve_modes(heavy, count=6).frequency / solve_modes(machine, count=6).frequency
    return float(ratios.mean())


if __name__ == "__main__":
    print(main())
