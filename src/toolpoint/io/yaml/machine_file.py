"""Machine files in YAML: read with all faults at once, and written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ruamel.yaml import YAML

from toolpoint._check import ToolpointError
from toolpoint.cutting.description import CuttingDescription, flat_values
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_schema as schema
from toolpoint.io.yaml.cutting_schema import cutting_of
from toolpoint.io.yaml.document import FILE_VERSION, Document, Key, parse, validate
from toolpoint.io.yaml.file_doubts import warn_of_doubts
from toolpoint.io.yaml.machine_motion import assembly_modes_of, direction_of, place_joints, task_of
from toolpoint.io.yaml.machine_parts import parts_of
from toolpoint.io.yaml.machine_references import check_identified, check_references, check_tree
from toolpoint.kinematics.axis import Axis
from toolpoint.kinematics.task import ANGLES
from toolpoint.machine import description as d
from toolpoint.machine.description.elastic import SolidBody, SolidDescription
from toolpoint.machine.description.gravity import gravity_vector
from toolpoint.machine.description.matrices import MatricesBody

if TYPE_CHECKING:
    from toolpoint.machine.parts.model import Machine

@door("machine file")
def read(path: str | Path) -> Machine:
    """Return the machine of a YAML file, or of a URDF file by its suffix (joints are rigid then, see `urdf.read`).

    Raises
    ------
    FileFaults
        With every fault of the file: line, column, key, value, limit and remedy.

    Warns
    -----
    FileDoubt
        For every doubt that the file states, and where the modes differ from its measured `reference`.

    >>> from importlib.resources import files
    >>> read(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml").size  # six freedoms
    6
    """
    if Path(path).suffix.lower() == ".urdf":
        from toolpoint.io import urdf  # loaded for this format only

        return _build(urdf.read(path))
    document = parse(Path(path))
    description = describe_document(document)
    if document.faults or description is None:
        raise FileFaults(str(path), document.text, document.faults)
    try:
        return warn_of_doubts(_build(description))
    except ToolpointError as error:
        key = tuple(error.argument.split("."))
        if len(key) < 2 or key[0] not in document.data:
            raise
        document.fault(key, str(error).removeprefix(f"{error.argument}: "))
        raise FileFaults(str(path), document.text, document.faults) from None


def _build(description: d.MachineDescription) -> Machine:
    from toolpoint.machine.parts.build import build  # loaded for files without a fault

    machine = build(description)
    if not machine.reduced:
        return machine
    from toolpoint.machine.assembly.condensed_store import condense_described

    return condense_described(machine)


def describe_document(document: Document) -> d.MachineDescription | None:
    """Return what a document describes; None with faults, which stand in it."""
    if document.data.get("arm") is not None:
        from toolpoint.io.yaml.arm_section import expand_arm  # loaded where a file describes an arm

        expand_arm(document)
    data, version = document.data, document.data.get("toolpoint")
    if version != FILE_VERSION:
        document.fault(("toolpoint",), f"file version {version!r}; this program reads version {FILE_VERSION}"
                       if "toolpoint" in data else "missing; the first line of a machine file is 'toolpoint: 1'")
    parts: dict[str, dict[str, Any]] = {}
    for section, model in schema.SECTION_MODELS.items():
        entries = data.get(section) or {}
        if not isinstance(entries, dict):
            document.fault((section,), "must be names with their data, indented below")
            entries = {}
        parts[section] = {name: part for name, entry in entries.items()
                          if (part := validate(model, entry, (section, name), document=document)) is not None}
    for section in ("bodies", "joints"):
        if not data.get(section):
            document.fault((section,), "missing; a machine needs at least one")
    plain_keys = {key: value for key, value in data.items() if key not in schema.SECTION_MODELS}
    file_model = validate(schema.MachineModel, {**plain_keys, "bodies": {}, "joints": {}}, (), document=document)
    place_joints(document, parts)
    converted = parts_of(document, parts)
    check_references(document, file_model)
    check_tree(document, converted, data)
    if document.faults or file_model is None:
        return None
    return _whole(file_model, converted, document)


def _whole(file_model: schema.MachineModel, converted: dict[str, dict[str, Any]],
           document: Document) -> d.MachineDescription | None:
    task, modes = task_of(file_model, document), assembly_modes_of(file_model, document)
    kinds = {name: (axis.is_rotary, axis.limits) for name, axis in converted["axes"].items()} | (
        {} if task is None else {name: (c.coordinate in ANGLES, c.limits) for name, c in task.coordinates.items()})
    poses = []
    for i, pose in enumerate(file_model.poses):
        poses.append({name: _position(value, *kinds[name], key=("poses", i, name), document=document)
                      for name, value in pose.items() if name in kinds})
    tool_axis, up = (_direction(key, getattr(file_model, key), document) for key in ("tool_axis", "up"))
    if document.faults:
        return None
    cutting = None if file_model.cutting is None else cutting_of(file_model.cutting, document)
    if document.faults:
        return None
    result = d.MachineDescription(
        file_model.name, converted["bodies"], converted["joints"], converted["axes"], converted["points"],
        gravity_vector(file_model.gravity, up), tuple(d.LoadDescription(**load.model_dump()) for load in file_model.loads),
        file_model.tool, file_model.table, file_model.damping_ratio, cutting,
        tuple(d.ReferenceDescription(**r.model_dump()) for r in file_model.reference), tuple(poses), file_model.description,
        file_model.source, file_model.assumptions, tool_axis, task, modes, file_model.assembly_mode,
        None if file_model.identified is None else d.IdentifiedDescription(**file_model.identified.model_dump()),
        file_model.doubts, file_model.modal_damping or "", up, file_model.reduction_error)
    check_identified(result, document)
    return None if document.faults else result


def _direction(key: str, value: Any, document: Document) -> d.Vector:
    try:
        return direction_of(key, value)
    except ToolpointError as error:
        document.fault((key,), str(error))
        return (0.0, 0.0, 1.0)


def _position(value: Any, is_rotary: bool, limits: tuple[float, float], *, key: Key, document: Document) -> float:
    try:
        position = units.quantity(value, units.ANGLE if is_rotary else units.LENGTH)
    except units.UnitError as error:
        document.fault(key, str(error))
        return 0.0
    if not limits[0] <= position <= limits[1]:
        axis = Axis(str(key[-1]), (), *limits, turns=is_rotary)
        document.fault(key, f"{axis.words(position)} is beyond the limits {axis.span} of the axis")
    return position


def write(description: d.MachineDescription, path: str | Path) -> None:
    """Write a description as a machine file in SI numbers; reading it back gives an equal description.

    Mesh bodies are written with their mass properties' source file only, which must lie beside the new file.

    >>> import tempfile
    >>> from importlib.resources import files
    >>> mill = read(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml").description
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(mill, Path(folder, "mill.yaml"))
    ...     read(Path(folder, "mill.yaml")).description == mill
    True
    """
    data = {"toolpoint": FILE_VERSION, **_lowered(description)}
    for joint in data["joints"].values():
        joint.update({"at": [0.0, 0.0, 0.0]} | joint.pop("frame", {}))
        joint.pop("placed", None)
    for name, body in description.bodies.items():
        if body.spin is not None:
            data["bodies"][name]["spin"]["speed"] = f"{body.spin.speed * 30 / math.pi!r} rpm"
    _dump(data, path)


def write_cutting(cut: CuttingDescription, path: str | Path) -> None:
    """Write the section ``cutting`` alone, SI numbers, to be put into a machine file.

    >>> import tempfile
    >>> from importlib.resources import files
    >>> mill = read(files("toolpoint.app") / "machines" / "three_axis_vertical.yaml").description
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_cutting(mill.cutting, Path(folder, "cut.yaml"))
    ...     print(Path(folder, "cut.yaml").read_text(encoding="utf-8").splitlines()[1].strip())  # m
    diameter: 0.08
    """
    _dump({"cutting": _lowered(cut)}, path)


def _dump(data: Mapping[str, Any], path: str | Path) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.width = 120
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.representer.add_multi_representer(str, lambda representer, text: representer.represent_str(str(text)))  # a Doubt too
    with Path(path).open("w", encoding="utf-8") as file:
        yaml.dump(data, file)


def _lowered(value: Any) -> Any:
    if isinstance(value, CuttingDescription):
        return _lowered(flat_values(value))
    if isinstance(value, MatricesBody):
        return _lowered(value.description)
    if isinstance(value, SolidBody):
        return _lowered(SolidDescription(**{f.name: getattr(value, f.name) for f in fields(SolidDescription)}))
    if isinstance(value, d.MeshDescription):
        return {"file": value.file}
    if is_dataclass(value):
        entries = {f.name: getattr(value, f.name) for f in fields(value)}
        kept = {f.name: entries[f.name] for f in fields(value) if not _is_default(f, entries[f.name])}
        if isinstance(value, d.AxisDescription) and np.isinf(value.limits[0]):
            kept.pop("limits", None)
        return {name: _lowered(entry) for name, entry in kept.items()}
    if isinstance(value, Mapping):
        return {str(k): _lowered(v) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_lowered(v) for v in value]
    return float(value) if isinstance(value, (float, np.floating)) else value


def _is_default(field: Any, value: Any) -> bool:
    if field.default is not MISSING:
        return bool(value == field.default) if not isinstance(value, np.ndarray) else False
    return field.default_factory is not MISSING and value == field.default_factory()
