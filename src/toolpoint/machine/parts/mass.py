"""Described bodies -> mass properties. The only table from the shapes named in a file to what computes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from toolpoint._check import FloatArray, fail, suggestion, within
from toolpoint.bodies import mesh, shapes
from toolpoint.bodies.inertia import MassProperties
from toolpoint.machine.description.body import ELASTIC_KINDS, BodyDescription, ShapeDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody


def _box(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.box(_required(shape, "size"), density)


def _cylinder(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.cylinder(_required(shape, "diameter"), _required(shape, "length"), density, axis=shape.axis, bore=shape.bore)


def _sphere(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.sphere(_required(shape, "diameter"), density)


SHAPES: dict[str, Callable[[ShapeDescription, float], MassProperties]] = {
    "box": _box, "cylinder": _cylinder, "sphere": _sphere}


def _required(shape: ShapeDescription, name: str) -> float:
    value = getattr(shape, name)
    if value is None:
        fail(f"shape.{name}", "missing", f"a {shape.kind} needs it")
    return value


def mass_properties(body: BodyDescription) -> MassProperties:
    """Return the mass properties of a described body, in its own frame.

    Raises ToolpointError for a body with too little or contradicting data.
    """
    check_sources(body)
    if body.elastic is not None:
        return within("elastic", _mass_of_solid, body.elastic)
    if body.solid is not None:
        return within("solid", _mass_of_solid, body.solid)
    if body.beam is not None:
        from toolpoint.machine.parts.beam_body import beam_mass

        return within("beam", beam_mass, body.beam)
    if body.matrices is not None:
        from toolpoint.machine.parts.imported_body import matrices_mass

        return within("matrices", matrices_mass, body.matrices)
    if body.mesh is not None or body.shape is not None:
        if body.inertia is not None:
            fail("inertia", "given beside a shape or a mesh", "must come from one source", remedy="remove one of them")
        return _from_solid(body)
    if body.mass is None or body.inertia is None:
        missing_key = "mass" if body.mass is None else "inertia"
        fail(missing_key, "missing", "a body needs mass and inertia, or a shape, or a mesh with a density")
    if body.density is not None:
        fail("density", "given beside mass and inertia", "serves a shape or a mesh only", remedy="remove it")
    return MassProperties(body.mass, np.array(body.centre), body.inertia.tensor)


def equivalent_cuboid(body: BodyDescription) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return centre (3,), principal axes (3, 3) as columns and edges (3,), m, of the uniform cuboid of a body's mass and
    inertia, in its own frame: I_x = m (b^2 + c^2) / 12."""
    properties = mass_properties(body)
    moments, axes = np.linalg.eigh(properties.inertia)
    # Half the sum of the moments less one is the second moment of mass along its axis, m a^2/12; rounding takes that of a
    # plate below zero.
    edges = np.sqrt(np.maximum(12.0 * (moments.sum() / 2 - moments) / properties.mass, 0.0))
    return properties.centre, axes, edges


def _mass_of_solid(part: ElasticDescription | SolidBody) -> MassProperties:
    return part.model.mass_properties


def check_sources(body: BodyDescription) -> None:
    """Raise for an elastic body with mass properties from a second source."""
    kinds = [kind for kind in ELASTIC_KINDS if getattr(body, kind) is not None]
    stated = [name for name in ("mass", "inertia", "density", "shape", "mesh") if getattr(body, name) is not None]
    if kinds and stated:
        fail(stated[0], f"given beside {kinds[0]}", "must come from one source",
             remedy="remove it: finite elements have their mass")
    if len(kinds) > 1:
        fail(kinds[1], f"given beside {kinds[0]}", "must be one of them", remedy="remove one")


def _from_solid(body: BodyDescription) -> MassProperties:
    if (body.mass is None) == (body.density is None):
        fail("mass", "both or neither of mass and density given", "a shape or a mesh needs exactly one of them")
    density = 1.0 if body.density is None else body.density
    if body.mesh is not None:
        nodes, triangles = mesh.merge_corners(body.mesh.corners)
        # At unit density: a stated mass gives the density of a body that states none.
        unit = mesh.mass_properties(nodes, triangles, 1.0)
    else:
        shape = body.shape
        assert shape is not None
        if shape.kind not in SHAPES:
            fail("shape.kind", repr(shape.kind), f"must be of {', '.join(SHAPES)}", remedy=suggestion(shape.kind, SHAPES))
        unit = SHAPES[shape.kind](shape, 1.0)
    factor = density if body.mass is None else body.mass / unit.mass
    centre = unit.centre if body.mesh is not None else np.zeros(3)
    return MassProperties(unit.mass * factor, centre + np.array(body.centre), unit.inertia * factor)
