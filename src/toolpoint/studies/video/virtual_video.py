"""Video test of a machine with known truth: its bodies, textured, filmed while they ring after a blow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.machine import Machine, assemble
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.spatial import transform as tf
from toolpoint.studies.video.machine_view import INSET_PIXELS, body_corners, body_regions
from toolpoint.vibration import Dof, SecondOrderSystem, eigen
from toolpoint.vision.clip import Clip, Region
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, Motion, PicturedBody, Scene2D, film
from toolpoint.vision.rendering.texture import plain, random_texture
from toolpoint.vision.view import View

TEXTURE_CONTRAST, TEXTURE_BLUR, WALL_GREY = 14.0, 1.3, 215.0  # grey levels; pixels; grey level


@dataclass(frozen=True, eq=False)
class VirtualVideo:
    """Virtual video: the clip, its scene with the true motion, the view, and the regions of the bodies."""

    clip: Clip
    scene: Scene2D
    view: View
    regions: dict[str, Region]


def film_machine(
    machine: Machine, view: View, struck: Dof | str, *, rng: np.random.Generator, camera: Camera | None = None,
    frames: int = 960, largest: float = 0.5, pose: Mapping[str, float] | None = None, contrast: float = TEXTURE_CONTRAST,
    textured: Mapping[str, bool] | None = None,
) -> VirtualVideo:
    """Return the video of a machine that rings after a blow.

    Parameters
    ----------
    machine : Machine
        With boxes to draw; it rings with the damping of its joints, coupled between modes.
    view : View
        With its scale.
    struck : Dof
        Where the blow falls.
    rng : numpy.random.Generator
        Of textures and noise.
    camera : Camera, optional
    frames : int
    largest : float
        Largest motion in the picture, pixels: it says how strong the blow is.
    contrast : float
        Standard deviation of the textures, grey levels.
    textured : body to bool, optional
        False for bodies without texture.

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    camera = camera or Camera()
    shapes = body_shapes(machine, pose)
    regions = body_regions(machine, view, camera.shape, pose=pose)
    label = struck if isinstance(struck, Dof) else Dof.parse(struck)
    motion = ring(assemble(machine, pose, (label,)))
    bodies = []
    for name, region in regions.items():
        box = (region.left - INSET_PIXELS, region.top - INSET_PIXELS, region.width + 2 * INSET_PIXELS,
               region.height + 2 * INSET_PIXELS)
        size = (box[3] + 2 * TEXTURE_MARGIN, box[2] + 2 * TEXTURE_MARGIN)
        grey = float(rng.uniform(95, 140))
        has = (textured or {}).get(name, True)
        texture = random_texture(size, rng, blur=TEXTURE_BLUR, contrast=contrast, grey=grey) if has else plain(size, grey)
        face = float((body_corners(machine, pose)[name] @ view.normal).min())
        twist = shapes.twists[machine.link(name)]
        bodies.append(PicturedBody(name, box, texture, _field(box, twist, view, face)))
    rows, columns = camera.shape
    scene = Scene2D(tuple(bodies), motion, plain((rows + 2 * TEXTURE_MARGIN, columns + 2 * TEXTURE_MARGIN), WALL_GREY))
    scene = scene.changed(_scale_motion(motion, _largest_motion(scene, camera, frames), positive("largest", largest)))
    return VirtualVideo(film(scene, camera, frames, rng=rng, name=f"virtual video {view.right[1]}{view.down[1]}"), scene, view,
                        regions)


def ring(system: SecondOrderSystem) -> Motion:
    r"""Return the free motion after a unit impulse at the first input, in the undamped modes of unit modal mass.

    With C and D the damping matrices in these modes, the motion is the sum of :math:`2 \Re\, c\, u\, e^{s t}` over the upper
    poles s of :math:`s^2 I + s C + \Omega^2 + i D`, and of the real poles of overdamped modes once. Viscous damping is exact
    from the blow on. A loss factor has no motion at negative frequencies: its motion is exact once the blow is over.
    """
    squares, vectors = eigen.mass_normalised(system.mass, system.stiffness)
    modal = SecondOrderSystem(np.eye(squares.size), np.diag(squares), _in_modes(system.damping, vectors),
                              _in_modes(system.structural_damping, vectors))
    poles, shapes, rigid = eigen.viscous_pencil(modal, hysteretic=True)
    if rigid.shape[1]:
        fail("machine", f"{rigid.shape[1]} motions without stiffness", "must be held in all directions to ring")
    # A pole of a pair stands for both; residues of u u^T / u^T (2 s + C) u, whose denominator is 1 here.
    strength = np.where(poles.imag > 0, 2.0, 1.0) * (shapes.T @ (vectors.T @ system.input_map[:, 0]))

    def amplitudes(times: FloatArray) -> FloatArray:
        t = np.maximum(np.asarray(times, float)[:, None], 0.0)
        return np.asarray(np.real((strength * np.exp(poles * t)) @ shapes.T))
    return amplitudes


def _in_modes(matrix: FloatArray | None, vectors: FloatArray) -> FloatArray | None:
    return None if matrix is None else vectors.T @ matrix @ vectors


def _scale_motion(motion: Motion, now: float, then: float) -> Motion:
    if now <= 0:
        fail("struck", "the blow moves nothing in the picture", "must have a part along it",
             remedy="strike in the plane of the picture")
    return lambda times: motion(times) * (then / now)


def _largest_motion(scene: Scene2D, camera: Camera, frames: int) -> float:
    """Return the largest motion of a body's corner over the frames, pixels."""
    amplitudes = scene.amplitudes(np.arange(frames) / camera.frame_rate)
    largest = 0.0
    for body in scene.bodies:
        left, upper, width, height = body.box
        corners = np.array([[left + i * width, upper + j * height] for i in (0, 1) for j in (0, 1)], float)
        largest = max(largest, float(np.abs(np.einsum("nir,tr->tni", body.shape_at(corners), amplitudes)).max()))
    return largest


def _field(box: tuple[int, int, int, int], twist: FloatArray, view: View, face: float) -> FloatArray:
    """Return the motion of a body's front face in the picture, (n_modes, 2, 6), pixels for unit amplitude."""
    extent = max(box[2], box[3]) / 2
    centre = np.array([box[0] + (box[2] - 1) / 2, box[1] + (box[3] - 1) / 2])
    places = view.locate(centre + extent * np.array([[0, 0], [1, 0], [0, 1]]), face)
    moved = np.stack([view.axes @ (tf.point_velocity(place) @ twist) / view.metres for place in places])
    field = np.zeros((twist.shape[1], 2, 6))
    field[:, :, 0] = moved[0].T
    field[:, :, 1], field[:, :, 2] = (moved[1] - moved[0]).T, (moved[2] - moved[0]).T
    return field
