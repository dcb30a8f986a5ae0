"""A robot from its datasheet: gear ratios, reducers, forces on the base, and the machine (as `toolpoint robot`)."""

import tempfile
from importlib import resources

from toolpoint.io import read_datasheet, read_robot_machine
from toolpoint.pages.robots.robot import robot_page
from toolpoint.studies import study_datasheet


def main() -> float:
    """Return the vertical force of the robot with its payload on the base at rest, N."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml") as path:
        study, text = study_datasheet(read_datasheet(path), read_robot_machine(path)), path.read_text(encoding="utf-8")
    print(study.table())
    with tempfile.TemporaryDirectory() as folder:
        print(robot_page(study, text, "milling_robot_datasheet.yaml").save(folder))
    return study.rest_load.vertical_force


if __name__ == "__main__":
    main()
