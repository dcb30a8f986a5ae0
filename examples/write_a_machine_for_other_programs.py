"""A robot at a pose written for MuJoCo and for Exudyn (as `toolpoint export`)."""

import tempfile
from importlib import resources
from pathlib import Path

from toolpoint.io import read_machine
from toolpoint.io.multibody import exudyn_script, mjcf


def main() -> int:
    """Return the number of springs that were written."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "elastic_robot.yaml") as path:
        robot = read_machine(path)
    with tempfile.TemporaryDirectory() as folder:
        mjcf.write(robot, Path(folder) / "robot.xml", {"q2": 0.5})
        exudyn_script.write(robot, Path(folder) / "robot.py", {"q2": 0.5})
        return (Path(folder) / "robot.xml").read_text().count("<joint")


if __name__ == "__main__":
    main()
