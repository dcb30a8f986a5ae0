"""Plans of screenings in YAML; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.yaml.description_schema import file_schema, model_of, read_described
from toolpoint.io.yaml.document import FILE_VERSION
from toolpoint.machine.description.screening_plan import ScreeningPlan, find_plan_faults


@door("screening plan")
def read(path: str | Path) -> ScreeningPlan:
    """Return the plan of a YAML file, SI; raises FileFaults with every fault of the file.

    >>> from importlib.resources import files
    >>> plan = read(files("toolpoint.app") / "machines" / "milling_robot_screening.yaml")
    >>> plan.design
    'one at a time'
    """
    return read_described(Path(path), ScreeningPlan, FILE_VERSION, find_faults=find_plan_faults, place_error=_place)


def _place(error: ToolpointError) -> tuple[tuple[str, ...], str]:
    return ("factors" if "factor" in str(error) else "swaps",), str(error)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of screening plans, for editors that check YAML while it is typed."""
    return file_schema(model_of(ScreeningPlan, version=True), "toolpoint screening plan")
