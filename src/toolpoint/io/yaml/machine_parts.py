"""Parts of machine files: bodies with what lies in files beside them, joints, axes and points as descriptions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from toolpoint._check import ToolpointError
from toolpoint.io.meshes import stl
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_schema as schema
from toolpoint.io.yaml.description_schema import describe
from toolpoint.io.yaml.document import Document
from toolpoint.io.yaml.machine_motion import axis_of, direction_of, limits_of
from toolpoint.joints.law import LawDescription
from toolpoint.machine import description as d
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody, SolidDescription
from toolpoint.machine.description.matrices import MatricesBody, MatricesDescription
from toolpoint.machine.parts.laws import joint_law
from toolpoint.machine.parts.mass import mass_properties


def parts_of(document: Document, parts: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the descriptions of the parts of a machine file by section and name; a part that has none is a fault.

    parts : validated entries by section and name.
    """
    result: dict[str, dict[str, Any]] = {section: {} for section in schema.SECTION_MODELS}
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
