"""The links and joints of a URDF file as it says them, checked to form a tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.io.meshes import stl
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf

# Robots are some hundred kilobytes: a larger file is a mesh, and an XML parser takes ten times its size.
MAX_ROBOT_FILE_BYTES = 20_000_000
DIRECTION_OF_KIND = {"revolute": "rz", "continuous": "rz", "prismatic": "z"}


@dataclass(frozen=True, eq=False)
class UrdfLink:
    """A link: mass (kg, None without), centre (m), inertia about it in the link's axes, corners of its shapes (n, 3)."""

    name: str
    mass: float | None
    centre: FloatArray
    inertia: FloatArray
    corners: FloatArray


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint: kind, parent, child, place (4, 4) in the parent link, axis, limits, the joint it mimics and the factor."""

    name: str
    kind: str
    parent: str
    child: str
    place: FloatArray
    axis: FloatArray
    limits: tuple[float, float]
    mimics: tuple[str, float] | None


@dataclass(frozen=True, eq=False)
class UrdfRobot:
    """Content of a file: links and joints by name, the root link, and faults of its inertias (`doubts`)."""

    name: str
    links: Mapping[str, UrdfLink]
    joints: Mapping[str, UrdfJoint]
    root: str
    doubts: tuple[Doubt, ...] = field(default=())

    @property
    def mass(self) -> float:
        """Total mass, kg, the root's too."""
        return sum(link.mass or 0.0 for link in self.links.values())


def parse_robot(file: Path) -> UrdfRobot:
    """Return what a file says; raises ToolpointError for faults of its XML and of how links hang together."""
    root = _parsed(file)
    links = {link.name: link for link in (_link(part, file) for part in root.findall("link"))}
    joints = {joint.name: joint for joint in (_joint(part, file) for part in root.findall("joint"))}
    if not links:
        fail(str(file), "no links", "must have at least one")
    start = _root(links, joints, file)
    for joint in joints.values():
        if joint.kind in DIRECTION_OF_KIND and links[joint.child].mass is None:
            fail(f"{file}: link {joint.child}", "no inertia", "a link that moves needs mass and inertia",
                 remedy="add <inertial>, or fix the joint")
    return UrdfRobot(root.get("name", file.stem), links, joints, start)


def _parsed(file: Path) -> ElementTree.Element:
    try:
        raw = file.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{file}: cannot be read ({error.strerror}); check the name and the folder") from None
    if len(raw) > MAX_ROBOT_FILE_BYTES:
        fail(str(file), f"{len(raw)} bytes", f"must be at most {MAX_ROBOT_FILE_BYTES}")
    if b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
        fail(str(file), "a document type with entities", "must be plain XML", remedy="remove the DOCTYPE")
    try:
        root = ElementTree.fromstring(raw)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise ToolpointError(f"{file}:{line}:{column + 1}: no valid XML ({error}); expand xacro files first") from None
    if root.tag != "robot":
        fail(str(file), f"element <{root.tag}>", "must be <robot>", remedy="is it a URDF file?")
    return root


