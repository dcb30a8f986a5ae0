"""Poor clips: windows that know nothing, orders averaged, missing frames, little motion, lines that the camera makes."""

from dataclasses import replace

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint import Modes, ToolpointError
from toolpoint.vibration import Dof
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.background import CameraMotion
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import BLIND_SIGHT, FULL_SIGHT, Windows, windows_at
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.magnification.reached import measure_gain
from toolpoint.vision.magnification.warp import ShapeWarp
from toolpoint.vision.modes.artefacts import name_artefacts, shake_lines
from toolpoint.vision.modes.bodies import fit_bodies
from toolpoint.vision.modes.body_orders import average_orders
from toolpoint.vision.modes.decay import FreeDecay, decay_of, find_decay
from toolpoint.vision.modes.full_field import full_field
from toolpoint.vision.modes.jumps import find_jump
from toolpoint.vision.modes.lines import lamps_everywhere, name_modes
from toolpoint.vision.modes.pooling import pool_windows
from toolpoint.vision.modes.projection import PointShapes, decay_basis

RATE, FRAMES = 480.0, 400
POLES = scenes.POLES


def grid(rows, columns, side=12):
    """Windows side by side that see both ways."""
    at = side * np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1).reshape(-1, 2)
    n = len(at)
    return Windows(at, side, np.full(n, FULL_SIGHT), np.tile([1.0, 0.0], (n, 1)), np.full((n, 2), 0.1), np.zeros(n))


def test_a_window_that_noise_explains_as_well_as_motion_is_left_out_and_a_box_on_a_plain_wall_is_unknown(case):
    _, scanned = case
    plain = np.array([[150, 120], [150, 136], [134, 120], [134, 136]])
    seen = windows_at(scanned.reference, np.array([[60, 120], *plain]), 16)
    told = Windows(seen.corners, 16, np.full(5, FULL_SIGHT), seen.normal, np.full((5, 2), 0.1), seen.saturated)
    field = measure(scanned, told)
    assert field.windows.sight.tolist() == [FULL_SIGHT, *[BLIND_SIGHT] * 4] and "4 of 5 windows are left out" in field.doubts[0]
    assert (np.linalg.eigvalsh(field.covariance[0]) > 0).all() and not field.covariance[1:].any()
    whole = full_field(scanned, POLES)
    seeing = whole.windows.sight == FULL_SIGHT
    assert (np.linalg.eigvalsh(whole.shapes.covariance[seeing])[:, 0] > 0).all()
    wall = fit_bodies(whole.windows, whole.shapes, {"wall": Region(110, 118, 90, 54)})[0]
    assert set(wall.orders) == {"unknown"} and "not known" in wall.doubts[0]


def test_a_variance_that_is_not_positive_does_not_decide_the_motion_of_a_body():
    windows = grid(4, 4)
    basis = decay_basis(POLES[:1], np.arange(FRAMES) / RATE)
    shape = np.tile(np.array([[[0.2 + 0j], [0.1 + 0j]]]), (16, 1, 1))
    shape[5] = 40.0
    covariance = np.tile(1e-4 * np.eye(2), (16, 1, 1))
    covariance[5] = [[-1e-4, 0.0], [0.0, 1e-6]]
    body = fit_bodies(windows, PointShapes(shape, covariance, basis, np.ones(16)), {"b": Region(0, 0, 48, 48)})[0]
    np.testing.assert_allclose(body.shape_at(np.array([[24.0, 24.0]]))[0, :, 0], [0.2, 0.1], atol=0.01)


