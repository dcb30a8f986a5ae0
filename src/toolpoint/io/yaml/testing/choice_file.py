"""Choice files in YAML: poles that a person adds to an identification and modes that go; read with all faults at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import parse, validate
from toolpoint.modal_identification import PoleChoice

VERSION = 1


@door("choice file")
def read(path: str | Path) -> PoleChoice:
    """Return the choice of a YAML file; raises FileFaults with every fault of the file."""
    document = parse(Path(path))
    document.check_version(VERSION)
    model: BaseModel | None = validate(model_of(PoleChoice, version=True), document.data, (), document=document)
    choice = None
    try:
        choice = None if model is None else describe(PoleChoice, model)
    except ToolpointError as error:
        document.fault((error.argument,), str(error))
    if choice is not None and choice.is_empty:
        document.fault((), "neither 'add' nor 'remove': the file changes nothing")
    if document.faults or choice is None:
        raise FileFaults(str(path), document.text, document.faults)
    return choice


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of choice files, for editors that check YAML while it is typed."""
    return file_schema(model_of(PoleChoice, version=True), "toolpoint choice file")


def text_of(choice: PoleChoice) -> str:
    """Return a choice as the text of its file."""
    lines = [f"toolpoint: {VERSION}"]
    if choice.add:
        lines += ["add:"] + [f"  - {{frequency: {pole.frequency:.6g} Hz, damping_ratio: {pole.damping_ratio:.6g}}}"
                             for pole in choice.add]
    if choice.remove:
        lines += ["remove:", *(f"  - {f:.6g} Hz" for f in choice.remove)]
    return "\n".join(lines) + "\n"
