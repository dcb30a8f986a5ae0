"""Machine in a picture: the region of each body, and the motion of its joints in the video."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.machine import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf
from toolpoint.vision.clip import Region
from toolpoint.vision.view import View

INSET_PIXELS = 2  # from the edge of a body's box inwards


def body_regions(machine: Machine, view: View, shape: tuple[int, int], *, pose: Mapping[str, float] | None = None
                 ) -> dict[str, Region]:
    """Return the regions of the boxes of a machine's bodies in a picture of (rows, columns), from back to front."""
    regions = []
    for name, corners in body_corners(machine, pose).items():
        pixels = view.project(corners)
        first_pixel = np.maximum(np.ceil(pixels.min(axis=0)) + INSET_PIXELS, 0).astype(int)
        last_pixel = np.minimum(np.floor(pixels.max(axis=0)) - INSET_PIXELS, (shape[1] - 1, shape[0] - 1)).astype(int)
        if (last_pixel - first_pixel >= 8).all():
            region = Region(int(first_pixel[0]), int(first_pixel[1]), int(last_pixel[0] - first_pixel[0] + 1),
                            int(last_pixel[1] - first_pixel[1] + 1))
            regions.append((-float((corners @ view.normal).min()), name, region))
    if not regions:
        fail("view", "no body of the machine lies in the picture", "must show them",
             remedy="check scale, origin and directions")
    return {name: region for _, name, region in sorted(regions)}


def body_corners(machine: Machine, pose: Mapping[str, float] | None = None) -> dict[str, FloatArray]:
    """Return the corners (8, 3) of the drawn or inertial box of every body that has one, machine axes, m."""
    place = place_machine(machine, pose)
    signs = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    result = {}
    for name, body in machine.description.bodies.items():
        box = body.draw or body.shape
        if box is None or box.size is None:
            continue
        centre = np.array(body.centre if body.draw_at is None else body.draw_at)
        result[name] = tf.move(place.frames[0, machine.link(name)], centre + signs * np.array(box.size))
    if not result:
        fail("machine", "no body with a box", "must have bodies with a shape or drawn as one",
             remedy="state the bodies' regions by hand")
    return result
