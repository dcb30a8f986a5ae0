"""ClampedPart: the work of a program by finite elements, held at named faces; in the coordinates of the program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, positive, suggestion, within
from toolpoint._doubt import Doubt
from toolpoint.bodies.solid import Casting, SolidModel
from toolpoint.bodies.solid.cut_solid import SpringHold
from toolpoint.bodies.solid.region import SolidPlace
from toolpoint.joints.linear import DIRECTIONS
from toolpoint.machine.description import JointDescription, MachineDescription
from toolpoint.machine.description.body import MACHINE_FRAME
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody
from toolpoint.spatial.rotation import from_euler, skew

DEFAULT_STAGE_CHANGE = 0.05  # relative change of a natural frequency from one stage to the next
COARSE_MESH_RATIO = 1.5  # of the mesh beside which a casting's own is judged
_MAX_COARSE_SHARE = 0.8  # of a part's elements, that a coarser mesh may have: with more it tells nothing
_MAX_FINE_ELEMENTS = 20_000  # of a finer mesh
_CHANGE_RANGE = (0.002, 0.5)


@dataclass(frozen=True, eq=False)
class ClampSpring:
    """Clamp that yields: a face whose mean motion works against a stiffness.

    place : on the model; stiffness : (6, 6), N/m, N and N m, of displacements and turns along the program's axes about
    `centre` (3,), m; loss_factor.
    """

    place: SolidPlace
    stiffness: FloatArray
    centre: tuple[float, float, float]
    loss_factor: float = 0.0

    def on(self, model: SolidModel) -> SpringHold:
        """Return the springs on a mesh of the part: the twist of the face's centre is carried to that of the clamp."""
        carry = np.eye(6)
        arm = np.asarray(self.centre) - self.place.centre_on(model)
        carry[:3, 3:] = -skew(arm)  # v + w x arm
        return SpringHold(self.place.averages(model), carry.T @ self.stiffness @ carry, self.loss_factor)


@dataclass(frozen=True, eq=False)
class ClampedPart:
    """Part by finite elements, held at faces.

    Parameters
    ----------
    model : SolidModel
        In the coordinates of the program, m.
    held : sequence of places on it
        Their nodes do not move.
    damping_ratio : float
        Of all modes; from the materials' loss factors where 0.
    stage_change : float
        Relative change of one of the lowest natural frequencies at which a new stage begins.
    compared : SolidModel, optional
        The same part in a coarser mesh (`COARSE_MESH_RATIO`), or a finer one where no coarser one differs: what the mesh
        errs by is estimated from it.
    name : str
    doubts : sequence of Doubt
        Of its file: what of it is not taken.
    springs : sequence of ClampSpring
        Faces that are held by springs, beside those that do not move.

    Raises
    ------
    ToolpointError
        For no damping at all, a change beyond 0.2 to 50 %, places that are not on the model.

    Examples
    --------
    >>> from toolpoint.bodies.solid import Casting, Cuboid, Material, PlaneFaces
    >>> wall = Casting([Cuboid((0, 0, 0), (0.06, 0.004, 0.04))], {"body": Material(70e9, 0.33, 2700.0, 0.01)}).meshed(5e-3)
    >>> ClampedPart(wall, (PlaneFaces((0, 0, 0), (0, 0, 1)),)).held_nodes.size
    63
    """

    model: SolidModel
    held: tuple[SolidPlace, ...]
    damping_ratio: float = 0.0
    stage_change: float = DEFAULT_STAGE_CHANGE
    compared: SolidModel | None = None
    name: str = "the part"
    doubts: tuple[Doubt, ...] = ()
    springs: tuple[ClampSpring, ...] = ()

    def __post_init__(self) -> None:
        if self.damping_ratio:
            positive("damping_ratio", self.damping_ratio, 0.5)
        elif not any(material.loss_factor > 0 for material in self.model.materials.values()):
            fail("part", "no damping", "its response would be infinite at every resonance",
                 remedy="give loss_factor to its material, or a damping ratio of the clamped part")
        if not _CHANGE_RANGE[0] <= self.stage_change <= _CHANGE_RANGE[1]:
            fail("stage_change", f"{self.stage_change:g}", f"must be from {_CHANGE_RANGE[0]:g} to {_CHANGE_RANGE[1]:g}")
        if not self.held and not self.springs:
            fail("held", "none", "must name a face at least that is clamped")

    @property
    def held_nodes(self) -> IndexArray:
        """Numbers of the nodes that do not move."""
        return self.nodes_of(self.model)

    def nodes_of(self, model: SolidModel) -> IndexArray:
        """Return the numbers of the held nodes in a mesh of the part."""
        nodes = [piece.nodes for place in self.held for piece in place.pieces(model)]
        return np.unique(np.concatenate([np.zeros(0, np.int64), *nodes]))

    def springs_on(self, model: SolidModel) -> list[SpringHold]:
        """Return the springs of the clamps on a mesh of the part."""
        return [spring.on(model) for spring in self.springs]


