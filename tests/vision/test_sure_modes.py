"""What a video is sure of: windows that wander, onset in noise, lamps that do not fade, intervals by windows, regions."""

from dataclasses import replace

import numpy as np
import pytest
import video_scenes as scenes
from scipy.optimize import least_squares

from toolpoint import Modes
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT, Windows, windows_at
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.modes.bodies import fit_bodies
from toolpoint.vision.modes.decay import FreeDecay, find_decay
from toolpoint.vision.modes.full_field import full_field
from toolpoint.vision.modes.lines import lamps_alone, name_modes
from toolpoint.vision.modes.projection import decay_basis
from toolpoint.vision.modes.rate import doubt_rate
from toolpoint.vision.modes.scatter import inflate_by_loss, inflate_by_windows

OMEGA = 2 * np.pi * np.array(scenes.FREQUENCIES)
POLES = OMEGA * (-np.array(scenes.RATIOS) + 1j * np.sqrt(1 - np.array(scenes.RATIOS) ** 2))
RATE, FRAMES = 480.0, 400


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(11)
    scene = scenes.c_frame(rng)
    return scene, scan(scenes.filmed(scene, rng))


def widened(modes, field):
    """Poles as wide as the windows of a whole decay scatter."""
    return inflate_by_windows(modes, field, first=0, count=FRAMES)


def field_of(values, sigma=0.02):
    """A field of windows that see both ways, from (frames, n, 2)."""
    n = values.shape[1]
    at = np.stack([np.arange(n), np.arange(n)], axis=1) * 24
    windows = Windows(at, 24, np.full(n, FULL_SIGHT), np.tile([1.0, 0.0], (n, 1)), np.full((n, 2), sigma), np.zeros(n))
    return DisplacementField(windows, values.astype(np.float32), np.tile(sigma**2 * np.eye(2), (n, 1, 1)), RATE, 0.0,
                             np.zeros(n, int), "made up")


def ringing(n, rng, *, blow=0, noise=0.02, poles=POLES[:1]):
    """Displacement (frames, n, 2) of windows that ring from a frame on, each by a motion of its own."""
    times = (np.arange(FRAMES) - blow) / RATE
    wave = np.where(times[:, None] >= 0, np.exp(poles * np.maximum(times, 0)[:, None]).imag, 0.0)
    motion = rng.uniform(0.1, 0.3, (poles.size, n, 2))
    return np.einsum("tr,rni->tni", wave, motion) + noise * rng.standard_normal((FRAMES, n, 2)), wave, motion


def modes_of(poles, frequency=1e-3, ratio=1e-5):
    size = np.abs(poles)
    cov = np.tile(np.diag([frequency**2, ratio**2]), (poles.size, 1, 1))
    return Modes(size / 2 / np.pi, -poles.real / size, np.ones((1, poles.size)), ["s:+x"], "unscaled", covariance=cov)


