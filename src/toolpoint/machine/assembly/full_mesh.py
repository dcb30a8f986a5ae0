"""A machine at a pose with all elements of its meshed bodies, joined as the reduced one is, so that the two can be compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail, within
from toolpoint.bodies import Body
from toolpoint.bodies.solid import NamedNodes, SolidModel
from toolpoint.kinematics import Pose, Step
from toolpoint.machine.assembly import preload
from toolpoint.machine.assembly.gyroscopics import fastest_spin
from toolpoint.machine.assembly.joint_terms import joint_travel, loop_directions, loop_frame
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import HELD_INTERFACE, ElasticDescription, SolidBody
from toolpoint.machine.parts.elastic_body import SlidingPatch, place_of
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.spatial import transform as tf
from toolpoint.substructuring.linked_bodies import FreeBody, LinkedBodies

_MIN_SPRING_RATIO = 1e-14  # of the largest of a joint: below, a combination of its directions is free


@dataclass(frozen=True, eq=False)
class MeshedBody:
    """A meshed body of a machine at a pose: its model, its frame (4, 4), and its rows among all coordinates."""

    model: SolidModel
    frame: FloatArray
    rows: slice
    held: csc_array | None = None

    def shapes(self, vectors: FloatArray) -> FloatArray:
        """Return the motion of the mesh (model.size, k), in the body's axes, of vectors over all coordinates (size, k)."""
        part = vectors[self.rows]
        return part if self.held is None else np.asarray(self.held @ part)


@dataclass(frozen=True, eq=False)
class FullMeshes:
    """A machine with all elements: bodies and joints as links, and its meshed bodies by name."""

    linked: LinkedBodies
    meshed: Mapping[str, MeshedBody]


def link_full_meshes(machine: Machine, pose: Pose | None = None) -> FullMeshes:
    """Return the bodies at a pose (m, rad) and their joints as links; castings and solids with all coordinates of meshes.

    Bodies that are rigid, beams or imported matrices have the coordinates that `assemble` gives them.

    Raises ToolpointError for a machine without meshes, and for what a full mesh does not carry: bodies that spin, and the
    geometric stiffness of gravity and loads.
    """
    _check_carried(machine)
    place = place_machine(machine, pose)
    if place.poses != 1:
        fail("pose", f"{place.poses} poses", "must be one")
    if np.any(preload.geometric_stiffness(place)):
        fail("gravity, loads", "given", "are not carried by full meshes: their preload changes the stiffness",
             remedy="leave both out of a copy of the file: reduced and full are then compared without them")
    parts = {name: within(f"bodies.{name}", partial(_part, machine), i) for i, name in enumerate(machine.body_names)}
    links = [*(_tree_link(place, parts, i) for i in range(len(machine.joints))), *_loop_links(place, parts)]
    compliance = np.concatenate([link.compliance for link in links])
    bodies, meshed, start = {}, {}, 0
    for i, (name, part) in enumerate(parts.items()):
        columns = [link.columns(i, part.size) for link in links]
        bodies[name] = FreeBody(part.stiffness, part.mass, csc_array(np.hstack(columns)), part.coordinates)
        if part.model is not None:
            meshed[name] = MeshedBody(part.model, place.frames[0, i], slice(start, start + part.size), part.held)
        start += part.size
    return FullMeshes(LinkedBodies(bodies, compliance), meshed)


def _check_carried(machine: Machine) -> None:
    """Refuse machines without a mesh, and those whose bodies spin."""
    if not any(isinstance(kept.part, ElasticDescription | SolidBody) for kept in machine.reduced.values()):
        fail("machine", "no body with a mesh", "must have a casting (elastic) or a solid",
             remedy="its modes already have all coordinates")
    if fastest_spin(machine.description):
        fail("spin", "given", "is not carried by full meshes", remedy="compare at standstill: leave spin out of a copy")