def test_intervals_hold_whatever_the_bending_because_the_order_belongs_to_them():
    """Bending about the noise: an order that is picked says nothing of it, an average holds it."""
    rng = np.random.default_rng(4)
    places = rng.uniform(-1, 1, (40, 2))
    a, b = places.T
    terms = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=1)
    none = np.zeros_like(terms)
    design = np.concatenate([np.concatenate([terms, none], axis=1), np.concatenate([none, terms], axis=1)]) / 0.01
    corner = np.array([1, 0.7, 0.7, 0.49, 0.49, 0.49, *np.zeros(6)])
    held, narrow = [], []
    for _ in range(300):
        theta = np.zeros((12, 2))
        theta[[0, 6]], turn = rng.normal(0, 0.3, (2, 2)), rng.normal(0, 0.2, 2)
        theta[7], theta[2] = turn, -turn
        theta[1:6] += np.exp(rng.uniform(np.log(5e-4), np.log(0.03))) * rng.normal(0, 1, (5, 2))
        motion = average_orders(design, design @ theta + rng.standard_normal((80, 2)))
        sd = np.sqrt(corner @ motion.covariance @ corner)
        held += (np.abs(corner @ (motion.coefficients - theta)) < 1.96 * sd).tolist()
        narrow.append(sd)
    assert 0.91 < np.mean(held) < 0.99
    # Less than the largest order would know it by: the average is worth its trouble.
    whole = np.linalg.inv(design.T @ design)
    assert np.median(narrow) < 0.9 * np.sqrt(corner @ whole @ corner)


def test_a_missing_frame_is_named_exactly_and_a_flash_is_none():
    rng = np.random.default_rng(2)
    times = np.arange(401) / RATE
    history = np.stack([200 * np.exp(p * times).imag for p in POLES], axis=1)

    def decay(values):
        return FreeDecay(values[:400] + rng.standard_normal((400, 2)), np.ones((2, 2)), np.ones(2), 7, RATE)
    assert find_jump(decay(history)) is None
    for dropped in (60, 150, 287):
        jump = find_jump(decay(np.delete(history, dropped, 0)))
        assert jump.frame == 7 + dropped and jump.missing_frames == 1
    again = find_jump(decay(np.insert(history, 120, history[120], 0)))
    assert abs(again.frame - 127) <= 1 and again.missing_frames == -1
    flashed = history.copy()
    flashed[200] += 150.0
    assert find_jump(decay(flashed)) is None


def test_motion_that_no_window_sees_is_found_where_they_are_pooled():
    rng = np.random.default_rng(5)
    windows = grid(16, 24)
    n = len(windows.corners)
    wave = np.exp(POLES[0] * np.arange(FRAMES) / RATE).imag
    values = 0.006 * wave[:, None, None] + 0.1 * rng.standard_normal((FRAMES, n, 2))
    field = DisplacementField(windows, values.astype(np.float32), np.tile(0.01 * np.eye(2), (n, 1, 1)), RATE, 0.0,
                              np.zeros(n, int), "made up")
    with pytest.raises(ToolpointError, match="no motion stands out"):
        find_decay(field, 0.0)
    decay = decay_of(pool_windows(field, {"b": Region(0, 0, 300, 200)}), RATE, start=0.0)
    _, spectrum = decay.spectrum()
    line = np.abs(spectrum[:, 0]).argmax() * RATE / FRAMES
    assert abs(line - scenes.FREQUENCIES[0]) < 1.5 * RATE / FRAMES


def modes(frequency, size, half=0.05):
    count = len(frequency)
    covariance = np.tile(np.diag([(half / 1.96) ** 2, 1e-8]), (count, 1, 1))
    return Modes(frequency, [0.01] * count, np.array([size]), (Dof("1", "+x"),), "unscaled", covariance=covariance)


def test_lines_that_the_camera_makes_are_named_and_true_ones_are_not():
    found = modes([48.0, 82.0, 31.0, 48.05, 46.0, 140.0], [1.0, 0.4, 0.6, 0.1, 0.05, 0.01])
    names = name_artefacts(found, [""] * 6, 260.0, resolution=0.3, is_lossy=True, shake=(2.0,))
    assert names[:3] == ("", "image of mode 1 (48 Hz): compressed frames alternate in kind", "")
    assert "mode 1 (48 Hz) seen twice" in names[3] and "sideband of mode 1" in names[4] and "errors of following" in names[5]
    assert name_artefacts(modes([48.0, 82.0], [1.0, 0.4]), [""] * 2, 260.0, resolution=0.3, is_lossy=False) == ("", "")


