"""Drive files in YAML: mechanics, friction and control of the axes of a machine; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from toolpoint.drives.description import DriveDescription
from toolpoint.drives.faults import find_faults
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import parse, validate

VERSION = 1


@door("drive file")
def read(path: str | Path) -> DriveDescription:
    """Return the drives of a YAML file, SI; raises FileFaults with every fault of the file."""
    document = parse(Path(path))
    document.check_version(VERSION)
    model: BaseModel | None = validate(model_of(DriveDescription, version=True), document.data, (), document=document)
    drives = None if model is None else describe(DriveDescription, model)
    for key, message in () if drives is None else find_faults(drives):
        document.fault(key, message)
    if document.faults or drives is None:
        raise FileFaults(str(path), document.text, document.faults)
    return drives


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of drive files, for editors that check YAML while it is typed."""
    return file_schema(model_of(DriveDescription, version=True), "toolpoint drive file")
