"""Scenes and animated shapes of machines: bodies drawn as described, or by their surface, moved and bent in each mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies import mesh
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.shapes import BodyShapes, body_shapes
from toolpoint.machine.description import BodyDescription, ShapeDescription
from toolpoint.machine.description.extent import equal_box, shape_size
from toolpoint.machine.parts.model import Machine
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.round_shapes import cylinder_scene, sphere_scene
from toolpoint.plot.shape_view.scene import Box, Scene
from toolpoint.spatial import transform as tf

POINTS = "points"


def machine_shapes(machine: Machine, pose: Pose | None = None, modes: int = 6) -> tuple[Scene, AnimatedShapes]:
    """Return the scene at one pose and the lowest undamped modes on its nodes; elastic bodies bend as their coordinates say."""
    shapes = body_shapes(machine, pose, modes)
    parts, displacements = [], []
    for link in range(len(machine.bodies)):
        part, moved = _draw_body(shapes, link)
        parts.append(part)
        displacements.append(moved)
    points = machine.description.points
    if points:
        size = 0.015 * Scene.joined(parts).size
        parts.append(Scene.of_boxes([Box(POINTS, shapes.place.position(point)[0], (size,) * 3) for point in points.values()]))
        moved = np.stack([shapes.place.point_jacobian(name)[0, :3] @ shapes.vectors for name in points])
        displacements.append(np.repeat(moved, len(parts[-1].nodes) // len(points), axis=0))
    displacement = np.moveaxis(np.concatenate(displacements), -1, 0)
    return Scene.joined(parts), AnimatedShapes(shapes.frequency, shapes.damping_ratio, displacement.astype(complex))


def _draw_body(shapes: BodyShapes, link: int) -> tuple[Scene, FloatArray]:
    """Return the drawing of a body and the displacement (nodes, 3, modes) of its nodes in every mode, machine axes."""
    place, machine = shapes.place, shapes.place.machine
    body, frame, name = machine.bodies[link], place.frames[0, link], machine.body_names[link]
    if body.surface is None:
        scene = _described_body(name, machine.description.bodies[name], body.mass, frame)
        return scene, tf.point_velocity(scene.nodes) @ shapes.twists[link]
    scene = Scene.of_mesh(name, tf.move(frame, body.surface.nodes), body.surface.triangles)
    bent = frame[:3, :3] @ (body.surface.motion @ shapes.bending(link))
    return scene, tf.point_velocity(scene.nodes) @ shapes.twists[link] + bent


def _described_body(name: str, body: BodyDescription, mass: FloatArray, frame: FloatArray) -> Scene:
    """Return a body as described: mesh, round shape or box; else the box of its moments of inertia."""
    if body.mesh is not None:
        nodes, faces = mesh.merge_corners(body.mesh.corners)
        return Scene.of_mesh(name, tf.move(frame, nodes + np.array(body.centre)), faces)
    shape = body.draw or body.shape
    centre = np.array(body.centre if body.draw_at is None else body.draw_at)
    machine_centre = tf.move(frame, centre[None])[0]
    part = None if shape is None else _round_part(name, shape)
    if part is not None:
        return replace(part, nodes=part.nodes @ frame[:3, :3].T + machine_centre)
    size = shape_size(shape) if shape is not None else equal_box(mass)
    return Scene.of_boxes([Box(name, machine_centre, size, frame[:3, :3])])


def _round_part(name: str, shape: ShapeDescription) -> Scene | None:
    """Return a cylinder or a sphere about the origin, None of what is drawn as a box."""
    if shape.kind == "cylinder" and shape.diameter and shape.length:
        return cylinder_scene(name, diameter=shape.diameter, length=shape.length, axis=shape.axis, bore=shape.bore)
    return sphere_scene(name, diameter=shape.diameter) if shape.kind == "sphere" and shape.diameter else None
