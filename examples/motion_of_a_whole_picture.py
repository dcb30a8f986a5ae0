"""Motion of every part of a picture, and of each body in it, for a pole that is known from elsewhere."""

import numpy as np

from toolpoint.vision import BodyMotion, Clip, Region, clip_of, fit_bodies, full_field, scan
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, PicturedBody, Scene2D, decays, film
from toolpoint.vision.rendering.texture import plain, random_texture

BOX, SHAPE = (40, 20, 80, 120), (160, 160)


def clip_of_a_plate(rng: np.random.Generator) -> Clip:
    """Film a plate that moves 0.2 pixels to the right and left at 20 Hz with 2 % damping."""
    field = np.zeros((1, 2, 6))
    field[0, 0, 0] = 0.2
    skin = random_texture((BOX[3] + 2 * TEXTURE_MARGIN, BOX[2] + 2 * TEXTURE_MARGIN), rng)
    wall = plain((SHAPE[0] + 2 * TEXTURE_MARGIN, SHAPE[1] + 2 * TEXTURE_MARGIN), 200.0)
    scene = Scene2D((PicturedBody("plate", BOX, skin, field),), decays([20.0], [0.02]), wall)
    return clip_of(np.concatenate(list(film(scene, Camera(SHAPE, 480.0), 320, rng=rng).chunks())), 480.0, name="plate")


def main() -> float:
    """Return the plate's motion in pixels, as its windows show it together."""
    omega, ratio = 2 * np.pi * 20.0, 0.02
    pole = omega * complex(-ratio, np.sqrt(1 - ratio**2))
    picture = full_field(scan(clip_of_a_plate(np.random.default_rng(2))), np.array([pole]))
    plate: BodyMotion = fit_bodies(picture.windows, picture.shapes, {"plate": Region(*BOX)})[0]
    print(f"{len(picture.windows.centres)} windows; plate moves as {plate.orders[0]}, by {plate.windows} of them")
    return float(np.abs(plate.shape_at(np.array([[80.0, 80.0]]))[0, 0, 0]))


if __name__ == "__main__":
    main()
