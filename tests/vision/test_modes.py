"""Modes from video: the decay's transform is exact, shapes of points, picture and bodies agree, what is no mode is named."""

from dataclasses import replace

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint import Modes, ToolpointError
from toolpoint.vibration.correlation import mac
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import choose_points
from toolpoint.vision.modes.bodies import fit_bodies
from toolpoint.vision.modes.decay import FreeDecay, find_decay
from toolpoint.vision.modes.full_field import full_field
from toolpoint.vision.modes.lines import alias_candidates, find_break, lamp_lines, name_line, name_modes
from toolpoint.vision.modes.projection import count_transient_frames, decay_basis, point_shapes
from toolpoint.vision.modes.views import join_views

OMEGA, POLES = scenes.OMEGA, scenes.POLES


def test_the_transform_of_a_decay_is_one_pole_on_every_line():
    rate, n, s = 200.0, 160, -3.0 + 2j * np.pi * 21
    history = np.exp(s * np.arange(n) / rate)
    frf = FreeDecay(history.real[:, None], np.ones((1, 1)), np.ones(1), 0, rate).responses()
    z = np.exp(-2j * np.pi * frf.frequency / rate)
    closed = sum(0.5 * (1 - np.exp(p * n / rate)) / (1 - np.exp(p / rate) * z) / rate for p in (s, np.conj(s)))
    np.testing.assert_allclose(frf.values[:, 0, 0], closed, rtol=1e-10)


def test_projection_gives_back_what_was_put_in():
    times = np.arange(300) / 480
    basis = decay_basis(POLES, times)
    amplitude = np.array([1 - 2j, 0.3 + 0.1j])
    history = (amplitude * np.exp(POLES * times[:, None])).real.sum(axis=1) + 0.7 + 0.2 * times
    np.testing.assert_allclose(basis.amplitudes(history[:, None])[:, 0], amplitude, atol=1e-10)
    np.testing.assert_allclose(basis.residual(history[:, None]), 0, atol=1e-10)


def test_amplitudes_are_those_at_the_first_frame_whatever_is_skipped():
    times = np.arange(300) / 480
    amplitude = np.array([1 - 2j, 0.3 + 0.1j])
    history = (amplitude * np.exp(POLES * times[:, None])).real.sum(axis=1)
    history[:40] += 5.0
    np.testing.assert_allclose(decay_basis(POLES, times, skip=40).amplitudes(history[:, None])[:, 0], amplitude, atol=1e-10)


def test_a_mode_that_dies_at_once_is_left_out_of_the_shapes_of_others(case):
    """A mode of 60 % damping is gone after some frames: no pole is identified, and its motion is not that of the known ones."""
    _, scanned = case
    field = measure(scanned, choose_points(scanned.reference, scanned.survey, 60, side=17))
    assert count_transient_frames(field, POLES, 0) == 0
    times = np.arange(len(field.values)) / scenes.RATE
    omega = 2 * np.pi * 30
    dying = 0.2 * np.exp(-0.6 * omega * times) * np.sin(0.8 * omega * times)
    disturbed = replace(field, values=field.values + dying[:, None, None].astype(field.values.dtype))
    skip = count_transient_frames(disturbed, POLES, 0)
    assert 0 < skip <= 0.25 * len(times)
    true, wrong, mended = (point_shapes(part, POLES, skip=left_out).shape
                           for part, left_out in ((field, 0), (disturbed, 0), (disturbed, skip)))
    # All windows move alike, so the mean over them shows what the shapes take of it beyond their noise.
    bias, left = (np.abs((part - true).mean(axis=0)).max() for part in (wrong, mended))
    assert bias > 5 * left and bias > 0.005


def test_aliases_of_each_other_cannot_be_told_apart():
    times = np.arange(300) / 480
    with pytest.raises(ToolpointError, match="aliases"):
        decay_basis(np.array([-5 + 2j * np.pi * 100, -5 + 2j * np.pi * 380]), times)


def test_points_picture_and_bodies_agree_with_the_truth(case):
    scene, scanned = case
    points = measure(scanned, choose_points(scanned.reference, scanned.survey, 150, side=17))
    tracked = point_shapes(points, POLES)
    whole = full_field(scanned, POLES)
    bodies = {body.name: body for body in fit_bodies(whole.windows, whole.shapes, scenes.regions(scene))}
    for shapes, windows in ((tracked.shape, points.windows), (whole.shapes.shape, whole.windows)):
        _, owner = scenes.true_motion(scene, windows)
        on = (owner >= 0) & (windows.sight == 2)
        truth = np.stack([scene.bodies[owner[k]].shape_at(windows.centres[k][None])[0] for k in np.flatnonzero(on)])
        assert np.diag(mac(shapes[on].reshape(-1, 2), -1j * truth.reshape(-1, 2))).min() > 0.98
    for body in scene.bodies:
        places = np.array(body.centre) + np.array([[-20.0, -20.0], [15.0, 10.0]])
        error = bodies[body.name].shape_at(places) + 1j * body.shape_at(places)
        assert (np.abs(error) < 4 * bodies[body.name].deviation_at(places) + 2e-3).all()
    assert bodies["head"].orders == ("rigid", "rigid")


