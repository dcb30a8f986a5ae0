"""Read a machine file: all its faults at once, or what it holds (as `toolpoint check` and `toolpoint schema`)."""

from importlib import resources

from toolpoint.cutting.build import words
from toolpoint.io import read_machine
from toolpoint.io.yaml.machine_schema import json_schema


def main() -> int:
    """Return the degrees of freedom of the published machine."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    print(machine)
    if machine.description.cutting is not None:
        print(words(machine.description.cutting))
    print(f"keys for editors: {', '.join(json_schema()['properties'])}")
    return machine.size


if __name__ == "__main__":
    main()
