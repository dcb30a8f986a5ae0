"""The benchmark clip: a C-frame of four textured bodies, two decaying modes (13 Hz 2 %, 64 Hz 1.5 %), known exactly."""

from __future__ import annotations

import numpy as np

from toolpoint.vision.clip import Region
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, PicturedBody, Scene2D, decays
from toolpoint.vision.rendering.texture import plain, random_texture

SHAPE, RATE, FRAMES = (720, 1280), 960.0, 960
FREQUENCY, RATIO = (13.0, 64.0), (0.02, 0.015)
SYN, LOW = (0.5, 0.15), (0.05, 0.015)
BOXES = {"base": (330, 520, 620, 150), "column": (330, 120, 200, 400), "head": (530, 150, 300, 180),
         "table": (600, 440, 320, 80)}
FOOT, KNEE, BEND = (640, 670), (430, 520), 0.05


def poles() -> np.ndarray:
    """True poles, rad/s."""
    omega, zeta = 2 * np.pi * np.array(FREQUENCY), np.array(RATIO)
    return omega * (-zeta + 1j * np.sqrt(1 - zeta**2))


def c_frame(rng: np.random.Generator, amplitude: tuple[float, float], *, shape: tuple[int, int] = SHAPE, contrast: float = 5.0,
            wall_contrast: float = 0.0) -> Scene2D:
    """The scene, scaled to the picture; `amplitude` of both modes at the top of the column and at the head, pixels."""
    scale = shape[0] / SHAPE[0]
    bodies = []
    for name, full in BOXES.items():
        box = tuple(round(scale * value) for value in full)
        texture = random_texture((box[3] + 2 * TEXTURE_MARGIN, box[2] + 2 * TEXTURE_MARGIN), rng, contrast=contrast)
        extent, centre = max(box[2:]) / 2, np.array([box[0] + (box[2] - 1) / 2, box[1] + (box[3] - 1) / 2])
        field = np.zeros((2, 2, 6))
        field[0] = _turn(centre, extent, scale * np.array(FOOT)) / (550 * scale) * amplitude[0]
        if name in ("column", "head"):
            size = amplitude[1] / (400 * scale) * (1.4 if name == "head" else 1.0)
            field[1] = _turn(centre, extent, scale * np.array(KNEE)) * size
            field[1, 0, 5] += BEND * amplitude[1]
            field[1, 1, 3] += 0.7 * BEND * amplitude[1]
        bodies.append(PicturedBody(name, box, texture, field))
    size = (shape[0] + 2 * TEXTURE_MARGIN, shape[1] + 2 * TEXTURE_MARGIN)
    wall = random_texture(size, rng, contrast=wall_contrast, grey=200.0) if wall_contrast else plain(size, 200.0)
    return Scene2D(tuple(bodies), decays(FREQUENCY, RATIO), wall)


def regions(scene: Scene2D) -> dict[str, Region]:
    """Where the bodies are."""
    return {body.name: Region(*body.box) for body in scene.bodies}


def owners(scene: Scene2D, centres: np.ndarray, side: float, rim: float = 3.0) -> np.ndarray:
    """Body on which each window lies wholly, -1 for none or several."""
    owner = np.full(len(centres), -1)
    half = side / 2
    for k, body in enumerate(scene.bodies):
        left, top, width, height = body.box
        x, y = centres[:, 0], centres[:, 1]
        inside = ((x - half >= left + rim) & (x + half < left + width - rim)
                  & (y - half >= top + rim) & (y + half < top + height - rim))
        near = ((x + half > left - rim) & (x - half < left + width + rim)
                & (y + half > top - rim) & (y - half < top + height + rim))
        owner[inside] = k
        owner[near & ~inside] = -1
    return owner


def true_shapes(scene: Scene2D, centres: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """True shapes at centres on bodies, (n, 2, modes); zero elsewhere."""
    shapes = np.zeros((len(centres), 2, 2))
    for k, body in enumerate(scene.bodies):
        shapes[owner == k] = body.shape_at(centres[owner == k])
    return shapes


def true_motion(scene: Scene2D, centres: np.ndarray, owner: np.ndarray, frames: int = FRAMES, rate: float = RATE) -> np.ndarray:
    """True displacement, (frames, n, 2)."""
    return np.einsum("nir,tr->tni", true_shapes(scene, centres, owner), scene.amplitudes(np.arange(frames) / rate))


def _turn(centre: np.ndarray, extent: float, pivot: np.ndarray) -> np.ndarray:
    x, y = centre - pivot
    return np.array([[-y, 0, -extent, 0, 0, 0], [x, extent, 0, 0, 0, 0]])
