"""Machine files in YAML: read with all faults at once, and written."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel
from ruamel.yaml import YAML

from toolpoint._check import ToolpointError, suggestion
from toolpoint.cutting.description import CuttingDescription, flat_values
from toolpoint.io.door import door
from toolpoint.io.faults import FileFaults
from toolpoint.io.meshes import stl
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_schema as schema
from toolpoint.io.yaml.cutting_schema import cutting_of
from toolpoint.io.yaml.description_schema import describe
from toolpoint.io.yaml.document import FILE_VERSION, Document, Key, parse, validate
from toolpoint.io.yaml.file_doubts import warn_of_doubts
from toolpoint.io.yaml.machine_motion import assembly_modes_of, axis_of, direction_of, limits_of, place_joints, task_of
from toolpoint.joints.law import LawDescription
from toolpoint.kinematics.axis import Axis
from toolpoint.kinematics.task import ANGLES
from toolpoint.machine import description as d
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody, SolidDescription
from toolpoint.machine.description.faults import axis_faults, tree_faults
from toolpoint.machine.description.gravity import gravity_vector
from toolpoint.machine.description.matrices import MatricesBody, MatricesDescription
from toolpoint.machine.parts.laws import joint_law
from toolpoint.machine.parts.mass import mass_properties

if TYPE_CHECKING:
    from toolpoint.machine.parts.model import Machine

_SECTIONS: dict[str, type[BaseModel]] = {
    "bodies": schema.BodyModel, "joints": schema.JointModel, "axes": schema.AxisModel, "points": schema.PointModel}


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
    for section, model in _SECTIONS.items():
        entries = data.get(section) or {}
        if not isinstance(entries, dict):
            document.fault((section,), "must be names with their data, indented below")
            entries = {}
        parts[section] = {name: part for name, entry in entries.items()
                          if (part := validate(model, entry, (section, name), document=document)) is not None}
    for section in ("bodies", "joints"):
        if not data.get(section):
            document.fault((section,), "missing; a machine needs at least one")
    plain_keys = {key: value for key, value in data.items() if key not in _SECTIONS}
    file_model = validate(schema.MachineModel, {**plain_keys, "bodies": {}, "joints": {}}, (), document=document)
    place_joints(document, parts)
    converted = _converted(document, parts)
    _references(document, file_model)
    _tree(document, converted, data)
    if document.faults or file_model is None:
        return None
    return _whole(file_model, converted, document)


def _converted(document: Document, parts: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    result: dict[str, dict[str, Any]] = {section: {} for section in _SECTIONS}
    makers: dict[str, Callable[..., Any]] = {"bodies": body_of, "joints": _joint, "axes": _axis, "points": _point}
    for section, make in makers.items():
        for name, part in parts[section].items():
            try:
                result[section][name] = make(part, document)
            except (ToolpointError, units.UnitError) as error:
                path_words = str(error).split(":")[0].split(".")
                named = error.argument if isinstance(error, ToolpointError) else ""
                is_path = all(word.isidentifier() for word in path_words)
                document.fault((section, name, *(path_words if is_path else ())),
                               str(error).removeprefix(f"{named}: ") if "." in named else str(error))
    return result


def body_of(part: schema.BodyModel, document: Document) -> d.BodyDescription:
    """Return the description of a body after checking its mass properties; meshes lie beside the document."""
    body = d.BodyDescription(
        part.mass, part.centre, _as(d.InertiaDescription, part.inertia), part.density, _as(d.ShapeDescription, part.shape),
        None if part.mesh is None else _mesh(part.mesh, document),
        d.FrameDescription(part.frame.at, part.frame.rotation),
        _as(d.ShapeDescription, part.draw), part.draw_at, part.source,
        None if part.spin is None else d.SpinDescription(part.spin.speed * math.pi / 30,
                                                         direction_of("spin.axis", part.spin.axis)),
        None if part.elastic is None else describe(ElasticDescription, part.elastic),
        None if part.beam is None else describe(BeamDescription, part.beam),
        None if part.matrices is None else _matrices(part.matrices, document),
        None if part.solid is None else _solid(part.solid, document))
    mass_properties(body)
    return body


def _as(kind: type[Any], part: BaseModel | None) -> Any:
    return None if part is None else kind(**part.model_dump())


def _mesh(part: schema.MeshModel, document: Document) -> d.MeshDescription:
    return d.MeshDescription(part.file, stl.read(document.file.parent / part.file) * part.unit)


def _matrices(part: BaseModel, document: Document) -> MatricesBody:
    """Return imported matrices with the places of their points; the files lie beside the document."""
    from toolpoint.io import point_table
    from toolpoint.io.matrices import matrix_files
    from toolpoint.io.meshes import mesh_files

    described, folder = describe(MatricesDescription, part), document.file.parent
    mass = folder / described.mass_file if described.mass_file else None
    content = matrix_files.read_matrices(folder / described.file, mass, units=described.units)
    if not described.geometry:
        if not content.coordinates:
            raise ToolpointError(f"geometry: left out, and {described.file} holds no places; must be a table (point, x, y, z) "
                                 "or a mesh of its points", argument="geometry")
        return MatricesBody(described, content)
    geometry = folder / described.geometry
    size = 1e-3 if described.units.startswith("mm") else 1.0
    if mesh_files.is_mesh(geometry):
        places = {name: size * place for name, place in mesh_files.read_nodes(geometry).items()}
    else:
        places = point_table.read(geometry, length=size)
    return MatricesBody(described, replace(content, coordinates=places))


def _solid(part: BaseModel, document: Document) -> SolidBody:
    """Return a described solid with its mesh; the file lies beside the document."""
    from toolpoint.io.meshes.solid_files import read_solid

    return read_solid(describe(SolidDescription, part), document.file.parent)


def _joint(part: schema.JointModel, document: Document) -> d.JointDescription:
    loss = part.loss_factor
    joint = d.JointDescription(
        part.parent, part.child, d.FrameDescription(part.at or d.ORIGIN_VECTOR, part.rotation), _set(part.stiffness),
        _set(part.damping),
        loss if isinstance(loss, float) else _set(loss), part.free, part.stiffness_matrix, part.damping_matrix,
        part.elastic_at, part.closes_loop, part.parent_interface, part.child_interface, part.source, part.passive,
        {way: limits_of(f"limits.{way}", span, "r" in way) for way, span in part.limits.items()}, part.largest_tilt,
        part.screws, None if part.law is None else describe(LawDescription, part.law), part.at is not None)
    joint_law(joint)
    return joint


def _set(model: BaseModel) -> dict[str, float]:
    return {name: value for name, value in model.model_dump().items() if value is not None}


def _axis(part: schema.AxisModel, document: Document) -> d.AxisDescription:
    return axis_of(part)


def _point(part: schema.PointModel, document: Document) -> d.PointDescription:
    return d.PointDescription(part.body, part.at, part.interface)


def _references(document: Document, file_model: schema.MachineModel | None) -> None:
    document.data = {**document.data, **{
        section: {} for section in _SECTIONS if not isinstance(document.data.get(section), dict)}}
    names = {section: list(document.data[section]) for section in _SECTIONS}

    def known(key: Key, name: str | None, section: str, *, extra: tuple[str, ...] = ()) -> None:
        allowed = [*names[section], *extra]
        if name is not None and name not in allowed:
            hint = suggestion(name, allowed)
            what = {"bodies": "body", "joints": "joint", "axes": "axis", "points": "point"}[section]
            document.fault(key, f"there is no {what} {name!r}; " + (hint or f"known: {', '.join(allowed) or 'none'}"))

    # Taken from the raw data, so that an entry with another fault still has its references checked.
    for name, entry in document.data["axes"].items():
        for i, drive in enumerate(entry.get("drives") or [] if isinstance(entry, dict) else []):
            if isinstance(drive, dict) and isinstance(drive.get("joint"), str):
                known(("axes", name, "drives", i, "joint"), drive["joint"], "joints")
    for section, key, target, extra in (("axes", "joint", "joints", ()), ("points", "body", "bodies", (d.GROUND,))):
        for name, entry in (document.data.get(section) or {}).items():
            if isinstance(entry, dict) and isinstance(entry.get(key), str):
                known((section, name, key), entry[key], target, extra=extra)
    for key in ("tool", "table"):
        if isinstance(document.data.get(key), str):
            known((key,), document.data[key], "points")
    if file_model is None:
        return
    if file_model.task is not None:
        known(("task", "point"), file_model.task.point, "points")
        for i, name in enumerate(file_model.task.axes):
            known(("task", "axes", i), name, "axes")
    for i, load in enumerate(file_model.loads):
        known(("loads", i, "point"), load.point, "points")
    for i, pose in enumerate(file_model.poses):
        for name in pose:
            known(("poses", i, name), name, "axes", extra=() if file_model.task is None else tuple(file_model.task.coordinates))


def _tree(document: Document, converted: dict[str, dict[str, Any]], data: Mapping[str, Any]) -> None:
    # Only names matter here, so bodies that have other faults still count as present.
    def shell(section: str, make: Callable[[Mapping[str, Any]], Any]) -> dict[str, Any]:
        entries = data.get(section)
        return {n: make(e) for n, e in entries.items() if isinstance(e, dict)} if isinstance(entries, dict) else {}

    joints = shell("joints", lambda e: d.JointDescription(str(e.get("parent")), str(e.get("child")),
                                                          closes_loop=e.get("closes_loop") is True))
    complete = {n: j for n, j in joints.items() if {"parent", "child"} <= set(data["joints"][n])}
    is_complete = len(complete) == len(joints)
    faults = tree_faults(d.MachineDescription("", shell("bodies", lambda e: d.BodyDescription()), complete))
    for path, message in faults:
        if is_complete or not path.startswith("bodies"):
            document.fault(tuple(path.split(".")), message)
    if not document.faults:
        for path, message in axis_faults(d.MachineDescription("", {}, converted["joints"], converted["axes"])):
            document.fault(tuple(path.split(".")), message)


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
    _check_identified(result, document)
    return None if document.faults else result


def _check_identified(machine: d.MachineDescription, document: Document) -> None:
    """Find faults of the identified numbers: paths that are none, rows that are no triangle, a covariance that is none."""
    identified = machine.identified
    if identified is None:
        return
    for i, path in enumerate(identified.parameters):
        try:
            machine.value(path)
        except ToolpointError as error:
            document.fault(("identified", "parameters", i), f"identified: {error}")
    if [len(row) for row in identified.covariance] != list(range(1, len(identified.parameters) + 1)):
        document.fault(("identified", "covariance"), f"must have {len(identified.parameters)} rows of 1, 2, 3 ... numbers: the "
                       "lower triangle over the parameters")
        return
    matrix = identified.matrix
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    if (np.diag(matrix) < 0).any() or np.linalg.eigvalsh(matrix / np.outer(size, size))[0] < -1e-6:
        document.fault(("identified", "covariance"), "has a negative variance or eigenvalue; a covariance has none")



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
    """Write the section ``cutting`` alone, SI numbers, to be put into a machine file."""
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
