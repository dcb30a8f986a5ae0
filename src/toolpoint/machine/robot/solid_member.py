"""A member by reduced finite elements: a hollow box or cylinder with thick ends, held by its end faces; no beam's assumptions.

A member of a length of twice its width is no beam: its walls shear and bend, and its ends warp. The faces at its ends carry the
joints, as the ends of the beam do, so the two differ by the member alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from toolpoint._check import fail
from toolpoint.machine.description import machine as d
from toolpoint.machine.description.elastic import (
    CastingBox,
    ElasticDescription,
    ElasticMaterial,
    PatchDescription,
    SolidBody,
    SolidDescription,
)
from toolpoint.machine.robot.datasheet import RobotMember
from toolpoint.machine.robot.lumped_beam import POISSON

NEAR, FAR = "near", "far"
# Chosen: the ends are so many walls thick, the flange so much of a face (of a round one: of
# the square within it); up to which frequency free modes are kept (Hz), and
# elements along the longest edge.
ENDS, FLANGE, BAND, ELEMENTS = 3.0, 0.9, 1000.0, 6
_MOST_OF_LENGTH = 0.25


def solid_member(name: str, member: RobotMember, mass: float, *, sense: float) -> d.BodyDescription:
    """Return the body of a box or a cylinder by finite elements, in the machine frame at the reference pose.

    mass : kg, spread evenly over the walls; sense : on which side along the member the next joint is.
    """
    along = "xyz".index(member.along)
    size, at = _outer_size(member), np.array(member.at)
    low, high = at - size / 2, at + size / 2
    turned = member.along if member.kind == "cylinder" else ""
    boxes = [CastingBox(_place(low), _place(high), round=turned)]
    fill = np.pi / 4 if turned else 1.0
    volume = fill * float(size.prod())
    if member.wall is not None:
        inside = np.full(3, member.wall)
        inside[along] = min(ENDS * member.wall, _MOST_OF_LENGTH * size[along])
        if (2 * inside >= size).any():
            fail(f"members.{name}.wall", f"{1e3 * member.wall:g} mm", "must leave it hollow",
                 remedy="leave it out for a solid member")
        boxes.append(CastingBox(_place(low + inside), _place(high - inside), window=True, round=turned))
        volume -= fill * float((size - 2 * inside).prod())
    material = ElasticMaterial(member.modulus, mass / volume, POISSON, member.loss_factor)
    places = {NEAR: _end(member, -sense), FAR: _end(member, sense)}
    elastic = ElasticDescription(tuple(boxes), places, BAND, float(size.max()) / ELEMENTS, {"body": material})
    return d.BodyDescription(elastic=elastic, source=f"{name} by finite elements: {member.source}")


def mesh_member(name: str, member: RobotMember, solid: SolidBody, *, mass: float) -> d.BodyDescription:
    """Return the body of a member by the finite elements of its file, of a mass (kg) spread evenly."""
    from toolpoint.bodies.solid.checks import check_solid

    even = replace(solid, materials={key: replace(part, density=1.0) for key, part in solid.materials.items()})
    volume = check_solid(even.model).mass
    material = ElasticMaterial(member.modulus, mass / volume, POISSON, member.loss_factor)
    return d.BodyDescription(solid=replace(solid, materials=dict.fromkeys(solid.materials, material)),
                             source=f"{name} by finite elements: {member.source}")


def solid_of_member(member: RobotMember, unit: Literal["m", "mm", "cm", "in"]) -> SolidDescription:
    """Return what is to be read of a member that is a mesh by finite elements."""
    assert member.near is not None and member.far is not None
    material = ElasticMaterial(member.modulus, 1000.0, POISSON, member.loss_factor)
    return SolidDescription(member.mesh, {NEAR: member.near, FAR: member.far}, BAND, member.mesh_size,
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
    near, far = np.array(member.near.centre), np.array(member.far.centre)
    return (near + far) / 2, far - near


def _outer_size(member: RobotMember) -> np.ndarray:
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
    share = FLANGE if member.kind == "box" else FLANGE / np.sqrt(2)
    centre = np.array(member.at) + side * size[along] / 2 * np.eye(3)[along]
    return PatchDescription(_place(centre), tuple(first.tolist()), tuple((side * second).tolist()),
                            share * float(size @ first), share * float(size @ second))


def _place(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(v) for v in values)