@dataclass(frozen=True, eq=False)
class _Part:
    """A body's matrices over its own coordinates, in its own axes.

    model, places : of a mesh; held : (size of the mesh, size), where nodes are held as one rigid piece. body : of any other.
    """

    stiffness: csc_array
    mass: csc_array
    coordinates: FloatArray | None
    body: Body | None = None
    model: SolidModel | None = None
    description: ElasticDescription | SolidBody | None = None
    held: csc_array | None = None

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.mass.shape[0])

    def motion(self, interface: str | None, local: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where an interface is (3,), m, and its twist about that place per coordinate (6, size), in the body's axes.

        local : (3,), place of the joint in the body's frame, to which a sliding interface moves.
        """
        if self.body is not None:
            return _motion_of_body(self.body, interface, local)
        assert self.model is not None and self.description is not None
        if self.held is not None and interface == HELD_INTERFACE:
            twist = np.zeros((6, self.size))
            twist[:, -6:] = np.eye(6)
            return NamedNodes(_held_name(self.description)).centre_on(self.model), twist
        place = place_of(self.description.interfaces[str(interface)])
        if isinstance(place, SlidingPatch):
            along = np.asarray(place.along) / np.linalg.norm(place.along)
            travel = float((local - place.patch.centre) @ along)
            position, weights = place.patch.centre + travel * along, place.weights(self.model, travel)
        else:
            position, weights = np.asarray(place.centre_on(self.model)), place.averages(self.model)
        weights = weights if self.held is None else self.held.T @ weights
        return position, np.asarray(weights.T.toarray())


def _motion_of_body(body: Body, interface: str | None, local: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return place and motion of an interface of a rigid or reduced body; of its frame where there is none."""
    if body.modal_count == 0 or interface is None:
        return np.zeros(3), np.hstack([np.eye(6), np.zeros((6, body.modal_count))])
    part = body.interfaces[interface]
    if part.slide is not None:
        positions, motions = part.slid_to(local[None])
        return _with_frame(positions[0], motions[0])
    return _with_frame(part.position, body.participation(interface))


def _with_frame(position: FloatArray, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a place with its motion per twist of the body's frame and per modal coordinate, (6, 6 + m)."""
    return position, np.hstack([tf.adjoint(tf.inverse(tf.transform(None, position))), motion])


def _held_name(description: ElasticDescription | SolidBody) -> str:
    return description.held if isinstance(description, SolidBody) else ""


def _part(machine: Machine, link: int) -> _Part:
    """Return a body with all its coordinates."""
    body = machine.bodies[link]
    kept = machine.reduced.get(machine.body_names[link])
    if kept is None or isinstance(kept.part, BeamDescription):
        stiffness = np.zeros_like(body.mass)
        stiffness[6:, 6:] = body.stiffness
        return _Part(csc_array(stiffness), csc_array(body.mass), None, body=body)
    model = kept.part.model
    stiffness, mass = model.assembled()
    if not _held_name(kept.part):
        return _Part(stiffness, mass, model.dof_places, model=model, description=kept.part)
    nodes = NamedNodes(_held_name(kept.part))
    held = _carried(model, np.unique(nodes.nodes(model)), nodes.centre_on(model))
    places = np.vstack([model.dof_places[model.free_coordinates(np.unique(nodes.nodes(model)))],
                        np.broadcast_to(nodes.centre_on(model), (6, 3))])
    return _Part(csc_array(held.T @ stiffness @ held), csc_array(held.T @ mass @ held), places, model=model,
                 description=kept.part, held=held)


def _carried(model: SolidModel, nodes: np.ndarray, centre: FloatArray) -> csc_array:
    """Return the motion of all coordinates of a mesh per free coordinate and per twist of its held nodes about a centre."""
    free, rigid = model.free_coordinates(nodes), model.rigid_motion(tuple(centre))
    fixed = np.setdiff1d(np.arange(model.size), free)
    rows, columns = np.nonzero(rigid[fixed])
    return csc_array((np.concatenate([np.ones(len(free)), rigid[fixed][rows, columns]]),
                      (np.concatenate([free, fixed[rows]]), np.concatenate([np.arange(len(free)), len(free) + columns]))),
                     shape=(model.size, len(free) + 6))


@dataclass(frozen=True, eq=False)
class _Link:
    """Relative motion in a joint: rows (m, size) of each of its bodies by their number, and compliance (m,)."""

    rows: Mapping[int, FloatArray]
    compliance: FloatArray

    def columns(self, body: int, size: int) -> FloatArray:
        """Return the part of a body, (size, m)."""
        return self.rows[body].T if body in self.rows else np.zeros((size, len(self.compliance)))

    @classmethod
    def of_law(cls, motions: Mapping[int, FloatArray], *, directions: FloatArray, stiffness: FloatArray,
               locked: list[int]) -> _Link:
        """Return a joint whose motion is `directions` (6, 6) times its coordinates, locked ones and others on springs."""
        values, vectors = np.linalg.eigh(stiffness)
        springs = np.flatnonzero(values > _MIN_SPRING_RATIO * max(values.max(), 1e-300))
        mixing = np.vstack([np.eye(6)[locked], vectors[:, springs].T]) @ np.linalg.inv(directions)
        return cls({body: mixing @ motion for body, motion in motions.items()},
                   np.concatenate([np.zeros(len(locked)), 1 / values[springs]]))


def _relative(place: Placement, parts: Mapping[str, _Part], frame: FloatArray, *,
              ends: tuple[tuple[int, str | None, float], ...]) -> dict[int, FloatArray]:
    """Return the motion of child less parent in a joint's frame (4, 4), of each body per coordinate, (6, size).

    ends : link, interface and sign of both sides; the ground (-1) does not move.
    """
    names, to_frame = place.machine.body_names, tf.adjoint(tf.inverse(frame))
    result: dict[int, FloatArray] = {}
    for link, interface, sign in ends:
        if link < 0:
            continue
        body_frame = place.frames[0, link]
        position, motion = parts[names[link]].motion(interface, tf.move(tf.inverse(body_frame), frame[None, :3, 3])[0])
        result[link] = sign * to_frame @ tf.adjoint(body_frame @ tf.transform(None, position)) @ motion
    return result


def _tree_link(place: Placement, parts: Mapping[str, _Part], joint: int) -> _Link:
    """Return a joint of the tree."""
    machine = place.machine
    law, frame, (above, below) = machine.joints[joint], place.joint_frames[0, joint], machine.interfaces[joint]
    motions = _relative(place, parts, frame, ends=((joint, below, 1.0), (machine.chain.parents[joint], above, -1.0)))
    directions, stiffness = _complete(law.twists), law.stiffness.copy()
    if machine.passive_turns[joint]:
        twists = tf.adjoint(tf.inverse(frame)) @ machine.chain.twists_of(place.values, place.displacements)[0]
        for way in machine.passive_turns[joint]:
            directions[:, way] = twists[:, machine.chain.steps.index(Step(joint, way))]
    if law.travel is not None:
        stiffness[law.travel.way, law.travel.way] += law.travel.gain(joint_travel(place, joint))[0]
    return _Link.of_law(motions, directions=directions, stiffness=stiffness,
                        locked=[way for way in range(6) if law.states[way] == "locked"])


def _complete(twists: FloatArray) -> FloatArray:
    """Return twists (6, 6) with motions independent of a joint's screws in the columns of zeros behind these."""
    count = int((np.abs(twists).sum(axis=0) > 0).sum())
    if count == 6:
        return twists.copy()
    complement = np.linalg.svd(twists[:, :count])[0][:, count:]
    return np.hstack([twists[:, :count], complement])


def _loop_links(place: Placement, parts: Mapping[str, _Part]) -> list[_Link]:
    """Return the joints that close loops."""
    result = []
    for loop in place.machine.loops:
        frame, directions = loop_frame(place, loop)[0], loop_directions(place, loop)
        ends = ((loop.child, loop.child_interface, 1.0), (loop.parent, loop.parent_interface, -1.0))
        result.append(_Link.of_law(
            _relative(place, parts, frame, ends=ends), directions=np.eye(6) if directions is None else directions[0],
            stiffness=loop.law.stiffness, locked=[way for way in range(6) if loop.law.states[way] == "locked"]))
    return result
