"""Machine: the parts of a machine, ready to be placed at any pose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray, fail, suggestion
from toolpoint._notebook import NotebookText
from toolpoint.bodies import Body
from toolpoint.bodies.reduced import ReducedBody
from toolpoint.joints import LinearJoint
from toolpoint.kinematics import TreeChain
from toolpoint.machine.description.beam import BeamDescription
from toolpoint.machine.description.elastic import ElasticDescription, SolidBody
from toolpoint.machine.description.machine import GROUND, MachineDescription

if TYPE_CHECKING:  # beams load where a body is one
    from toolpoint.machine.parts.beam_body import BeamBasis


@dataclass(frozen=True, eq=False)
class LoopJoint:
    """A joint that closes a loop: links it joins (-1 is the ground), frame at the reference pose, law, interfaces.

    free : directions that give way at large, in their order.
    """

    name: str
    parent: int
    child: int
    frame: FloatArray
    law: LinearJoint
    parent_interface: str | None
    child_interface: str | None
    free: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class KeptBody:
    """A described body reduced in parts that scale, as `build` keeps it.

    part : its description as it stands; text : of everything but the numbers that scale; reduced : of the numbers that it was
    reduced for; basis : of a beam, its elements and shapes.
    """

    part: ElasticDescription | SolidBody | BeamDescription
    text: str
    reduced: ReducedBody
    basis: BeamBasis | None = None

    @property
    def body(self) -> Body:
        """The body with its numbers as they stand."""
        return self.reduced.at(self.part.numbers)


@dataclass(frozen=True, eq=False)
class Machine(NotebookText):
    """Bodies on a tree of joints, loop joints, axes and points; made by `build.build` from a description.

    Link i is body i of the tree order; it hangs by tree joint i. Minimal coordinates, in this order for every link:
    the unlocked directions of its joint, then its body's modal coordinates.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7, "z": 2e8})
    >>> machine = build(MachineDescription("slide", {"table": table}, {"guide": guide}))
    >>> machine.size, machine.body_names  # two directions have springs, four are locked
    (2, ('table',))
    """

    description: MachineDescription
    chain: TreeChain
    body_names: tuple[str, ...]
    bodies: tuple[Body, ...]
    body_frames: FloatArray
    joint_names: tuple[str, ...]
    joints: tuple[LinearJoint, ...]
    elastic_at_child: tuple[bool, ...]
    interfaces: tuple[tuple[str | None, str | None], ...]
    loops: tuple[LoopJoint, ...]
    rebuild: Callable[..., Machine]
    reduced: Mapping[str, KeptBody] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The machine's name."""
        return self.description.name

    @property
    def joint_columns(self) -> tuple[range, ...]:
        """Coordinates of every tree joint."""
        return self._columns[0]

    @property
    def modal_columns(self) -> tuple[range, ...]:
        """Modal coordinates of every body."""
        return self._columns[1]

    @cached_property
    def size(self) -> int:
        """Number of minimal coordinates of the tree (before loops are closed)."""
        return sum(len(j.freedoms) for j in self.joints) + sum(b.modal_count for b in self.bodies)

    @cached_property
    def _columns(self) -> tuple[tuple[range, ...], tuple[range, ...]]:
        joint, modal, offset = [], [], 0
        for law, body in zip(self.joints, self.bodies, strict=True):
            joint.append(range(offset, offset + len(law.freedoms)))
            offset += len(law.freedoms)
            modal.append(range(offset, offset + body.modal_count))
            offset += body.modal_count
        return tuple(joint), tuple(modal)

    @property
    def groups(self) -> np.ndarray:
        """Group of every coordinate along its path, nearer to the ground first; those of one joint or body share a number."""
        result = np.zeros(self.size, int)
        for i, (joint, modal) in enumerate(zip(*self._columns, strict=True)):
            result[list(joint)] = 8 * i
            result[list(modal)] = 8 * i + 7
            # Two passive rotations of a joint turn about one axis, then about another that the first has moved.
            for number, way in enumerate(self.passive_turns[i]):
                result[joint[self.joints[i].freedoms.index(way)]] = 8 * i + number + 1
        return result

    @cached_property
    def passive_turns(self) -> tuple[tuple[int, ...], ...]:
        """Passive rotations (3 .. 5) of every tree joint in their order, where they are two; else none."""
        result = []
        for i, law in enumerate(self.joints):
            turns = tuple(step.way for step in self.chain.passive if step.joint == i and step.turns)
            result.append(turns if len(turns) == 2 and set(turns) <= set(law.freedoms) else ())
        return tuple(result)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Name of every coordinate, e.g. ``foundation.rx``."""
        names: list[str] = []
        directions = ("x", "y", "z", "rx", "ry", "rz")
        for i, law in enumerate(self.joints):
            words = directions if law.is_of_directions else [f"s{d + 1}" for d in range(6)]
            names += [f"{self.joint_names[i]}.{words[d]}" for d in law.freedoms]
            names += [f"{self.body_names[i]}.mode{k + 1}" for k in range(self.bodies[i].modal_count)]
        return tuple(names)

    def link(self, body: str) -> int:
        """Return the link of a body, -1 for the ground."""
        if body == GROUND:
            return -1
        if body not in self.body_names:
            fail("body", f"no {body!r}", f"must be of {', '.join(self.body_names)}", remedy=suggestion(body, self.body_names))
        return self.body_names.index(body)

    def with_values(self, values: Mapping[str, float]) -> Machine:
        """Return the machine with parameters changed, by path, e.g. ``{"joints.foundation.stiffness.rx": 9e8}``."""
        return self.rebuild(self.description.with_values(values))

    def value(self, path: str) -> float:
        """Return one parameter by path, SI."""
        return self.description.value(path)

    def __repr__(self) -> str:
        loops = f", {len(self.loops)} loop joints" if self.loops else ""
        axes = ", ".join(axis.name for axis in self.chain.axes) or "none"
        return (f"Machine({self.name!r}, {len(self.bodies)} bodies, {len(self.joints)} joints{loops}, "
                f"{self.size} coordinates, axes {axes}, points {', '.join(self.description.points) or 'none'})")