def _numbers(part: ElementTree.Element | None, name: str, count: int, where: str, *, default: str = "") -> FloatArray:
    text = default if part is None else part.get(name, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if values.size != count or not np.isfinite(values).all():
        fail(where, f"{name}={text!r}", f"must be {count} finite numbers")
    return values


def _place(part: ElementTree.Element | None, where: str) -> FloatArray:
    roll, pitch, yaw = _numbers(part, "rpy", 3, where, default="0 0 0")
    return tf.transform(rotation.from_euler("zyx", [yaw, pitch, roll]), _numbers(part, "xyz", 3, where, default="0 0 0"))


def _link(part: ElementTree.Element, file: Path) -> UrdfLink:
    name = part.get("name") or ""
    where = f"{file}: link {name!r}"
    inertial = part.find("inertial")
    corners = _corners(part, file, where)
    if inertial is None:
        return UrdfLink(name, None, np.zeros(3), np.zeros((3, 3)), corners)
    place, tensor = _place(inertial.find("origin"), where), inertial.find("inertia")
    mass = float(_numbers(inertial.find("mass"), "value", 1, where)[0])
    if tensor is None or inertial.find("mass") is None:
        fail(where, "an <inertial> without mass or inertia", "must have both")
    xx, yy, zz, xy, xz, yz = (float(_numbers(tensor, f"i{way}", 1, where, default="0" if way[0] != way[1] else "")[0])
                              for way in ("xx", "yy", "zz", "xy", "xz", "yz"))
    r = place[:3, :3]
    inertia = r @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ r.T
    if mass <= 0:
        fail(where, f"mass {mass:g} kg", "must be above zero", remedy="leave <inertial> out for a frame without mass")
    return UrdfLink(name, mass, place[:3, 3], inertia, corners)


def _corners(part: ElementTree.Element, file: Path, where: str) -> FloatArray:
    """Corner points of the shapes of a link, in its axes; meshes are read where they are STL files that can be found."""
    points: list[FloatArray] = [np.zeros((0, 3))]
    for kind in ("collision", "visual"):
        for shape in part.findall(kind):
            geometry = shape.find("geometry")
            if geometry is not None and len(geometry):
                points.append(tf.move(_place(shape.find("origin"), where), _shape_corners(geometry[0], file, where)))
        if sum(len(p) for p in points):
            break
    return np.concatenate(points)


def _shape_corners(shape: ElementTree.Element, file: Path, where: str) -> FloatArray:
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    if shape.tag == "box":
        return cube * _numbers(shape, "size", 3, where)
    if shape.tag in ("cylinder", "sphere"):
        radius = float(_numbers(shape, "radius", 1, where)[0])
        angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        ring = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        if shape.tag == "sphere":
            return np.concatenate([ring, ring[:, [0, 2, 1]], ring[:, [2, 0, 1]]])
        height = np.array([0, 0, float(_numbers(shape, "length", 1, where)[0]) / 2])
        return np.concatenate([ring + height, ring - height])
    name = (shape.get("filename") or "").rpartition("//")[2]
    for folder in (file.parent, *file.parents[1:4]):
        for candidate in (folder / name, folder / Path(name).name, folder / Path(*Path(name).parts[1:]) if name else folder):
            if candidate.suffix.lower() == ".stl" and candidate.is_file():
                scale = _numbers(shape, "scale", 3, where, default="1 1 1")
                return np.unique(stl.read(candidate).reshape(-1, 3), axis=0) * scale
    return np.zeros((0, 3))


def _joint(part: ElementTree.Element, file: Path) -> UrdfJoint:
    name, kind = part.get("name") or "", part.get("type") or ""
    where = f"{file}: joint {name!r}"
    if kind not in (*DIRECTION_OF_KIND, "fixed"):
        fail(where, f"type {kind!r}", f"must be of {', '.join(DIRECTION_OF_KIND)}, fixed")
    ends = [part.find(role) for role in ("parent", "child")]
    parent, child = ((end.get("link") or "") if end is not None else "" for end in ends)
    axis = _numbers(part.find("axis"), "xyz", 3, where, default="1 0 0")
    if np.linalg.norm(axis) < 1e-9:
        fail(where, "an axis of length 0", "must not be zero")
    limit, limits = part.find("limit"), (float("-inf"), float("inf"))
    if kind in ("revolute", "prismatic"):
        lower, upper = (float(_numbers(limit, way, 1, where, default="0")[0]) for way in ("lower", "upper"))
        if not lower < upper:
            fail(where, f"limits {lower:g} .. {upper:g}", "the lower must be below the upper",
                 remedy="are they reversed or missing?")
        limits = (lower, upper)
    mimic = part.find("mimic")
    if mimic is not None and float(_numbers(mimic, "offset", 1, where, default="0")[0]) != 0:
        fail(where, f"mimic with offset {mimic.get('offset')}", "must be without offset",
             remedy="turn its origin by the offset")
    follows = None if mimic is None else (mimic.get("joint") or "",
                                          float(_numbers(mimic, "multiplier", 1, where, default="1")[0]))
    place = _place(part.find("origin"), where)
    return UrdfJoint(name, kind, parent, child, place, axis / np.linalg.norm(axis), limits, follows)


def _root(links: Mapping[str, UrdfLink], joints: Mapping[str, UrdfJoint], file: Path) -> str:
    """Return the link that hangs on no joint, after checking that the joints form a tree."""
    above: dict[str, str] = {}
    for joint in joints.values():
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                fail(f"{file}: joint {joint.name}", f"{role} {name!r}", "is no link of the file")
        if joint.child in above:
            fail(f"{file}: link {joint.child}", "two joints have it as their child", "must hang on one",
                 remedy="URDF has no loops: close them in a machine file with closes_loop")
        if joint.mimics is not None and joint.mimics[0] not in joints:
            fail(f"{file}: joint {joint.name}", f"mimics {joint.mimics[0]!r}", "is no joint of the file")
        above[joint.child] = joint.parent
    for name in links:
        path, parent = [name], above.get(name)
        while parent is not None:
            if parent in path:
                circle = " -> ".join([*path, parent])
                fail(f"{file}: link {name}", f"hangs on itself: {circle}", "must be a tree", remedy="break the cycle")
            path.append(parent)
            parent = above.get(parent)
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        fail(str(file), f"{len(roots)} links hang on nothing: {', '.join(roots)}", "must be one, the base")
    return roots[0]
