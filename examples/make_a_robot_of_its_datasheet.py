"""A robot from its datasheet: gear ratios, reducers, forces on the base, and the machine (as `toolpoint robot`)."""

from importlib import resources

from toolpoint.io import read_datasheet, read_robot_machine
from toolpoint.studies import study_datasheet


def main() -> float:
    """Return the vertical force of the robot with its payload on the base at rest, N."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml") as path:
        study = study_datasheet(read_datasheet(path), read_robot_machine(path))
    print(study.table())
    return study.rest_load.vertical_force


if __name__ == "__main__":
    main()
