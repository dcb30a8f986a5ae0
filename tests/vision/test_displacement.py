"""Displacement: against the Cramer-Rao bound and the known motion, for every method; what it says where it cannot see."""

import numpy as np
import pytest
import video_scenes as scenes
from scipy.ndimage import gaussian_filter

from toolpoint import ToolpointError
from toolpoint.vision.clip import Region, clip_of
from toolpoint.vision.displacement.background import smooth_motion, windows_inside, without_shake
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT, choose_points, windows_at
from toolpoint.vision.displacement.quality import judge_quality
from toolpoint.vision.displacement.templates import TemplateProducts
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN
from toolpoint.vision.rendering.texture import SPLINE_POINTS_PER_PIXEL, random_texture
from toolpoint.vision.view import View

METHODS = ("templates", "lucas-kanade", "phase")


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(1)
    scene = scenes.c_frame(rng)
    scanned = scan(scenes.filmed(scene, rng))
    return scene, scanned, choose_points(scanned.reference, scanned.survey, 80, side=17)


def errors(field, scene):
    truth, owner = scenes.true_motion(scene, field.windows)
    on = (owner >= 0) & (field.windows.sight == FULL_SIGHT)
    centred = (lambda values: values - values.mean(axis=0))
    return centred(field.values[:, on]) - centred(truth[:, on]), centred(truth[:, on]), field.covariance[on]


@pytest.mark.parametrize(("method", "above"), list(zip(METHODS, (1.05, 1.06, 1.4))))
@pytest.mark.default_cases(2)
def test_noise_is_that_of_the_bound(case, method, above):
    scene, scanned, points = case
    field = measure(scanned, points, method)
    error, truth, _ = errors(field, scene)
    on = (scenes.true_motion(scene, points)[1] >= 0) & (field.windows.sight == FULL_SIGHT)
    middle = points.corners[on] + points.side // 2
    bound = np.linalg.inv(scanned.reference.information(points.side)[middle[:, 0], middle[:, 1]])
    least = np.sqrt(np.trace(bound, axis1=1, axis2=2).mean() / 2)
    assert np.sqrt((error**2).mean()) <= above * least
    assert (error * truth).sum() / (truth**2).sum() == pytest.approx(0, abs=0.01)  # slope of one


def test_stated_deviations_hold_their_share(case):
    scene, scanned, points = case
    error, _, covariance = errors(measure(scanned, points), scene)
    ratio = error / np.sqrt(np.einsum("nii->ni", covariance))
    assert np.mean(np.abs(ratio) < 1) == pytest.approx(0.683, abs=0.05)


def test_large_motion_is_followed():
    rng = np.random.default_rng(2)
    scene = scenes.c_frame(rng, amplitude=2.0, contrast=10.0)
    scanned = scan(scenes.filmed(scene, rng))
    error, truth, _ = errors(measure(scanned, choose_points(scanned.reference, scanned.survey, 60, side=17)), scene)
    assert (error * truth).sum() / (truth**2).sum() == pytest.approx(0, abs=0.005)


def test_lamps_do_not_move_the_machine():
    rng = np.random.default_rng(3)
    scene = scenes.c_frame(rng, contrast=10.0)
    rms = []
    for flicker in (0.0, 0.02):
        scanned = scan(scenes.filmed(scene, np.random.default_rng(4), flicker=flicker))
        error, _, _ = errors(measure(scanned, choose_points(scanned.reference, scanned.survey, 60, side=17)), scene)
        rms.append(float(np.sqrt((error**2).mean())))
    assert rms[1] < 1.05 * rms[0]


def stripes(shape, period=24.0, blur=1.2):
    """Coefficients of parallel edges: motion shows across them only."""
    x = np.mgrid[:SPLINE_POINTS_PER_PIXEL * shape[0], :SPLINE_POINTS_PER_PIXEL * shape[1]][1] / SPLINE_POINTS_PER_PIXEL
    return (120.0 + 40.0
            * gaussian_filter(np.sign(np.sin(2 * np.pi * x / period)), SPLINE_POINTS_PER_PIXEL * blur)).astype(np.float32)


def test_parallel_edges_show_one_direction_and_plain_parts_none():
    rng = np.random.default_rng(5)
    scene = scenes.c_frame(rng, texture=lambda size, rng, contrast: stripes(size))
    scanned = scan(scenes.filmed(scene, rng))
    corners = np.array([[80, 60], [10, 150], [150, 10]])
    windows = windows_at(scanned.reference, corners, 25)
    assert windows.sight.tolist() == [EDGE_SIGHT, BLIND_SIGHT, BLIND_SIGHT]
    np.testing.assert_allclose(np.abs(windows.normal[0]), [1, 0], atol=0.02)
    field = measure(scanned, windows)
    truth = scenes.true_motion(scene, windows)[0][:, 0, 0]
    assert np.abs(field.values[:, 0, 0] - field.values[:, 0, 0].mean() - truth + truth.mean()).max() < 0.05
    assert (field.values[:, 1:] == 0).all() and field.quality[1] == "blind"
    record = field.record()
    assert record.samples.shape[1] == 1 and record.channels[0].vector is not None


