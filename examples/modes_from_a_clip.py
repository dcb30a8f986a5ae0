"""Frequency, damping and body motion from frames in an array: a plate that swings on its foot (as `toolpoint video`)."""

import tempfile

import numpy as np

from toolpoint.pages.video import video_page
from toolpoint.studies import study_video
from toolpoint.vision import Clip, Region, clip_of
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, PicturedBody, Scene2D, decays, film
from toolpoint.vision.rendering.texture import plain, random_texture

BOX, SHAPE = (40, 20, 80, 120), (160, 160)


def clip_of_a_plate(rng: np.random.Generator) -> Clip:
    """Film a plate that swings to the right and left at 20 Hz with 2 % damping."""
    field = np.zeros((1, 2, 6))
    field[0, 0, :3] = 0.2, 0.0, -0.2
    skin = random_texture((BOX[3] + 2 * TEXTURE_MARGIN, BOX[2] + 2 * TEXTURE_MARGIN), rng)
    wall = plain((SHAPE[0] + 2 * TEXTURE_MARGIN, SHAPE[1] + 2 * TEXTURE_MARGIN), 200.0)
    scene = Scene2D((PicturedBody("plate", BOX, skin, field),), decays([20.0], [0.02]), wall)
    frames = np.concatenate(list(film(scene, Camera(SHAPE, 480.0), 320, rng=rng).chunks()))
    return clip_of(frames, 480.0, name="plate")  # so is any array of frames that a camera gave


def main() -> float:
    """Print what the clip shows; return the damping ratio in per cent."""
    result = study_video(clip_of_a_plate(np.random.default_rng(2)), points=60, bodies={"plate": Region(*BOX)})
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(video_page([result]).save(folder))
    return 100 * float(result.modes.damping_ratio[0])


if __name__ == "__main__":
    main()