def test_products_of_motion_shake_and_split_modes_are_named():
    """Modes at 21 and 30.5 Hz and their difference 50 times fainter; a line of the shake; two modes within one line."""
    found = modes([9.55, 21.0, 30.5, 41.0], [0.01, 0.5, 0.5, 0.01])
    assert name_modes(found, (), 260.0, resolution=0.3) == ("",) * 4  # it rings on longer than either
    names = name_modes(replace(found, damping_ratio=[0.04, 0.01, 0.01, 0.01]), (), 260.0, resolution=0.3)
    assert names[0].startswith("difference of modes 2 and 3") and names[1:] == ("", "", "")
    for size, is_harmonic in ((0.02, True), (0.1, False)):
        told = name_modes(modes([32.84, 65.8], [1.0, size], 0.02), (), 260.0, resolution=0.3)
        assert told[1].startswith("2 times mode 1") == is_harmonic
    equals = modes([9.5, 21.0, 30.5], [0.1, 0.5, 0.5])
    assert name_modes(equals, (), 260.0, resolution=0.3) == ("", "", "")
    shaken = name_artefacts(modes([4.0, 48.0], [0.2, 1.0]), [""] * 2, 260.0, resolution=0.3, is_lossy=False, shake=(2.0,))
    assert shaken == ("the camera's shake", "")
    split = modes([7.2, 7.4, 20.0], [1.0, 0.5, 0.7])
    for is_lossy in (False, True):
        told = name_artefacts(split, [""] * 3, 260.0, resolution=0.5, is_lossy=is_lossy)
        assert [("split one mode" in name) for name in told] == [is_lossy, is_lossy, False]


def test_the_camera_keeps_on_shaking_and_a_machine_dies_out():
    times = np.arange(FRAMES) / RATE

    def camera(motion):
        return CameraMotion(np.stack([motion, 0 * motion, 0 * motion]), np.ones(2), np.zeros(2), 100.0, 1.0, 10.0)
    shaking = camera(0.3 * np.sin(2 * np.pi * 4.8 * times))
    assert not shaking.fades and camera(np.exp(POLES[1] * times).imag).fades
    assert shake_lines(shaking, RATE)[0] == pytest.approx(4.8, abs=0.7) and shake_lines(None, RATE) == ()
    windows = grid(2, 2)
    covariance = np.tile(1e-4 * np.eye(2), (4, 1, 1))
    for share in (1.0, 3.0):
        values = np.zeros((FRAMES, 4, 2), np.float32)
        values[:, :, 0] = share * shaking.motion[0][:, None]
        field = DisplacementField(windows, values, covariance, RATE, 0.0, np.zeros(4, int), "made up")
        assert shaking.shared_by(field) == pytest.approx(share, abs=1e-3)


def test_a_lamp_lights_the_whole_picture_and_motion_its_edges():
    times, rng = np.arange(480) / RATE, np.random.default_rng(1)
    level = 100 + 0.05 * rng.standard_normal((480, 6, 8))
    lamp = level * (1 + 0.01 * np.sin(2 * np.pi * 100 * times))[:, None, None]
    moving = level.copy()
    moving[:, 2, 3:5] += 8 * np.sin(2 * np.pi * 31 * times)[:, None]
    assert lamps_everywhere((100.0,), lamp, RATE) == (100.0,) and lamps_everywhere((31.0,), moving, RATE) == ()


@pytest.mark.slow
def test_what_lies_outside_the_stated_bodies_is_magnified_too():
    rng = np.random.default_rng(31)
    scene = scenes.c_frame(rng, amplitude=0.05)
    scanned = scan(scenes.filmed(scene, rng))
    whole = full_field(scanned, POLES)
    head = fit_bodies(whole.windows, whole.shapes, {"head": scenes.regions(scene)["head"]})
    for bodies in (head, fit_bodies(whole.windows, whole.shapes, scenes.regions(scene))):
        assert measure_gain(ShapeWarp(scanned, POLES, bodies, whole), 0, 20.0) == pytest.approx(20, rel=0.1)
