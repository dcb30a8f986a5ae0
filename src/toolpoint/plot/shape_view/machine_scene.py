"""Scenes and animated shapes of machines: bodies drawn as described, moved as rigid bodies in each mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies import mesh
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description import BodyDescription, ShapeDescription
from toolpoint.machine.description.extent import equal_box, shape_size
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.round_shapes import cylinder_scene, sphere_scene
from toolpoint.plot.shape_view.scene import Box, Scene
from toolpoint.spatial import transform as tf

POINTS = "points"


def machine_shapes(machine: Machine, pose: Pose | None = None, modes: int = 6) -> tuple[Scene, AnimatedShapes]:
    """Return the scene at one pose and the lowest undamped modes on its nodes."""
    shapes = body_shapes(machine, pose, modes)
    scene, links = _scene(shapes.place)
    moved = np.zeros((shapes.frequency.size, len(scene.nodes), 3))
    for link in range(len(machine.bodies)):
        at = links == link
        velocity = tf.point_velocity(scene.nodes[at]) @ shapes.twists[link]
        moved[:, at] = np.moveaxis(velocity, -1, 0)
    ratio = machine.description.damping_ratio
    return scene, AnimatedShapes(shapes.frequency, np.full(shapes.frequency.size, ratio or 0.0), moved.astype(complex))


def _scene(place: Placement) -> tuple[Scene, np.ndarray]:
    machine, parts, links = place.machine, [], []
    for link, name in enumerate(machine.body_names):
        part = _body(name, machine.description.bodies[name], machine.bodies[link].mass, place.frames[0, link])
        parts.append(part)
        links.append(np.full(len(part.nodes), link))
    size = 0.015 * Scene.joined(parts).size
    for point in machine.description.points.values():
        parts.append(Scene.of_boxes([Box(POINTS, place.position(point)[0], (size,) * 3)]))
        links.append(np.full(8, machine.link(point.body)))
    return Scene.joined(parts), np.concatenate(links)


def _body(name: str, body: BodyDescription, mass: FloatArray, frame: FloatArray) -> Scene:
    if body.mesh is not None:
        nodes, faces = mesh.merge_corners(body.mesh.corners)
        return Scene.of_mesh(name, tf.move(frame, nodes + np.array(body.centre)), faces)
    shape = body.draw or body.shape
    centre = np.array(body.centre if body.draw_at is None else body.draw_at)
    at = tf.move(frame, centre[None])[0]
    part = None if shape is None else _round_part(name, shape)
    if part is not None:
        return replace(part, nodes=part.nodes @ frame[:3, :3].T + at)
    size = shape_size(shape) if shape is not None else equal_box(mass)
    return Scene.of_boxes([Box(name, at, size, frame[:3, :3])])


def _round_part(name: str, shape: ShapeDescription) -> Scene | None:
    """Return a cylinder or a sphere about the origin, None of what is drawn as a box."""
    if shape.kind == "cylinder" and shape.diameter and shape.length:
        return cylinder_scene(name, diameter=shape.diameter, length=shape.length, axis=shape.axis, bore=shape.bore)
    return sphere_scene(name, diameter=shape.diameter) if shape.kind == "sphere" and shape.diameter else None
