"""The virtual camera: laws that hold whatever its splines are."""

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint import ToolpointError
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, PicturedBody, RenderedFrames, Scene2D, decays
from toolpoint.vision.rendering.texture import plain, random_texture


def shifted(right, down, rng_seed=3):
    """The picture of one body that stands (right, down) pixels from its place."""
    box = (30, 20, 60, 50)
    skin = random_texture((box[3] + 2 * TEXTURE_MARGIN, box[2] + 2 * TEXTURE_MARGIN), np.random.default_rng(rng_seed))
    field = np.zeros((1, 2, 6))
    field[0, :, 0] = right, down
    scene = Scene2D((PicturedBody("a", box, skin, field),), lambda t: np.ones((len(t), 1)),
                    plain((120 + 2 * TEXTURE_MARGIN,) * 2, 200.0))
    return RenderedFrames(scene, Camera(shape=(120, 120)), 2).picture(0.0)


def test_a_whole_pixel_moves_the_picture_by_a_pixel():
    np.testing.assert_allclose(shifted(3, -2)[10:100, 10:100], shifted(0, 0)[12:102, 7:97], atol=1e-3)


def test_a_shift_is_the_phase_of_its_spectrum():
    # The body is blurred over more than a pixel: its spectrum is in the camera's band, and a shift turns its phase alone.
    spectrum = np.fft.fft2(shifted(0, 0) - 200.0)
    fx, fy = np.fft.fftfreq(120)[None, :], np.fft.fftfreq(120)[:, None]
    moved = np.fft.ifft2(spectrum * np.exp(-2j * np.pi * (0.37 * fx - 0.62 * fy))).real + 200.0
    # The outline is sharper than the texture: inside it the agreement is that of the texture.
    np.testing.assert_allclose(moved[35:55, 50:75], shifted(0.37, -0.62)[35:55, 50:75], atol=0.25)


def test_noise_has_the_size_that_was_asked_for():
    rng = np.random.default_rng(5)
    clip = scenes.filmed(scenes.c_frame(rng, amplitude=0.0), rng, frames=40, noise=3.0)
    frames = next(iter(clip.chunks(40))).astype(float)
    assert np.sqrt(frames.var(axis=0, ddof=1).mean()) == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.01)


def test_an_impulse_rings_with_frequency_and_damping():
    motion = decays([10.0], [0.05])
    omega = 2 * np.pi * 10 * np.sqrt(1 - 0.05**2)
    assert motion(np.array([0.03]))[0, 0] == pytest.approx(np.exp(-0.05 * 2 * np.pi * 10 * 0.03) * np.sin(omega * 0.03))
    assert motion(np.array([-0.1]))[0, 0] == 0


def test_a_texture_of_the_wrong_size_is_refused():
    with pytest.raises(ToolpointError, match="around it"):
        PicturedBody("a", (0, 0, 20, 20), np.zeros((20, 20)), np.zeros((1, 2, 6)))
