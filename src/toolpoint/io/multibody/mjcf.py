"""MJCF, the file format of MuJoCo: a machine at a pose as nested bodies on springs; write."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.io.multibody.links import TreeLink, tree_links
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine
from toolpoint.spatial import rotation


def write(machine: Machine, path: str | Path, pose: Pose | None = None) -> None:
    """Write a machine at a pose; every elastic direction is a hinge or slide with stiffness and damping, SI units, no gravity.

    Modal damping ratios and loss factors have no counterpart there and are left out. Errors are those of `tree_links`.
    """
    links = tree_links(machine, pose)
    root = ElementTree.Element("mujoco", model=machine.name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="false")
    ElementTree.SubElement(root, "option", gravity="0 0 0")
    world = ElementTree.SubElement(root, "worldbody")
    nodes: list[ElementTree.Element] = []
    for link in links:
        nodes.append(_body(world if link.parent < 0 else nodes[link.parent], link))
    tree = ElementTree.ElementTree(root)
    ElementTree.indent(tree)
    tree.write(path, encoding="unicode", xml_declaration=False)


def _body(above: ElementTree.Element, link: TreeLink) -> ElementTree.Element:
    node = ElementTree.SubElement(above, "body", name=link.name, pos=_words(link.place[:3, 3]),
                                  quat=_words(_quaternion(link.place)))
    tensor = link.properties.inertia
    ElementTree.SubElement(node, "inertial", pos=_words(link.properties.centre), mass=repr(link.properties.mass),
                           fullinertia=_words(
        np.array([tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]])))
    for way, stiffness, damping in zip(link.ways, link.stiffness, link.damping, strict=True):
        ElementTree.SubElement(node, "joint", name=f"{link.name}_{('x', 'y', 'z', 'rx', 'ry', 'rz')[way]}",
                               type="slide" if way < 3 else "hinge", axis=_words(np.eye(3)[way % 3]), stiffness=repr(stiffness),
                               damping=repr(damping))
    return node


def _quaternion(place: FloatArray) -> FloatArray:
    vector = rotation.to_vector(place[:3, :3])
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(v)) for v in values)
