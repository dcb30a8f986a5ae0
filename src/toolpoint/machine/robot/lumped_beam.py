r"""A member that bends as a beam: two rigid halves on six springs in its middle.

For loads at its ends it gives way exactly as a uniform beam of length L: the turning springs EI/L and GJ/L, along it EA/L,
across it 12 EI/L^3 in series with the shear stiffness. Its mass is lumped in the halves, so modes within the member itself are
not its own. Source: Przemieniecki, Theory of Matrix Structural Analysis, 1968, chapter 5 (the beam's flexibility, referred to
its middle).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import fail
from toolpoint.machine.robot.datasheet import RobotMember

MEMBER_POISSON_RATIO = 0.33  # of aluminium and its castings
_SHEAR_COEFFICIENTS = {"box": 5 / 6, "cylinder": 0.9}  # shear coefficient of the section


def beam_springs(name: str, member: RobotMember) -> dict[str, float]:
    """Return the six springs of a member in the machine's directions, N/m and N m/rad."""
    along = "xyz".index(member.along)
    length, area, bend, twist = _section(name, member, along)
    shear_modulus = member.modulus / (2 * (1 + MEMBER_POISSON_RATIO))
    springs = {"xyz"[along]: member.modulus * area / length, "r" + "xyz"[along]: shear_modulus * twist / length}
    for way in (w for w in range(3) if w != along):
        other = 3 - along - way
        flexible = length**3 / (12 * member.modulus * bend[other]) + length / (_SHEAR_COEFFICIENTS[member.kind] * shear_modulus
                                                                               * area)
        springs["xyz"[way]] = 1 / flexible
        springs["r" + "xyz"[way]] = member.modulus * bend[way] / length
    return springs


def _section(name: str, member: RobotMember, along: int) -> tuple[float, float, dict[int, float], float]:
    """Return length, area, second moments about the two axes across, and torsion constant."""
    wall = member.wall
    if member.kind == "cylinder":
        assert member.diameter is not None and member.length is not None
        inner_diameter = member.bore if wall is None else member.diameter - 2 * wall
        _check_wall(name, inner_diameter)
        moment = np.pi / 64 * (member.diameter**4 - inner_diameter**4)
        area = np.pi / 4 * (member.diameter**2 - inner_diameter**2)
        return member.length, area, {k: moment for k in range(3) if k != along}, 2 * moment
    a, b = (k for k in range(3) if k != along)
    outer_size = {k: member.size[k] for k in (a, b)}
    inner_size = {k: 0.0 if wall is None else outer_size[k] - 2 * wall for k in outer_size}
    _check_wall(name, min(inner_size.values()))
    bend = {a: (outer_size[a] * outer_size[b]**3 - inner_size[a] * inner_size[b]**3) / 12,
            b: (outer_size[b] * outer_size[a]**3 - inner_size[b] * inner_size[a]**3) / 12}
    area = outer_size[a] * outer_size[b] - inner_size[a] * inner_size[b]
    if wall is None:
        short_side, long_side = sorted(outer_size.values())
        # Torsion constant of a solid rectangle: Roark, Formulas for Stress and Strain, within 0.5 % of the series.
        twist = long_side * short_side**3 * (1 / 3 - 0.21 * short_side / long_side * (1 - short_side**4 / (12 * long_side**4)))
    else:  # Bredt, thin closed wall
        middle = [outer_size[k] - wall for k in (a, b)]
        twist = 2 * wall * (middle[0] * middle[1])**2 / (middle[0] + middle[1])
    return member.size[along], area, bend, twist


def _check_wall(name: str, inner_width: float) -> None:
    """Raise ToolpointError for walls that leave no hollow (an inner width below zero, m)."""
    if inner_width < 0:
        fail(f"members.{name}.wall", "thicker than half the section", "must leave it hollow",
             remedy="leave it out for a solid member")


def split(member: RobotMember, sense: float) -> tuple[RobotMember, RobotMember]:
    """Return the half on the side of the joint before, and the other; `sense`: on which side along the member the next joint
    is."""
    along = "xyz".index(member.along)
    length = member.size[along] if member.kind == "box" else member.length
    assert length is not None
    halves = []
    for side in (-sense, sense):
        centre = list(member.at)
        centre[along] += side * length / 4
        if member.kind == "box":
            size = list(member.size)
            size[along] /= 2
            half = replace(member, at=tuple(centre), size=tuple(size))
        else:
            half = replace(member, at=tuple(centre), length=length / 2)
        halves.append(replace(half, mass=None if member.mass is None else member.mass / 2))
    return halves[0], halves[1]
