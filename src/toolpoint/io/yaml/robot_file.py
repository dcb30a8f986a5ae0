"""Datasheets of robots in YAML: what is published and what is chosen, read with all faults at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from toolpoint._check import ToolpointError, fail
from toolpoint.bodies.mesh import mass_properties, merge_corners
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.meshes import stl
from toolpoint.io.yaml.cutting_schema import CuttingModel, cutting_of
from toolpoint.io.yaml.description_schema import describe, file_schema, model_of
from toolpoint.io.yaml.document import FILE_VERSION, Document, parse, validate
from toolpoint.joints import Reducer
from toolpoint.machine.description import MachineDescription, MeshDescription
from toolpoint.machine.description.elastic import SolidBody
from toolpoint.machine.robot.datasheet import RobotDatasheet, RobotMember, find_datasheet_faults
from toolpoint.machine.robot.model import robot_machine
from toolpoint.machine.robot.solid_member import solid_of_member

# Of an arm's reach: a member is longer than a hundredth of it, shorter than twice, and no corner is farther than four times.
MAX_REACH_TO_MEMBER, MAX_MEMBER_TO_REACH, MAX_CORNER_TO_REACH = 100.0, 2.0, 4.0
_UNITS: dict[Literal["m", "mm", "cm", "in"], float] = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}


@door("robot datasheet")
def read(path: str | Path) -> RobotDatasheet:
    """Return the datasheet of a YAML file, SI; raises FileFaults with every fault of the file.

    >>> from importlib.resources import files
    >>> sheet = read(files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml")
    >>> len(sheet.axes)  # of an arm
    6
    """
    return _read(Path(path))[0]


@door("robot datasheet")
def read_robot_machine(path: str | Path, loads: Mapping[str, float] | None = None, *, pose: Mapping[str, float] | None = None
                       ) -> MachineDescription:
    """Return the machine of a datasheet with the cut that stands in its file, see `machine.robot.model.robot_machine`.

    >>> from importlib.resources import files
    >>> machine = read_robot_machine(files("toolpoint.app") / "machines" / "milling_robot_datasheet.yaml")
    >>> list(machine.axes)
    ['q1', 'q2', 'q3', 'q4', 'q5', 'q6']
    """
    sheet, cutting, document = _read(Path(path))
    folder = document.file.parent
    parts = {name: part for name, part in sheet.members.items() if part.kind == "mesh"}
    solids = {name: _solid(name, part, folder) for name, part in parts.items() if part.bending == "finite elements"}
    reach = sum(float(np.hypot(row.a, row.d)) for row in sheet.axes)
    meshes = {name: _surface(name, part, folder, reach) for name, part in parts.items() if name not in solids}
    return robot_machine(sheet, cutting=cutting, meshes=meshes, solids=solids, loads=loads, pose=pose)


def _surface(name: str, part: RobotMember, folder: Path, reach: float) -> MeshDescription:
    """Return the closed surface of a rigid member's STL file; reach : of the arm, m, which its size and place must suit."""
    if Path(part.mesh).suffix.lower() != ".stl":
        raise ToolpointError(f"members.{name}.mesh: {part.mesh}; a rigid member's mesh must be an STL surface (or let it bend "
                             "by finite elements)")
    try:
        corners = stl.read(folder / part.mesh) * part.mesh_unit
        size, largest_distance = float(np.ptp(corners.reshape(-1, 3), axis=0).max()), float(np.abs(corners).max())
        is_member = reach / MAX_REACH_TO_MEMBER <= size <= MAX_MEMBER_TO_REACH * reach
        if not is_member or largest_distance > MAX_CORNER_TO_REACH * reach:
            fail("mesh_unit", f"{part.mesh_unit:g} m makes it {size:.4g} m long, {largest_distance:.4g} m from the base at "
                 f"most",
                 f"must suit an arm of {reach:.3g} m",
                 remedy="most STL files are in mm (mesh_unit: 1 mm), in the machine's axes")
        mass_properties(*merge_corners(corners), 1.0)
    except ToolpointError as error:
        raise ToolpointError(f"members.{name}.mesh: {part.mesh}: {error}") from None
    return MeshDescription(part.mesh, corners)


def _solid(name: str, part: RobotMember, folder: Path) -> SolidBody:
    """Return the finite elements of a member's file."""
    from toolpoint.io.meshes.mesh_files import is_mesh, read_sets
    from toolpoint.io.meshes.solid_files import read_solid

    unit = next((word for word, size in _UNITS.items() if abs(part.mesh_unit / size - 1) < 1e-9), None)
    if unit is None:
        raise ToolpointError(f"members.{name}.mesh_unit: {part.mesh_unit:g} m; must be 1 m, 1 mm, 1 cm or 1 in")
    try:
        described = solid_of_member(part, unit)
        if is_mesh(folder / part.mesh) and (folder / part.mesh).is_file():  # one material, whatever its sets are called
            sets = dict.fromkeys(read_sets(folder / part.mesh), described.materials["body"])
            described = replace(described, materials=sets)
        return read_solid(described, folder)
    except ToolpointError as error:
        raise ToolpointError(f"members.{name}.mesh: {error}") from None


def _read(path: Path) -> tuple[RobotDatasheet, CuttingDescription | None, Document]:
    document = parse(path)
    document.check_version(FILE_VERSION)
    cutting = document.data.pop("cutting", None)
    part = None if cutting is None else validate(CuttingModel, cutting, ("cutting",), document=document)
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
