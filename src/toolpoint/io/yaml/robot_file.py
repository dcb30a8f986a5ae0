"""Datasheets of robots in YAML: what is published and what is chosen, read with all faults at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from toolpoint._check import ToolpointError
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.meshes import stl
from toolpoint.io.yaml import machine_schema
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import Document, parse, validate
from toolpoint.io.yaml.machine_file import cutting_of
from toolpoint.joints import Reducer
from toolpoint.machine.description import MachineDescription, MeshDescription
from toolpoint.machine.robot.datasheet import RobotDatasheet, find_datasheet_faults
from toolpoint.machine.robot.model import robot_machine

VERSION = 1


@door("robot datasheet")
def read(path: str | Path) -> RobotDatasheet:
    """Return the datasheet of a YAML file, SI; raises FileFaults with every fault of the file."""
    return _read(Path(path))[0]


@door("robot datasheet")
def read_robot_machine(path: str | Path, loads: Mapping[str, float] | None = None) -> MachineDescription:
    """Return the machine of a datasheet with the cut that stands in its file, see `machine.robot.model.robot_machine`."""
    sheet, cutting, document = _read(Path(path))
    meshes = {name: MeshDescription(part.mesh, stl.read(document.file.parent / part.mesh) * part.mesh_unit)
              for name, part in sheet.members.items() if part.kind == "mesh"}
    return robot_machine(sheet, cutting=cutting, meshes=meshes, loads=loads)


def _read(path: Path) -> tuple[RobotDatasheet, CuttingDescription | None, Document]:
    document = parse(path)
    if document.data.get("toolpoint") != VERSION:
        document.fault(("toolpoint",), f"file version {document.data.get('toolpoint')!r}; this program reads version {VERSION}")
    cutting = document.data.pop("cutting", None)
    part = None if cutting is None else validate(machine_schema.CuttingModel, cutting, ("cutting",), document=document)
    cut = None if part is None else cutting_of(part, document)
    model: BaseModel | None = validate(model_of(RobotDatasheet, version=True), document.data, (), document=document)
    sheet = None if model is None else _described(model, document)
    for key, text in () if sheet is None else find_datasheet_faults(sheet):
        document.fault(key, text)
    if document.faults or sheet is None:
        raise FileFaults(str(path), document.text, document.faults)
    return sheet, cut, document


def _described(model: Any, document: Document) -> RobotDatasheet | None:
    """Return the datasheet of a validated model; a faulty row of the catalogue is a fault at its place."""
    for name, row in model.catalogue.items():
        try:
            describe(Reducer, row)
        except ToolpointError as error:
            key = error.argument.partition(".")[2].split(".") if error.argument else []
            document.fault(("catalogue", name, *key), str(error))
    return None if document.faults else describe(RobotDatasheet, model)


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of datasheets, for editors that check YAML while it is typed."""
    return file_schema(model_of(RobotDatasheet, version=True), "toolpoint robot datasheet")
