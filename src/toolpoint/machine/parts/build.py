"""Description -> machine: bodies, laws, chain and loops put together."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from toolpoint._check import ToolpointError, fail, suggestion, within
from toolpoint.bodies import Body
from toolpoint.joints.linear import DIRECTIONS
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.body import BodyDescription
from toolpoint.machine.description.faults import tree_faults
from toolpoint.machine.description.frames import frame
from toolpoint.machine.description.machine import GROUND, MachineDescription
from toolpoint.machine.parts.chain import build_chain, large_freedoms
from toolpoint.machine.parts.laws import laws_of
from toolpoint.machine.parts.mass import check_sources, mass_properties
from toolpoint.machine.parts.model import KeptBody, LoopJoint, Machine


def build(description: MachineDescription, bodies: Mapping[str, Body] | None = None, *,
          kept: Mapping[str, KeptBody] | None = None) -> Machine:
    """Return the parts of a machine.

    Parameters
    ----------
    description : MachineDescription
    bodies : mapping of name to Body, optional
        Bodies that take the place of described ones, e.g. reduced elastic ones; they stand in the frame that the
        description gives for that name.
    kept : mapping of name to KeptBody, optional
        Reduced bodies of another state of this machine: those whose modulus, density or loss factor alone differ are scaled,
        not reduced again. A machine brings its own to `with_values`.

    Raises
    ------
    ToolpointError
        For a body without a joint, a joint to a body that is not there, two tree joints on one child, or a circle of
        parents; the message names the part.

    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7})
    >>> build(MachineDescription("slide", {"table": table}, {"guide": guide})).name
    'slide'
    """
    reduced = {name: within(f"bodies.{name}", partial(_reduced, (kept or {}).get(name)), body)
               for name, body in description.bodies.items()
               if body.is_elastic and body.matrices is None and name not in (bodies or {})}
    replaced_bodies = {name: part.body for name, part in reduced.items()} | {
        name: within(f"bodies.{name}", _imported, body) for name, body in description.bodies.items()
        if body.matrices is not None and name not in (bodies or {})} | dict(bodies or {})
    order = tree_order(description)
    links = {description.joints[name].child: i for i, name in enumerate(order)} | {GROUND: -1}
    tree = [description.joints[name] for name in order]
    names = tuple(joint.child for joint in tree)
    laws = laws_of(description)
    chain = build_chain(description, order, laws)
    loops = tuple(
        LoopJoint(name, links[j.parent], links[j.child], frame(j.frame), laws[name], j.parent_interface, j.child_interface,
                  tuple(DIRECTIONS.index(way) for way in large_freedoms(j)))
        for name, j in description.joints.items() if j.closes_loop)
    result = Machine(
        description, chain, names,
        tuple(replaced_bodies[n] if n in replaced_bodies
              else Body.rigid(within(f"bodies.{n}", mass_properties, description.bodies[n]))
              for n in names),
        np.array([frame(description.bodies[n].frame) for n in names]).reshape(-1, 4, 4),
        tuple(order), tuple(laws[name] for name in order),
        tuple(j.elastic_at == "child" for j in tree),
        tuple((j.parent_interface, j.child_interface) for j in tree), loops,
        partial(build, bodies=bodies, kept=reduced), reduced)
    _check_interfaces(result)
    return result


def _check_interfaces(machine: Machine) -> None:
    """Refuse joints and points that hold on to an elastic body elsewhere than at an interface: motion there is not known."""
    description = machine.description
    holds = [(f"joints.{name}.{side}_interface", getattr(joint, side), getattr(joint, f"{side}_interface"), True)
             for name, joint in description.joints.items() for side in ("parent", "child")]
    holds += [(f"points.{name}.interface", point.body, point.interface, False) for name, point in description.points.items()]
    for path, name, interface, may_slide in holds:
        body = machine.bodies[machine.body_names.index(name)] if name in machine.body_names else None
        if body is None or not body.modal_count:
            continue
        usable_interfaces = [key for key, place in body.interfaces.items() if may_slide or place.slide is None]
        if interface not in usable_interfaces:
            moving = "" if may_slide or interface not in body.interfaces else "slides, and can be held by a joint only; "
            fail(path, "none" if interface is None else repr(interface),
                 f"{moving}must be of the interfaces of the elastic body {name}: {', '.join(usable_interfaces) or 'none'}",
                 remedy=suggestion(str(interface), usable_interfaces) if interface else "")


def _reduced(kept_body: KeptBody | None, body: BodyDescription) -> KeptBody:
    """Return the reduced body: of the same shapes where only modulus, density or loss factors differ from those before."""
    part = body.elastic or body.solid or body.beam
    assert part is not None
    check_sources(body)
    if kept_body is not None and kept_body.text == part.frozen_text:
        return KeptBody(part, kept_body.text, kept_body.reduced, kept_body.basis)
    mass_properties(body)  # its faults first: they are cheap to find
    if isinstance(part, BeamDescription):
        from toolpoint.machine.parts.beam_body import beam_basis

        basis = within("beam", beam_basis, part)
        return KeptBody(part, part.frozen_text, basis.reduced, basis)
    from toolpoint.machine.parts.body_store import reduce_once  # finite elements load where a body has them

    kind = "elastic" if part is body.elastic else "solid"
    return KeptBody(part, part.frozen_text, within(kind, reduce_once, part))


def _imported(body: BodyDescription) -> Body:
    mass_properties(body)
    from toolpoint.machine.parts.imported_body import build_matrices

    assert body.matrices is not None
    return within("matrices", build_matrices, body.matrices)


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
