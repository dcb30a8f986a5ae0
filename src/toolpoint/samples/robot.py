"""Sample of a robot: the datasheet of a six-axis milling robot."""

from __future__ import annotations

from importlib import resources
from pathlib import Path


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the datasheet; return what was put in, and the commands."""
    text = (resources.files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml").read_text(encoding="utf-8")
    (folder / "datasheet.yaml").write_text(text, encoding="utf-8")
    return ["A published robot of 7 kg payload; what its source does not print is marked as chosen in the file."], [
        "toolpoint robot datasheet.yaml --machine robot.yaml", "toolpoint check robot.yaml"]