def describe_part(description: MachineDescription, held: Sequence[str], *, damping_ratio: float = 0.0,
                  stage_change: float = DEFAULT_STAGE_CHANGE) -> ClampedPart:
    """Return the clamped part that a machine file describes: its one body with finite elements.

    Parameters
    ----------
    description : MachineDescription
        As `io.read_description` gives it; the machine frame is the frame of the program.
    held : sequence of str
        Names of interfaces of the body at which it is clamped.
    damping_ratio, stage_change : see `ClampedPart`

    Raises
    ------
    ToolpointError
        For several bodies with finite elements, or none; for interfaces that the body does not have.

    Examples
    --------
    >>> from toolpoint.machine.description import BodyDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.elastic import CastingBox, PatchDescription, PlaneDescription
    >>> foot = PatchDescription(plane=PlaneDescription((0, 0, 0), (0, 0, 1)))
    >>> wall = ElasticDescription((CastingBox((0, 0, 0), (0.06, 0.004, 0.04)),), {"foot": foot}, 1e4, 5e-3)
    >>> clamp = {"clamp": JointDescription("ground", "wall")}
    >>> file = MachineDescription("wall", {"wall": BodyDescription(elastic=wall)}, clamp)
    >>> describe_part(file, ["foot"]).model.element_count
    96
    """
    bodies = {name: body for name, body in description.bodies.items() if body.elastic is not None or body.solid is not None}
    if len(bodies) != 1:
        fail("part", f"{description.name}: bodies with finite elements: {', '.join(bodies) or 'none'}",
             "must be one, with the key elastic or solid", remedy="the work stands in a file of its own")
    name, body = next(iter(bodies.items()))
    if body.frame != MACHINE_FRAME:
        fail("part", f"{name}: has a frame of its own", "must stand in the coordinates of the program",
             remedy="leave `frame` out, and give its boxes or its mesh where the program cuts it")
    described: ElasticDescription | SolidBody | None = body.elastic if body.elastic is not None else body.solid
    assert described is not None
    places, springs = list[SolidPlace](), list[ClampSpring]()
    joints = {joint.child_interface: (key, joint) for key, joint in description.joints.items()
              if joint.child == name and joint.stiffness}
    for each in held:
        if each not in described.interfaces:
            fail("held", repr(each), f"must be an interface of {name}: {', '.join(described.interfaces) or 'it has none'}",
                 remedy=suggestion(each, list(described.interfaces)))
        place = within(f"interfaces.{each}", lambda part: part.place, described.interfaces[each])
        if each in joints:
            springs.append(_spring(place, *joints[each]))
        else:
            places.append(place)
    model, compared = described.model, None
    if isinstance(described, ElasticDescription) and isinstance(described.casting, Casting):
        compared = _compared_mesh(described.casting, described.mesh_size, model.element_count)
    unused = [key for key, joint in description.joints.items()
              if name in (joint.parent, joint.child) and joint.stiffness
              and (joint.child != name or joint.child_interface not in held)]
    doubts = [Doubt("clamping of the work", f"the springs of {', '.join(unused)} are left out: they are at no face of `held`",
                    "name the interface that they hold")] if unused else []
    return ClampedPart(model, tuple(places), damping_ratio, stage_change, compared, description.name, tuple(doubts),
                       tuple(springs))


def _compared_mesh(casting: Casting, size: float, count: int) -> SolidModel | None:
    """Return a casting in a mesh beside which one of `size` (m) and `count` elements is judged; None where all are alike."""
    coarse = casting.meshed(COARSE_MESH_RATIO * size)
    if coarse.element_count <= _MAX_COARSE_SHARE * count:
        return coarse
    # Boxes of one element are meshed alike: a finer mesh tells what one element lacks.
    fine = casting.meshed(size / COARSE_MESH_RATIO)
    return fine if _MAX_COARSE_SHARE * fine.element_count >= count and fine.element_count <= _MAX_FINE_ELEMENTS else None


def _spring(place: SolidPlace, key: str, joint: JointDescription) -> ClampSpring:
    """Return the springs of a joint at a face: all six directions must have a stiffness, as none is locked there."""
    rigid = [way for way in DIRECTIONS if way not in joint.stiffness]
    if rigid:
        fail("held", f"{key}: stiffness without {', '.join(rigid)}", "must have all six directions: a face on springs is "
             "locked in none", remedy="give them, or leave stiffness out for a face that does not move")
    turn = np.kron(np.eye(2), from_euler("zyx", joint.frame.rotation))
    stiffness = turn @ np.diag([joint.stiffness[way] for way in DIRECTIONS]) @ turn.T
    factors = joint.loss_factor if isinstance(joint.loss_factor, float | int) else max(joint.loss_factor.values(), default=0.0)
    return ClampSpring(place, stiffness, joint.frame.at, float(factors))