@pytest.mark.slow
def test_a_body_without_texture_and_motion_along_the_sight_are_said():
    rng = np.random.default_rng(12)
    scene = scenes.c_frame(rng, plain_head=True)
    scanned = scan(scenes.filmed(scene, rng))
    whole = full_field(scanned, POLES)
    head = fit_bodies(whole.windows, whole.shapes, {"head": Region(102, 46, 70, 46)})[0]
    assert head.orders == ("unknown", "unknown") and "stick or spray" in head.doubts[0]
    still = scan(scenes.filmed(scenes.c_frame(rng, amplitude=0.0), rng))
    field = measure(still, choose_points(still.reference, still.survey, 40, side=17))
    with pytest.raises(ToolpointError, match="line of sight"):
        find_decay(field)


@pytest.mark.slow
def test_rolling_shutter_is_corrected_to_two_degrees():
    rng = np.random.default_rng(13)
    scene = scenes.c_frame(rng, amplitude=0.5)
    delay = 1e-3 / scenes.SHAPE[0]
    shapes = []
    taken = scenes.filmed(scene, rng, row_delay=delay, frames=200)
    for stated in (delay, 0.0):
        clip = type(taken)(taken.source, taken.frame_rate, stated)
        scanned = scan(clip)
        windows = choose_points(scanned.reference, scanned.survey, 60, side=17)
        shapes.append((windows, point_shapes(measure(scanned, windows), POLES).shape))
    windows, corrected = shapes[0]
    on = scenes.true_motion(scene, windows)[1] == 0
    phase = np.angle(corrected[on, 0, 0] / -1j * np.sign(scene.bodies[0].shape_at(windows.centres[on])[:, 0, 0]))
    assert np.degrees(np.abs(np.median(phase))) < 2
    raw = np.angle(shapes[1][1][on, 0, 0] / -1j * np.sign(scene.bodies[0].shape_at(windows.centres[on])[:, 0, 0]))
    assert np.degrees(np.median(raw - phase)) == pytest.approx(
        np.degrees(np.median(OMEGA[0] * delay * windows.centres[on, 1])), abs=1.0)


def test_lamps_harmonics_and_steady_lines_are_named():
    times = np.arange(960) / 960
    lines = lamp_lines(0.01 * np.sin(2 * np.pi * 100 * times) + 1e-5 * np.random.default_rng(1).standard_normal(960), 960.0)
    assert len(lines) == 1 and lines[0] == pytest.approx(100, abs=0.2)
    assert "50 Hz mains" in name_line(lines[0], 960.0) and "aliased" in name_line(20.0, 240.0 / 2)
    modes = Modes([13.0, 26.0, 64.0, 87.0, 100.0, 150.0], [0.02, 0.02, 0.015, 0.001, 0.001, 1e-5],
                  [[1.0, 0.01, 0.5, 0.01, 0.01, 0.3]], ["1:+x"], "unscaled")
    names = name_modes(modes, (100.0,), 960.0, resolution=1.0)
    assert names[0] == names[2] == "" and "2 times mode 1" in names[1] and "sideband" in names[3]
    assert "lamp" in names[4] and "steady" in names[5]
    assert alias_candidates(60.0, 960.0) == (900.0, 1020.0)


def test_a_dropped_frame_breaks_the_decay():
    times = np.arange(400) / 480
    rng = np.random.default_rng(2)
    history = 200 * np.exp(POLES[0] * times).imag
    whole = FreeDecay((history + rng.standard_normal(400))[:, None], np.ones((1, 1)), np.ones(1), 0, 480.0)
    cut = FreeDecay((np.delete(history, 150)[:399] + rng.standard_normal(399))[:, None], np.ones((1, 1)), np.ones(1), 0, 480.0)
    assert find_break(whole, POLES[:1])[1] < 40
    at, gain = find_break(cut, POLES[:1])
    assert abs(at - 150) < 12 and gain > 1000


def test_two_planes_share_their_common_direction():
    rng = np.random.default_rng(3)
    x, y, z = (rng.standard_normal((4, 2)) for _ in range(3))
    turn = np.array([0.3 - 2j, 1.7j])
    labels = (lambda way: [f"{k}:{way}" for k in range(4)])
    first = Modes([13.0, 64.0], [0.02, 0.015], np.concatenate([x, z]), labels("+x") + labels("-z"), "unscaled")
    second = Modes([13.01, 64.1], [0.02, 0.015], np.concatenate([y, z]) * turn, labels("+y") + labels("-z"), "unscaled")
    joined = join_views(first, second)
    np.testing.assert_allclose(joined.modes.shape_at(labels("+y")), y, atol=1e-12)
    assert joined.pairs == ((0, 0), (1, 1))
    flat = Modes([13.0], [0.02], np.concatenate([x[:, :1], 1e-3 * z[:, :1]]), labels("+x") + labels("-z"), "unscaled",
                 shape_variance=np.full((8, 1), 1e-4))
    with pytest.raises(ToolpointError, match="common direction"):
        join_views(flat, second)
