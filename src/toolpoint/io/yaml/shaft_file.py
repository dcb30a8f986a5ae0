"""Shaft files in YAML: tools, holders and gauges as round segments; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import parse, validate
from toolpoint.substructuring.shaft import ShaftDescription

VERSION = 1


@door("shaft file")
def read(path: str | Path) -> ShaftDescription:
    """Return the shaft of a YAML file, SI; raises FileFaults with every fault of the file."""
    document = parse(Path(path))
    document.check_version(VERSION)
    model: BaseModel | None = validate(model_of(ShaftDescription, version=True), document.data, (), document=document)
    shaft = None
    try:
        shaft = None if model is None else describe(ShaftDescription, model)
    except ToolpointError as error:
        key = tuple(error.argument.split("."))
        document.fault(key, str(error).removeprefix(f"{error.argument}: "))
    if document.faults or shaft is None:
        raise FileFaults(str(path), document.text, document.faults)
    return shaft


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of shaft files, for editors that check YAML while it is typed."""
    return file_schema(model_of(ShaftDescription, version=True), "toolpoint shaft file")
