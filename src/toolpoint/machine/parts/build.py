"""Description -> parts. The only table from the kinds named in a file to the classes that hold them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, fail, suggestion
from toolpoint.bodies import Body, MassProperties, mesh, shapes
from toolpoint.joints import LinearJoint, linear, screws
from toolpoint.joints.law import LawDescription
from toolpoint.joints.linear import DIRECTIONS
from toolpoint.machine.description.frames import frame
from toolpoint.machine.description.machine import (
    ELASTIC,
    GROUND,
    BodyDescription,
    JointDescription,
    MachineDescription,
    ShapeDescription,
)
from toolpoint.machine.parts.chain import build_chain, large_freedoms
from toolpoint.machine.parts.model import LoopJoint, Machine


def _box(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.box(_given(shape, "size"), density)


def _cylinder(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.cylinder(_given(shape, "diameter"), _given(shape, "length"), density, axis=shape.axis, bore=shape.bore)


def _sphere(shape: ShapeDescription, density: float) -> MassProperties:
    return shapes.sphere(_given(shape, "diameter"), density)


SHAPES: dict[str, Callable[[ShapeDescription, float], MassProperties]] = {
    "box": _box, "cylinder": _cylinder, "sphere": _sphere}


def _given(shape: ShapeDescription, name: str) -> float:
    value = getattr(shape, name)
    if value is None:
        fail(f"shape.{name}", "missing", f"a {shape.kind} needs it")
    return value


def mass_properties(body: BodyDescription) -> MassProperties:
    """Return the mass properties of a described body, in its own frame.

    Raises ToolpointError for a body with too little or contradicting data.
    """
    kinds = [kind for kind in ELASTIC if getattr(body, kind) is not None]
    given = [name for name in ("mass", "inertia", "density", "shape", "mesh") if getattr(body, name) is not None]
    if kinds and given:
        fail(given[0], f"given beside {kinds[0]}", "must come from one source", "remove it: finite elements have their mass")
    if len(kinds) > 1:
        fail(kinds[1], f"given beside {kinds[0]}", "must be one of them", "remove one")
    if body.elastic is not None:
        return body.elastic.model.mass_properties
    if body.beam is not None:
        from toolpoint.machine.parts.beam_body import beam_mass

        return _named("beam", beam_mass, body.beam)
    if body.matrices is not None:
        from toolpoint.machine.parts.imported_body import matrices_mass

        return _named("matrices", matrices_mass, body.matrices)
    if body.mesh is not None or body.shape is not None:
        if body.inertia is not None:
            fail("inertia", "given beside a shape or a mesh", "must come from one source", "remove one of them")
        return _from_solid(body)
    if body.mass is None or body.inertia is None:
        missing = "mass" if body.mass is None else "inertia"
        fail(missing, "missing", "a body needs mass and inertia, or a shape, or a mesh with a density")
    if body.density is not None:
        fail("density", "given beside mass and inertia", "serves a shape or a mesh only", "remove it")
    return MassProperties(body.mass, np.array(body.centre), body.inertia.tensor)


def _from_solid(body: BodyDescription) -> MassProperties:
    if (body.mass is None) == (body.density is None):
        fail("mass", "both or neither of mass and density given", "a shape or a mesh needs exactly one of them")
    density = 1.0 if body.density is None else body.density
    if body.mesh is not None:
        nodes, triangles = mesh.merge_corners(body.mesh.corners)
        unit = mesh.mass_properties(nodes, triangles, 1.0)
    else:
        shape = body.shape
        assert shape is not None
        if shape.kind not in SHAPES:
            fail("shape.kind", repr(shape.kind), f"must be of {', '.join(SHAPES)}", suggestion(shape.kind, SHAPES))
        unit = SHAPES[shape.kind](shape, 1.0)
    factor = density if body.mass is None else body.mass / unit.mass
    centre = unit.centre if body.mesh is not None else np.zeros(3)
    return MassProperties(unit.mass * factor, centre + np.array(body.centre), unit.inertia * factor)


def joint_law(joint: JointDescription) -> LinearJoint:
    """Return the stiffness and damping law of a described joint."""
    if joint.screws:
        return _screw_law(joint)
    if joint.law is not None:
        return _law_of_parts(joint, joint.law)
    stiffness = joint.stiffness if joint.stiffness_matrix is None else np.array(joint.stiffness_matrix)
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    if joint.stiffness_matrix is not None and joint.stiffness:
        fail("stiffness_matrix", "given beside stiffness", "must come from one source", "remove one of them")
    if joint.damping_matrix is not None and joint.damping:
        fail("damping_matrix", "given beside damping", "must come from one source", "remove one of them")
    return linear(stiffness, damping, joint.loss_factor, free=joint.free)


def _law_of_parts(joint: JointDescription, law: LawDescription) -> LinearJoint:
    """Return the law of a joint from its guideways, screws, bearings and contacts, and stiffness named beside them."""
    if joint.stiffness_matrix is not None:
        fail("stiffness_matrix", "given beside law", "must come from one source", "remove one of them")
    if joint.loss_factor and law.loss_factor:
        fail("loss_factor", "given in the joint and in its law", "must come from one source", "remove one of them")
    beside = linear(joint.stiffness).stiffness
    total = law.stiffness + beside
    loose = [way for i, way in enumerate(DIRECTIONS) if not total[i].any() and way not in joint.free]
    if loose:
        fail("law", f"no stiffness along {', '.join(loose)}", "every direction must be held, free, or have stiffness",
             f"add what holds it (a ball_screw?), stiffness: {{{loose[0]}: ...}}, or free: [{', '.join(loose)}]")
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    return linear(total, damping, joint.loss_factor or law.loss_factor, free=joint.free)


def _screw_law(joint: JointDescription) -> LinearJoint:
    for name in ("stiffness", "damping", "free"):
        if getattr(joint, name):
            fail(name, "given beside screws", "speaks of directions, which a joint of screws has not",
                 "give stiffness_matrix and damping_matrix over the screws")
    if joint.stiffness_matrix is None:
        fail("stiffness_matrix", "missing", "a joint of screws needs it, one row and column a screw")
    if isinstance(joint.loss_factor, Mapping):
        fail("loss_factor", "values by direction", "a joint of screws has one for all")
    if joint.closes_loop:
        fail("screws", "in a joint that closes a loop", "must be a joint of the tree",
             "close the loop at a joint of directions")
    return screws(np.array(joint.screws), np.array(joint.stiffness_matrix),
                  None if joint.damping_matrix is None else np.array(joint.damping_matrix), loss_factor=joint.loss_factor)


def build(description: MachineDescription, bodies: Mapping[str, Body] | None = None) -> Machine:
    """Return the parts of a machine.

    Parameters
    ----------
    description : MachineDescription
    bodies : mapping of name to Body, optional
        Bodies that take the place of described ones, e.g. reduced elastic ones; they stand in the frame that the
        description gives for that name.

    Raises
    ------
    ToolpointError
        For a body without a joint, a joint to a body that is not there, two tree joints on one child, or a circle of
        parents; the message names the part.
    """
    given = {name: _named(f"bodies.{name}", _elastic, body) for name, body in description.bodies.items()
             if body.is_elastic and name not in (bodies or {})} | dict(bodies or {})
    order = tree_order(description)
    links = {description.joints[name].child: i for i, name in enumerate(order)} | {GROUND: -1}
    tree = [description.joints[name] for name in order]
    names = tuple(joint.child for joint in tree)
    laws = {name: _named(f"joints.{name}", joint_law, joint) for name, joint in description.joints.items()}
    chain = build_chain(description, order, laws)
    loops = tuple(
        LoopJoint(name, links[j.parent], links[j.child], frame(j.frame), laws[name], j.parent_interface, j.child_interface,
                  tuple(DIRECTIONS.index(way) for way in large_freedoms(j)))
        for name, j in description.joints.items() if j.closes_loop)
    return Machine(
        description, chain, names,
        tuple(given[n] if n in given else Body.rigid(_named(f"bodies.{n}", mass_properties, description.bodies[n]))
              for n in names),
        np.array([frame(description.bodies[n].frame) for n in names]).reshape(-1, 4, 4),
        tuple(order), tuple(laws[name] for name in order),
        tuple(j.elastic_at == "child" for j in tree),
        tuple((j.parent_interface, j.child_interface) for j in tree), loops, partial(build, bodies=bodies))


def _elastic(body: BodyDescription) -> Body:
    mass_properties(body)  # its faults first: they are cheap to find
    if body.beam is not None:
        from toolpoint.machine.parts.beam_body import build_beam

        return _named("beam", build_beam, body.beam)
    if body.matrices is not None:
        from toolpoint.machine.parts.imported_body import build_matrices

        return _named("matrices", build_matrices, body.matrices)
    from toolpoint.machine.parts.elastic_body import build_elastic  # finite elements load where a body has them

    assert body.elastic is not None
    return build_elastic(body.elastic)


def _named(path: str, make: Callable[[Any], Any], part: Any) -> Any:
    try:
        return make(part)
    except ToolpointError as error:
        raise ToolpointError(f"{path}.{error}") from None


def tree_order(description: MachineDescription) -> list[str]:
    """Return the names of the tree joints, parents before children; faults of the tree raise with the names concerned."""
    tree = {name: joint for name, joint in description.joints.items() if not joint.closes_loop}
    faults = tree_faults(description)
    if faults:
        raise ToolpointError("; ".join(message for _, message in faults))
    order: list[str] = []
    placed = {GROUND}
    while len(order) < len(tree):
        for name, joint in tree.items():
            if name not in order and joint.parent in placed:
                order.append(name)
                placed.add(joint.child)
    return order


def tree_faults(description: MachineDescription) -> list[tuple[str, str]]:
    """Return (path, message) of every fault in how the bodies hang together; empty where they form a tree."""
    tree = {name: joint for name, joint in description.joints.items() if not joint.closes_loop}
    faults: list[tuple[str, str]] = []
    parent_of: dict[str, str] = {}
    known = [GROUND, *description.bodies]
    for name, joint in description.joints.items():
        for role in ("parent", "child"):
            body = getattr(joint, role)
            if body not in known:
                hint = suggestion(body, known)
                faults.append((f"joints.{name}.{role}",
                               f"joint {name}: there is no body {body!r}" + (f"; {hint}" if hint else "")))
        if joint.child == GROUND and not joint.closes_loop:
            faults.append((f"joints.{name}.child", f"joint {name}: the ground cannot be a child; swap parent and child"))
    for name, joint in tree.items():
        if joint.child in parent_of:
            faults.append((f"joints.{name}.child",
                           f"joint {name}: body {joint.child} already hangs on joint {parent_of[joint.child]}; "
                           "mark one of them with closes_loop: true, or change its child"))
        parent_of.setdefault(joint.child, name)
    return faults + _circle_faults(description, tree, parent_of)


def _circle_faults(
    description: MachineDescription, tree: Mapping[str, JointDescription], parent_of: Mapping[str, str]
) -> list[tuple[str, str]]:
    faults: list[tuple[str, str]] = []
    for body in description.bodies:
        if body not in parent_of:
            faults.append((f"bodies.{body}", f"body {body} hangs on no joint; give it one, to the ground if it stands alone"))
            continue
        seen, here = [body], tree[parent_of[body]].parent
        while here != GROUND and here in parent_of and here not in seen:
            seen.append(here)
            here = tree[parent_of[here]].parent
        if here == body:
            circle = " -> ".join([*seen, body])
            faults.append((f"joints.{parent_of[body]}.parent", f"body {body} hangs on itself: {circle}; break the circle "
                           "with a joint to the ground"))
    return faults
