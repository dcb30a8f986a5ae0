"""Plans of screenings in YAML; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import parse, validate
from toolpoint.machine.description.screening_plan import ScreeningPlan, find_plan_faults

VERSION = 1


@door("screening plan")
def read(path: str | Path) -> ScreeningPlan:
    """Return the plan of a YAML file, SI; raises FileFaults with every fault of the file."""
    document = parse(Path(path))
    document.check_version(VERSION)
    model: BaseModel | None = validate(model_of(ScreeningPlan, version=True), document.data, (), document=document)
    plan = None
    if model is not None:
        try:
            plan = describe(ScreeningPlan, model)
        except ToolpointError as error:
            document.fault(("factors" if "factor" in str(error) else "swaps",), str(error))
    for key, text in () if plan is None else find_plan_faults(plan):
        document.fault(key, text)
    if document.faults or plan is None:
        raise FileFaults(str(path), document.text, document.faults)
    return plan


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of screening plans, for editors that check YAML while it is typed."""
    return file_schema(model_of(ScreeningPlan, version=True), "toolpoint screening plan")