def test_a_window_that_an_edge_only_reaches_into_is_blind(case):
    """The head's left rim stands at column 95.5; a window that ends a pixel beyond it holds the rim's blur alone."""
    _, scanned = case
    side, rim = 24, 180  # right rim of the head: columns 96 .. 179, the wall beyond is plain
    inside, outside = np.array([[56, rim - side // 2]]), np.array([[56, rim - 1]])
    assert windows_at(scanned.reference, inside, side).sight[0] > BLIND_SIGHT
    assert windows_at(scanned.reference, outside, side).sight[0] == BLIND_SIGHT


def test_a_method_that_sees_no_edge_leaves_it_out(case):
    _, scanned = case
    windows = windows_at(scanned.reference, np.array([[60, 120], [70, 140]]), 21)
    sight = np.array([FULL_SIGHT, EDGE_SIGHT])
    edge = Windows(windows.corners, 21, sight, windows.normal, windows.bound, windows.saturated)
    field = measure(scanned, edge, "lucas-kanade")
    _, sigma, window, _ = field.measured()
    assert (sigma > 0).all() and set(window.tolist()) == {0}


def test_a_decay_begins_after_the_blow_also_in_noise():
    """Noise of twice the motion: begun before the blow, the decay's damping came out at half its value."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        values, *_ = ringing(40, rng, blow=120, noise=0.4)
        first = find_decay(field_of(values, 0.4)).first
        assert 118 <= first <= 145


def test_a_mode_that_fades_is_no_lamp():
    modes = modes_of(POLES, 0.02, 1e-4)
    lamp = (scenes.FREQUENCIES[1] + 0.4,)
    assert name_modes(modes, lamp, RATE, resolution=1.2) == ("", "")
    steady = Modes([scenes.FREQUENCIES[1]], [5e-4], np.ones((1, 1)), ["s:+x"], "unscaled",
                   covariance=np.diag([1e-4, 1e-8])[None])
    assert "lamp" in name_modes(steady, lamp, RATE, resolution=1.2)[0]
    # Bodies over a bright wall change the brightness at their own frequency; what no mode explains stays a lamp.
    assert lamps_alone((scenes.FREQUENCIES[1], 150.0), modes, RATE, resolution=1.2) == (150.0,)


def test_errors_of_windows_that_repeat_with_the_motion_widen_the_intervals():
    """Every window rings at a frequency of its own about the common one: the common pole is known as well as their mean."""
    rng, spread = np.random.default_rng(3), 0.3
    times, motion = np.arange(FRAMES) / RATE, rng.uniform(0.1, 0.3, (60, 2))
    own = spread * rng.standard_normal(60)
    wave = np.exp(POLES[0] * times[:, None] + 1j * own * times[:, None]).imag
    bent = wave[:, :, None] * motion + 0.002 * rng.standard_normal((FRAMES, 60, 2))
    stated = modes_of(POLES[:1], 1e-6, 1e-8)
    weight = (motion**2).sum(axis=1) / (motion**2).sum()
    expected = 1.96 * spread * np.sqrt((weight**2).sum()) / (2 * np.pi)
    assert widened(stated, field_of(bent, 0.002)).frequency_interval[0] == pytest.approx(expected, rel=0.35)
    clean = np.exp(POLES[0] * times).imag[:, None, None] * motion + 0.002 * rng.standard_normal((FRAMES, 60, 2))
    assert widened(stated, field_of(clean, 0.002)).frequency_interval[0] < 0.1 * expected
    # Never narrower than stated, and an error that all windows share is not taken away by their number.
    wide = modes_of(POLES[:1], 1.0, 1e-2)
    assert widened(wide, field_of(clean, 0.002)).frequency_interval[0] == wide.frequency_interval[0]
    shaken = replace(field_of(clean, 0.002), common=np.full(2, 0.02**2))
    few = replace(field_of(clean[:, :15], 0.002), common=np.full(2, 0.02**2))
    whole, part = (widened(stated, field).frequency_interval[0] for field in (shaken, few))
    assert part == pytest.approx(whole, rel=0.4)
    assert whole > 3 * widened(stated, field_of(clean, 0.002)).frequency_interval[0]


def test_compression_widens_by_what_the_noise_lost():
    modes = modes_of(POLES)
    wider = inflate_by_loss(modes, 0.2)
    # At x264 quality 10 damping came out up to 37 % too large.
    assert (wider.damping_interval > 0.5 * modes.damping_ratio).all()
    # Without it, by the share to which windows follow a decay: 3.5 intervals off without it in a random film.
    clean = inflate_by_loss(modes, 0.0)
    share = clean.damping_interval / modes.damping_ratio
    assert share.min() > 0.01 and share.max() < 0.02


@pytest.mark.parametrize("rate", [0.5, 1.03, 1.1, 2.0])
def test_a_rate_that_a_record_contradicts_is_named(rate):
    rng, times = np.random.default_rng(4), np.arange(FRAMES) / RATE
    history = 40 * np.exp(POLES * times[:, None]).imag @ rng.uniform(0.5, 1, (2, 3)) + rng.standard_normal((FRAMES, 3))
    told = FreeDecay(history, np.ones((1, 3)), np.ones(3), 0, rate * RATE)
    doubt, = doubt_rate(told, POLES)
    assert doubt.what == "frame rate" and doubt.figure == pytest.approx(abs(1 / rate - 1), abs=0.01)
    assert doubt_rate(FreeDecay(history, np.ones((1, 3)), np.ones(3), 0, RATE), POLES) == ()
    lacking, = doubt_rate(FreeDecay(history, np.ones((1, 3)), np.ones(3), 0, RATE), POLES[:1])
    assert lacking.what == "record"


def test_a_region_that_holds_parts_of_others_is_doubted(case):
    scene, scanned = case
    decay = 5
    field = full_field(scanned, POLES, decay, side=12)
    right = fit_bodies(field.windows, field.shapes, scenes.regions(scene))
    assert [body.doubts for body in right] == [(), ()]
    both = fit_bodies(field.windows, field.shapes, {"head": Region(44, 40, 136, 60)}, orders=("translation", "rigid"))
    assert "do not move as one body" in both[0].doubts[0]


def fitted_pole(field):
    """The pole of least squares over all channels, from the true one on."""
    values = field.measured()[0]
    times = np.arange(FRAMES) / RATE

    def residual(part):
        return decay_basis(np.array([complex(*part)]), times).residual(values).ravel()

    start = np.array([POLES[0].real, POLES[0].imag])
    return np.array([complex(*least_squares(residual, start, x_scale=[1.0, 1.0]).x)])


def test_where_two_windows_decide_a_pole_its_interval_still_holds():
    """Windows err in proportion to their motion (texture, light); two of six move, so that errors hardly average out."""
    rng, inside = np.random.default_rng(3), []
    times = np.arange(FRAMES) / RATE
    size = np.array([0.3, 0.25, 0.03, 0.03, 0.02, 0.02])
    for _ in range(40):
        wave = np.exp(POLES[:1] * (1 + 0.002 * rng.standard_normal((6, 1))) * times).imag  # each window's own error of the pole
        motion = size[:, None] * rng.uniform(0.7, 1.3, (6, 2))
        values = wave.T[:, :, None] * motion + 0.002 * rng.standard_normal((FRAMES, 6, 2))
        field = field_of(values, sigma=0.002)
        pole = fitted_pole(field)
        modes = widened(modes_of(pole, 1e-6, 1e-9), field)
        inside.append(abs(modes.frequency[0] - OMEGA[0] / 2 / np.pi) <= modes.frequency_interval[0])
    assert np.mean(inside) >= 0.85
