"""Magnification: linear in the factor, still where nothing moves, edges where they are."""

from itertools import islice

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint import ToolpointError
from toolpoint.vision.clip import clip_of
from toolpoint.vision.displacement.measure import measure, scan
from toolpoint.vision.displacement.points import windows_at
from toolpoint.vision.magnification.edges import find_edges, overlay
from toolpoint.vision.magnification.phase_based import PhaseMagnification
from toolpoint.vision.magnification.pyramid import SteerablePyramid
from toolpoint.vision.magnification.warp import ShapeWarp
from toolpoint.vision.magnification.writing import encode_moving, encode_picture, write_frames
from toolpoint.vision.modes.bodies import fit_bodies
from toolpoint.vision.modes.full_field import full_field
from toolpoint.vision.rendering.scene import TEXTURE_MARGIN, Camera, RenderedFrames
from toolpoint.vision.rendering.texture import random_texture

OMEGA = 2 * np.pi * np.array(scenes.FREQUENCIES)
POLES = OMEGA * (-np.array(scenes.RATIOS) + 1j * np.sqrt(1 - np.array(scenes.RATIOS) ** 2))
SMALL = 0.15


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(31)
    scene = scenes.c_frame(rng, amplitude=SMALL)
    wall = random_texture((scenes.SHAPE[0] + 2 * TEXTURE_MARGIN, scenes.SHAPE[1] + 2 * TEXTURE_MARGIN), rng, contrast=12.0,
                          grey=190.0)
    scene = type(scene)(scene.bodies, scene.amplitudes, wall)
    scanned = scan(scenes.filmed(scene, rng))
    whole = full_field(scanned, POLES)
    return scene, scanned, ShapeWarp(scanned, POLES, fit_bodies(whole.windows, whole.shapes, scenes.regions(scene)), whole)


def motion(frames, scanned, corner):
    """Right motion of a window over magnified frames, measured against the picture at rest."""
    clip = clip_of(np.stack(frames), scenes.RATE)
    field = measure(type(scanned)(clip, type(scanned.survey)(**{**vars(scanned.survey), "frames": len(frames)}),
                                  scanned.reference), windows_at(scanned.reference, np.array([corner]), 25))
    return field.values[:, 0, 0]


@pytest.mark.slow
def test_motion_is_linear_in_the_factor_and_the_wall_stands_still(case):
    scene, scanned, warp = case
    numbers = range(4, 40)
    base = scene.amplitudes(np.arange(4, 40) / scenes.RATE)
    centre = np.array([[54 + 12.0, 40 + 12.0]])
    per_mode = scene.bodies[0].shape_at(centre)[0, 0]
    for factor in (1.0, 5.0, 15.0):
        frames = list(warp.frames(0, factor, numbers=numbers))
        truth = base[:, 0] * per_mode[0] * factor + base[:, 1] * per_mode[1]
        seen = motion(frames, scanned, (40, 54))
        assert (seen * truth).sum() / (truth**2).sum() == pytest.approx(1, abs=0.05)
        wall = motion(frames, scanned, (140, 120))
        assert np.abs(wall - wall.mean()).max() < 0.02


@pytest.mark.slow
def test_magnified_frames_are_those_of_a_machine_that_moves_more(case):
    scene, _, warp = case
    base = scene.amplitudes
    more = RenderedFrames(scene.changed(lambda t: base(t) * np.array([15.0, 1.0])), Camera(scenes.SHAPE, scenes.RATE), 2)
    for number, frame in zip((8, 20), warp.frames(0, 15.0, numbers=(8, 20)), strict=True):
        error = frame - more.picture(number / scenes.RATE)
        assert 10 * np.log10(255**2 / (error**2).mean()) > 38


@pytest.mark.slow
def test_a_smooth_field_serves_where_no_bodies_are_stated(case):
    _, scanned, warp = case
    plain = ShapeWarp(scanned, POLES, (), warp.field)
    seen = motion(list(plain.frames(0, 8.0, numbers=range(4, 40))), scanned, (40, 54))
    layered = motion(list(warp.frames(0, 8.0, numbers=range(4, 40))), scanned, (40, 54))
    assert (seen * layered).sum() / (layered**2).sum() == pytest.approx(1, abs=0.1)


def test_the_pyramid_gives_back_every_picture():
    rng = np.random.default_rng(32)
    for shape in ((96, 128), (97, 121)):
        pyramid = SteerablePyramid.of_shape(shape)
        picture = rng.uniform(0, 255, shape)
        np.testing.assert_allclose(pyramid.join(*pyramid.split(picture)), picture, atol=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(("band", "factor", "gain"), [((14.0, 34.0), 6.0, 6.0), ((100.0, 150.0), 10.0, 1.0)])
def test_phase_magnification_moves_the_band_and_no_other(case, band, factor, gain):
    _, scanned, _ = case
    moved = list(islice(PhaseMagnification(*band, factor).frames(scanned), 140))
    original = motion(list(np.concatenate(list(scanned.clip.chunks())))[40:140], scanned, (40, 54))
    seen = motion(moved[40:140], scanned, (40, 54))
    assert (seen * original).sum() / (original**2).sum() == pytest.approx(gain, rel=0.25)


def test_a_band_above_half_the_rate_is_refused(case):
    _, scanned, _ = case
    with pytest.raises(ToolpointError, match="half the frame rate"):
        next(PhaseMagnification(200.0, 300.0, 5.0).frames(scanned))


def test_edges_are_where_the_step_is():
    picture = np.full((60, 80), 50.0)
    picture[:, 40:] = 200.0
    columns = np.flatnonzero(find_edges(picture).any(axis=0))
    assert set(columns) <= {39, 40} and columns.size
    assert not find_edges(np.full((60, 80), 50.0)).any()
    drawn = overlay(picture, np.roll(picture, 8, axis=1))
    assert drawn.shape == (60, 80, 3) and drawn.dtype == np.uint8


def test_frames_are_written_whole(tmp_path):
    frames = [np.full((20, 30), 10 * k, np.uint8) for k in range(5)]
    for name in ("a.gif", "a.webp", "a.mp4"):
        if name == "a.mp4":
            pytest.importorskip("av")
        assert write_frames(frames, tmp_path / name).stat().st_size > 50
    assert len(list(write_frames(frames, tmp_path / "images").iterdir())) == 5
    assert encode_picture(frames[0])[:4] == b"\x89PNG" and encode_moving(frames)[:4] == b"RIFF"
    with pytest.raises(ToolpointError, match="must end in"):
        write_frames(frames, tmp_path / "a.avi")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.gif", "a.mp4", "a.webp", "images"]


def test_a_mode_that_is_not_there_is_refused(case):
    _, _, warp = case
    with pytest.raises(ToolpointError, match=r"1 \.\. 2"):
        next(warp.frames(2, 10.0))
    with pytest.raises(ToolpointError, match="factor"):
        next(warp.frames(0, float("nan")))


@pytest.mark.parametrize("ending", [".gif", ".webp"])
def test_an_animation_that_would_fill_the_disk_is_refused_before_it_is_written(tmp_path, monkeypatch, ending):
    monkeypatch.setattr("toolpoint.vision.magnification.writing.MAX_ANIMATION_PIXELS", 3 * 20 * 30)
    frames = [np.zeros((20, 30), np.uint8)] * 4
    with pytest.raises(ToolpointError, match=r"over 3 frames of 30 x 20 pixels .*write \.mp4"):
        write_frames(frames, tmp_path / f"a{ending}")
    assert list(tmp_path.iterdir()) == []
    write_frames(frames[:3], tmp_path / f"a{ending}")
