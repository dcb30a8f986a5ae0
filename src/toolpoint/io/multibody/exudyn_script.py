"""A Python script for Exudyn: a machine at a pose as a kinematic tree on springs, with its natural frequencies; write."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.io.multibody.links import TreeLink, tree_links
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine

_TYPES = ("PrismaticX", "PrismaticY", "PrismaticZ", "RevoluteX", "RevoluteY", "RevoluteZ")
_HEAD = '''"""{name} at a pose, written for Exudyn: a kinematic tree whose joints are springs. SI units, no gravity."""

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np

array = np.array
links = [  # joint type, parent, rotation and place in the parent's frame, mass, centre, inertia about it, stiffness, damping
'''
_TAIL = ''']
kinds, parents, rotations, places, masses, centres, inertias, stiffness, damping = zip(*links)
system = exu.SystemContainer()
mbs = system.AddSystem()
node = mbs.AddNode(eii.NodeGenericODE2(referenceCoordinates=[0.0] * len(links), initialCoordinates=[0.0] * len(links),
                                       initialCoordinates_t=[0.0] * len(links), numberOfODE2Coordinates=len(links)))
mbs.AddObject(eii.ObjectKinematicTree(
    nodeNumber=node, jointTypes=[getattr(exu.JointType, kind) for kind in kinds], linkParents=list(parents),
    jointTransformations=exu.Matrix3DList([array(r) for r in rotations]),
    jointOffsets=exu.Vector3DList([array(p) for p in places]),
    linkInertiasCOM=exu.Matrix3DList([array(i) for i in inertias]),
    linkCOMs=exu.Vector3DList([array(c) for c in centres]),
    linkMasses=list(masses), baseOffset=[0.0, 0.0, 0.0], gravity=[0.0, 0.0, 0.0], jointPControlVector=list(stiffness),
    jointDControlVector=list(damping),
    jointPositionOffsetVector=[0.0] * len(links), jointVelocityOffsetVector=[0.0] * len(links)))
mbs.Assemble()
values, _ = mbs.ComputeODE2Eigenvalues()
frequencies = np.sqrt(np.maximum(values, 0)) / (2 * np.pi)

if __name__ == "__main__":
    print(" ".join(f"{f:.6f}" for f in frequencies))
'''


def write(machine: Machine, path: str | Path, pose: Pose | None = None) -> None:
    """Write a script of a machine at a pose; running it prints the natural frequencies, Hz. Errors are those of `tree_links`.

    A body on several springs is a row of links without mass but the last; bodies that are fixed are added to what carries them.
    """
    rows: list[str] = []
    ends: list[int] = []  # of every body, the row that carries it (-1: the ground)
    frames: list[FloatArray] = []  # and its place in that row's frame
    bodies: dict[int, list[tuple[TreeLink, FloatArray]]] = {}
    for link in tree_links(machine, pose):
        parent = -1 if link.parent < 0 else ends[link.parent]
        place = link.place if link.parent < 0 else frames[link.parent] @ link.place
        for number, way in enumerate(link.ways):
            # The child's frame is turned against the parent's: Exudyn's transformation takes child coordinates to the parent.
            turned, offset = (place[:3, :3], place[:3, 3]) if number == 0 else (np.eye(3), np.zeros(3))
            rows.append(f"    ({_TYPES[way]!r}, {parent}, {_text(turned)}, {_text(offset)}, %s, {link.stiffness[number]!r}, "
                        f"{link.damping[number]!r}),\n")
            parent, place = len(rows) - 1, np.eye(4)
        ends.append(parent)
        frames.append(place)
        bodies.setdefault(parent, []).append((link, place))
    filled = [row % _inertia(bodies.get(k, [])) for k, row in enumerate(rows)]
    Path(path).write_text(_HEAD.format(name=machine.name) + "".join(filled) + _TAIL, encoding="utf-8")


def _inertia(parts: list[tuple[TreeLink, FloatArray]]) -> str:
    from toolpoint.bodies.inertia import combine

    if not parts:
        return "0.0, [0.0, 0.0, 0.0], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]"
    combined = combine(*(link.properties.moved(place) for link, place in parts))
    return f"{combined.mass!r}, {_text(combined.centre)}, {_text(combined.inertia)}"


def _text(values: FloatArray) -> str:
    return repr(np.asarray(values, float).tolist())