def test_saturated_windows_are_left_out_and_said():
    rng = np.random.default_rng(6)
    scene = scenes.c_frame(rng, contrast=20.0)
    frames = next(iter(scenes.filmed(scene, rng, frames=64).chunks(64))).astype(int)
    clipped = clip_of(np.clip(2 * frames, 0, 255).astype(np.uint8), scenes.RATE)
    scanned = scan(clipped)
    corners = np.array([[60, 50], [100, 60]])
    windows = windows_at(scanned.reference, corners, 21, saturated=scanned.survey.saturated)
    assert (windows.sight == BLIND_SIGHT).all()
    assert "saturated" in measure(scanned, windows).doubts[0]


@pytest.mark.slow
def test_shake_is_taken_off_by_the_background():
    rng = np.random.default_rng(7)
    scene = scenes.c_frame(rng, contrast=15.0)
    wall = random_texture((scenes.SHAPE[0] + 2 * TEXTURE_MARGIN, scenes.SHAPE[1] + 2 * TEXTURE_MARGIN), rng, contrast=15.0,
                          grey=190.0)
    scene = type(scene)(scene.bodies, scene.amplitudes, wall)

    def shake(times):
        return np.column_stack([np.sin(2 * np.pi * 3 * times), 0.7 * np.sin(2 * np.pi * 5.3 * times)])
    scanned = scan(scenes.filmed(scene, rng, shake=shake))
    windows = windows_at(scanned.reference, np.array([[60, 55], [10, 8], [10, 150], [150, 10], [148, 140], [150, 170]]), 21)
    field = measure(scanned, windows)
    still = windows_inside(field.windows, [Region(0, 0, 208, 24), Region(0, 140, 38, 36), Region(110, 120, 98, 56)])
    steady = without_shake(field, still)
    error, _, covariance = errors(steady, scene)
    assert np.sqrt((error**2).mean()) < 1.5 * np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean() / 2)
    assert "camera shake" in steady.doubts[0]
    with pytest.raises(ToolpointError, match="tripod"):
        without_shake(field, np.zeros(6, bool))


def test_noise_of_the_background_is_not_taken_off_with_the_shake():
    """What is taken off is far nearer to the camera's motion than the background is; a motion within the noise stays out."""
    rng, times = np.random.default_rng(5), np.arange(960) / 960
    shake = np.stack([np.sin(2 * np.pi * 2.3 * times) + 0.3 * times, 0.05 * np.sin(2 * np.pi * 40 * times), 0 * times])
    seen = shake + 0.003 * rng.normal(size=shake.shape)
    error = smooth_motion(seen, np.full(3, 0.003**2)) - shake
    assert (np.sqrt((error**2).mean(axis=1)) < 0.5 * 0.003).all()
    loud = rng.normal(size=(1, 960))  # a motion that is no line at all but stands above the noise is taken off whole
    np.testing.assert_allclose(smooth_motion(loud, np.array([1e-4])), loud, atol=0.02)


def test_a_clip_without_texture_says_what_to_do():
    frames = np.full((40, 120, 120), 128, np.uint8)
    scanned = scan(clip_of(frames, 100.0))
    with pytest.raises(ToolpointError, match="stick or spray a pattern"):
        choose_points(scanned.reference, scanned.survey, 10)


def test_repeated_frames_take_the_damping_away():
    rng = np.random.default_rng(8)
    frames = next(iter(scenes.filmed(scenes.c_frame(rng), rng, frames=64).chunks(64)))
    quality = judge_quality(scan(clip_of(np.repeat(frames, 2, axis=0), scenes.RATE)))
    assert not quality.accepts_amplitude and "repeat" in quality.doubts[0]


def test_a_record_is_in_metres_where_the_scale_is_known(case):
    _, scanned, points = case
    field = measure(scanned, points, TemplateProducts(2))
    view = View.of_plane("xz").scaled_by((0, 0), (100, 0), length=0.05)
    pixels, metres = field.record(), field.record(view)
    assert metres.units[0] == "m" and pixels.units[0] == "px"
    np.testing.assert_allclose(metres.samples, 5e-4 * pixels.samples)
    assert str(metres.channels[1]) == "1:-z"


@pytest.mark.slow
def test_sixteen_bits_are_as_good_as_eight():
    rng = np.random.default_rng(9)
    scene = scenes.c_frame(rng)
    scanned = scan(scenes.filmed(scene, rng, frames=128, bits=12))
    assert scanned.clip.white == 4095
    field = measure(scanned, choose_points(scanned.reference, scanned.survey, 30, side=17))
    truth, owner = scenes.true_motion(scene, field.windows, frames=128)
    on = owner >= 0
    error = field.values[:, on] - truth[:, on]
    assert np.sqrt((error - error.mean(axis=0)).var()) < 1.1 * np.sqrt(np.trace(field.covariance[on], axis1=1,
                                                                                axis2=2).mean() / 2)
