"""A small C-frame of known motion before a virtual camera."""

import numpy as np

from toolpoint.vision.clip import Region
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, PicturedBody, Scene2D, decays, film
from toolpoint.vision.rendering.texture import plain, random_texture

SHAPE, FRAMES, RATE = (176, 208), 384, 480.0
FREQUENCIES, RATIOS = (22.0, 71.0), (0.02, 0.015)
OMEGA = 2 * np.pi * np.array(FREQUENCIES)
POLES = OMEGA * (-np.array(RATIOS) + 1j * np.sqrt(1 - np.array(RATIOS) ** 2))

COLUMN, HEAD = (40, 24, 56, 128), (96, 40, 84, 60)


def c_frame(rng, amplitude=0.4, contrast=20.0, shape=SHAPE, texture=random_texture, plain_head=False):
    """Column and head; the first mode rocks both about the foot of the column, the second turns the head on the column."""
    bodies = []
    for name, box in (("column", COLUMN), ("head", HEAD)):
        size = (box[3] + 2 * TEXTURE_MARGIN, box[2] + 2 * TEXTURE_MARGIN)
        skin = plain(size, 130.0) if plain_head and name == "head" else texture(size, rng, contrast=contrast)
        extent = max(box[2], box[3]) / 2
        centre = np.array([box[0] + (box[2] - 1) / 2, box[1] + (box[3] - 1) / 2])
        field = np.zeros((2, 2, 6))
        field[0] = turn(centre, extent, pivot=(68, 152), rate=1 / 128)
        if name == "head":
            field[1] = 0.4 * turn(centre, extent, pivot=(96, 70), rate=1 / 84)
        bodies.append(PicturedBody(name, box, skin, amplitude * field))
    wall = plain((shape[0] + 2 * TEXTURE_MARGIN, shape[1] + 2 * TEXTURE_MARGIN), 205.0)
    return Scene2D(tuple(bodies), decays(FREQUENCIES, RATIOS), wall)


def turn(centre, extent, *, pivot, rate):
    """Coefficients of a turn about a pivot, pixels for unit amplitude."""
    x, y = centre - np.asarray(pivot)
    return rate * np.array([[-y, 0, -extent, 0, 0, 0], [x, extent, 0, 0, 0, 0]])


def filmed(scene, rng, frames=FRAMES, shape=SHAPE, **options):
    return film(scene, Camera(shape=shape, frame_rate=RATE, **options), frames, rng=rng)


def regions(scene):
    return {body.name: Region(*body.box) for body in scene.bodies}


def true_motion(scene, windows, frames=FRAMES, rate=RATE, margin=2):
    """True displacement of the windows that lie wholly on one body, (frames, n, 2), and which those are."""
    amplitudes = scene.amplitudes(np.arange(frames) / rate)
    motion, owner = np.zeros((frames, len(windows.corners), 2)), np.full(len(windows.corners), -1)
    low, high = windows.centres - windows.side / 2, windows.centres + windows.side / 2
    for k, body in enumerate(scene.bodies):
        inside = Region(body.box[0] + margin, body.box[1] + margin, body.box[2] - 2 * margin, body.box[3] - 2 * margin)
        on = inside.holds(low) & inside.holds(high)
        owner[on] = k
        motion[:, on] = np.einsum("nir,tr->tni", body.shape_at(windows.centres[on]), amplitudes)
    return motion, owner
