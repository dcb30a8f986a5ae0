"""A member by reduced finite elements: a hollow box or cylinder with thick ends, held by its end faces; no beam's assumptions.

A member of a length of twice its width is no beam: its walls shear and bend, and its ends warp. The faces at its ends carry the
joints, as the ends of the beam do, so the two differ by the member alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from toolpoint._check import fail
from toolpoint.machine import description as d
from toolpoint.machine.description.elastic import (
    CastingBox,
    ElasticDescription,
    ElasticMaterial,
    PatchDescription,
    SolidBody,
    SolidDescription,
)
from toolpoint.machine.robot.datasheet import RobotMember
from toolpoint.machine.robot.lumped_beam import MEMBER_POISSON_RATIO

NEAR_FACE, FAR_FACE = "near", "far"  # interfaces at the joint before and at the next one
# Chosen: thickness of the ends over that of the walls; flange as a fraction of a face (of a round one: of the square within
# it); band in which free modes are kept (Hz); elements along the longest edge.
END_WALL_RATIO, FLANGE_FRACTION, MEMBER_BAND, LONGEST_EDGE_ELEMENTS = 3.0, 0.9, 1000.0, 6
_MAX_END_FRACTION = 0.25  # of the member's length: thickness of an end


def solid_member(name: str, member: RobotMember, mass: float, *, sense: float) -> d.BodyDescription:
    """Return the body of a box or a cylinder by finite elements, in the machine frame at the reference pose.

    mass : kg, spread evenly over the walls; sense : on which side along the member the next joint is.
    """
    along = "xyz".index(member.along)
    size, centre = _outer_size(member), np.array(member.at)
    lower_corner, upper_corner = centre - size / 2, centre + size / 2
    round_axis = member.along if member.kind == "cylinder" else ""
    boxes = [CastingBox(_place(lower_corner), _place(upper_corner), round=round_axis)]
    section_fill = np.pi / 4 if round_axis else 1.0
    volume = section_fill * float(size.prod())
    if member.wall is not None:
        wall_thickness = np.full(3, member.wall)
        wall_thickness[along] = min(END_WALL_RATIO * member.wall, _MAX_END_FRACTION * size[along])
        if (2 * wall_thickness >= size).any():
            fail(f"members.{name}.wall", f"{1e3 * member.wall:g} mm", "must leave it hollow",
                 remedy="leave it out for a solid member")
        boxes.append(CastingBox(_place(lower_corner + wall_thickness), _place(upper_corner - wall_thickness), window=True,
                                round=round_axis))
        volume -= section_fill * float((size - 2 * wall_thickness).prod())
    material = ElasticMaterial(member.modulus, mass / volume, MEMBER_POISSON_RATIO, member.loss_factor)
    places = {NEAR_FACE: _end(member, -sense), FAR_FACE: _end(member, sense)}
    elastic = ElasticDescription(tuple(boxes), places, MEMBER_BAND, float(size.max()) / LONGEST_EDGE_ELEMENTS,
                                 {"body": material})
    return d.BodyDescription(elastic=elastic, source=f"{name} by finite elements: {member.source}")


def mesh_member(name: str, member: RobotMember, solid: SolidBody, *, mass: float) -> d.BodyDescription:
    """Return the body of a member by the finite elements of its file, of a mass (kg) spread evenly."""
    from toolpoint.bodies.solid.checks import check_solid

    unit_density = replace(solid, materials={key: replace(part, density=1.0) for key, part in solid.materials.items()})
    volume = check_solid(unit_density.model).mass
    material = ElasticMaterial(member.modulus, mass / volume, MEMBER_POISSON_RATIO, member.loss_factor)
    return d.BodyDescription(solid=replace(solid, materials=dict.fromkeys(solid.materials, material)),
                             source=f"{name} by finite elements: {member.source}")


def solid_of_member(member: RobotMember, unit: Literal["m", "mm", "cm", "in"]) -> SolidDescription:
    """Return the solid to be read for a member that is a mesh by finite elements."""
    assert member.near is not None and member.far is not None
    material = ElasticMaterial(member.modulus, 1000.0, MEMBER_POISSON_RATIO, member.loss_factor)
    return SolidDescription(member.mesh, {NEAR_FACE: member.near, FAR_FACE: member.far}, MEMBER_BAND, member.mesh_size,
                            unit, {"body": material})


def surface_of(solid: SolidBody) -> d.MeshDescription:
    """Return the outer surface of a solid, whose volume the calibrated density fills."""
    from toolpoint.bodies.solid.faces import outer_triangles

    nodes, triangles = outer_triangles(solid.model)
    return d.MeshDescription(solid.file, solid.model.nodes[nodes][triangles])


def middle_of(member: RobotMember) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of a member, and the way from its near to its far face (nothing where they are not told)."""
    if member.near is None or member.far is None:
        return np.array(member.at), np.zeros(3)
    near_centre, far_centre = np.array(member.near.centre), np.array(member.far.centre)
    return (near_centre + far_centre) / 2, far_centre - near_centre


def _outer_size(member: RobotMember) -> np.ndarray:
    """Return the edges (3,) of the box around a member, m."""
    if member.kind == "box":
        return np.array(member.size)
    assert member.diameter is not None and member.length is not None
    size = np.full(3, member.diameter)
    size["xyz".index(member.along)] = member.length
    return size


def _end(member: RobotMember, side: float) -> PatchDescription:
    """Return the face at an end, its normal outwards."""
    along = "xyz".index(member.along)
    first, second = np.eye(3)[(along + 1) % 3], np.eye(3)[(along + 2) % 3]
    size = _outer_size(member)
    share = FLANGE_FRACTION if member.kind == "box" else FLANGE_FRACTION / np.sqrt(2)
    centre = np.array(member.at) + side * size[along] / 2 * np.eye(3)[along]
    return PatchDescription(_place(centre), tuple(first.tolist()), tuple((side * second).tolist()),
                            share * float(size @ first), share * float(size @ second))


def _place(values: np.ndarray) -> tuple[float, ...]:
    """Return a place as plain floats."""
    return tuple(float(v) for v in values)
