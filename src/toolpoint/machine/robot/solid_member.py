"""A member by reduced finite elements: a hollow box or cylinder with thick ends, held by its end faces; no beam's assumptions.

A member of a length of twice its width is no beam: its walls shear and bend, and its ends warp. The faces at its ends carry the
joints, as the ends of the beam do, so the two differ by the member alone.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import fail
from toolpoint.machine.description import machine as d
from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, ElasticMaterial, PatchDescription
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
            fail(f"members.{name}.wall", f"{1e3 * member.wall:g} mm", "must leave it hollow", "leave it out for a solid member")
        boxes.append(CastingBox(_place(low + inside), _place(high - inside), window=True, round=turned))
        volume -= fill * float((size - 2 * inside).prod())
    material = ElasticMaterial(member.modulus, mass / volume, POISSON, member.loss_factor)
    places = {NEAR: _end(member, -sense), FAR: _end(member, sense)}
    elastic = ElasticDescription(tuple(boxes), places, BAND, float(size.max()) / ELEMENTS, {"body": material})
    return d.BodyDescription(elastic=elastic, source=f"{name} by finite elements: {member.source}")


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
