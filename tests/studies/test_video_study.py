"""Videos to modes to the machine: poles with intervals, records beside the camera, two planes that update a machine."""

import json
from pathlib import Path

import numpy as np
import pytest
import video_scenes as scenes

from toolpoint import Modes, ToolpointError
from toolpoint.app.main import main
from toolpoint.io import read_machine, read_modes
from toolpoint.studies.machines.virtual_test import MeasuringPoints, true_modes
from toolpoint.studies.video.filmed_machine import FilmedMachine
from toolpoint.studies.video.interfaces import rank_interfaces
from toolpoint.studies.video.machine_view import body_regions
from toolpoint.studies.video.record_poles import poles_of
from toolpoint.studies.video.video_study import study_video
from toolpoint.studies.video.video_update import seen_places
from toolpoint.studies.video.virtual_update import FILMED_TRUTH, update_from_virtual_videos
from toolpoint.studies.video.virtual_video import film_machine
from toolpoint.vibration import Record
from toolpoint.vibration.correlation import pair_modes
from toolpoint.vision.clip import Clip, FrameArray, Region
from toolpoint.vision.rendering.scene import Camera
from toolpoint.vision.view import View

MILL = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/small_mill.yaml"


@pytest.fixture(scope="module")
def frames():
    rng = np.random.default_rng(41)
    scene = scenes.c_frame(rng)
    return scene, np.concatenate(list(scenes.filmed(scene, rng).chunks()))


@pytest.fixture(scope="module")
def study(frames):
    scene, array = frames
    return study_video(Clip(FrameArray(array), scenes.RATE), points=80, bodies=scenes.regions(scene))


@pytest.mark.slow
def test_poles_lie_within_their_intervals(study):
    modes = study.modes
    assert modes.count == 2 and study.gives_damping and study.doubts == ()
    # Three standard deviations: this test must not fail once in twenty times.
    assert (np.abs(modes.frequency - scenes.FREQUENCIES) < 1.6 * modes.frequency_interval).all()
    assert (np.abs(modes.damping_ratio - scenes.RATIOS) < 1.6 * modes.damping_interval).all()
    assert modes.frequency_interval.max() < 0.05


def test_the_result_is_plain_data_with_what_is_not_known(study):
    data = json.loads(json.dumps(study.to_dict()))
    assert data["accepts_amplitude"] and len(data["frequency_hz"]) == study.poles.count
    assert "480" in study.table() or "458" in study.table()  # the alias of the first mode


def test_modes_without_a_scale_say_that_they_have_no_places(study):
    """A file of modes without places joins no geometry, and whoever reads it later does not see why."""
    (name, kept), = FilmedMachine((study,)).nouns.items()
    assert name == "modes" and kept.notes[-1].startswith("places of the points are not in the file")


def test_shapes_at_places_are_in_metres(frames, study):
    scene, _ = frames
    view = View("+x", "-z", 1e-3, (0.0, 176.0))
    from dataclasses import replace

    scaled = replace(study, view=view)
    body = scene.bodies[1]
    place = view.locate(np.array([body.centre]))[0]
    modes = scaled.modes_at({"tip": ("head", place)})
    truth = 1e-3 * body.shape_at(np.array([body.centre]))[0]
    np.testing.assert_allclose(np.abs(modes.shape), np.abs(truth), atol=3e-6)
    assert [str(dof) for dof in modes.dofs] == ["tip:+x", "tip:-z"]
    with pytest.raises(ToolpointError, match="no body 'table'"):
        scaled.modes_at({"t": ("table", place)})
    places = scaled.places.points
    assert {dof.point for dof in scaled.modes.dofs} <= set(places) and study.places is None
    np.testing.assert_allclose(view.project(np.array(list(places.values()))), study.points.windows.centres, atol=1e-6)


def test_poles_of_a_record_serve_above_half_the_frame_rate(frames):
    """Every third frame: 160 frames/s see 71 Hz, half the rate is 80 Hz; every fifth, 96 frames/s, see it as 25 Hz."""
    scene, array = frames
    poles = Modes(scenes.FREQUENCIES, scenes.RATIOS, np.ones((1, 2)), ["sensor:+x"], "unscaled")
    slow = Clip(FrameArray(np.ascontiguousarray(array[::5])), scenes.RATE / 5)
    result = study_video(slow, points=80, bodies=scenes.regions(scene), poles=poles)
    head = next(body for body in result.bodies if body.name == "head")
    places = np.array(scene.bodies[1].centre)[None]
    # The decay begins at a later frame: amplitudes there are those of the blow times the pole's own factor.
    later = np.abs(np.exp(poles.poles * result.decay.first * 5 / scenes.RATE))
    np.testing.assert_allclose(np.abs(head.shape_at(places)[0]), np.abs(scene.bodies[1].shape_at(places)[0]) * later, atol=8e-3)
    assert result.gives_damping and result.source == "record"


def test_poles_of_an_accelerometer_beside_the_camera():
    rate, times = 2000.0, np.arange(4000) / 2000.0
    omega = 2 * np.pi * np.array([50.0, 300.0])
    history = sum(np.exp(-0.01 * w * times) * np.sin(w * times) for w in omega)
    samples = np.column_stack([history, 0.3 * history]) + 1e-3 * np.random.default_rng(1).standard_normal((4000, 2))
    modes = poles_of(Record(samples, rate, ("a:+x", "b:+x"), "acceleration"))
    np.testing.assert_allclose(modes.frequency, [50, 300], rtol=1e-4)
    np.testing.assert_allclose(modes.damping_ratio, 0.01, rtol=0.02)


@pytest.mark.slow
def test_a_rolling_shutter_that_was_not_stated_is_doubted():
    rng = np.random.default_rng(42)
    scene = scenes.c_frame(rng, amplitude=0.5)
    clip = scenes.filmed(scene, rng, row_delay=1.5e-3 / scenes.SHAPE[0], frames=256)
    result = study_video(Clip(clip.source, clip.frame_rate), points=80)
    assert any(text.startswith("shutter") and "seems to roll" in text for text in result.doubts)
    stated = study_video(clip, points=80)
    assert not any("seems to roll" in text for text in stated.doubts)


def test_bodies_of_a_machine_are_where_the_view_puts_them():
    machine = read_machine(MILL)
    view = View.of_plane("yz", 2.5e-3, (192.0, 400.0))
    regions = body_regions(machine, view, (432, 384))
    column = regions["column"]
    assert column.left == pytest.approx(192 + 0.04 / 2.5e-3, abs=3) and column.top == pytest.approx(400 - 0.82 / 2.5e-3, abs=3)
    with pytest.raises(ToolpointError, match="no body of the machine"):
        body_regions(machine, View.of_plane("yz", 2.5e-3, (9000.0, 0.0)), (432, 384))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["templates", "phase"])
def test_two_planes_find_the_soft_joints_and_update_the_machine(method):
    result = update_from_virtual_videos(read_machine(MILL), FILMED_TRUTH, "spindle_nose", rng=np.random.default_rng(3),
                                        method=method)
    assert set(result.update.ranking.moving) == {"floor_base", "column_housing"}
    assert [entry.joint for entry in result.update.ranking.interfaces[2:]] == ["base_column", "base_cross_slide"]
    assert result.frac[:, 0].max() < 0.5 and result.frac[:, 1].min() > 0.95
    # Modes of the video beside those of a hammer at the same points, which the undamped truth stands for.
    truth = read_machine(MILL).with_values(FILMED_TRUTH)
    for video in result.videos:
        seen = video.modes_at(seen_places(truth, video))
        points = MeasuringPoints({name: seen_places(truth, video)[name] for name in dict.fromkeys(d.point for d in seen.dofs)})
        hammer = true_modes(truth, points, 0.02)
        assert pair_modes(seen, hammer, 0.9, frequency_shift=0.01).values.min() > 0.98


@pytest.mark.slow
def test_a_body_without_texture_leaves_its_joints_unknown():
    machine = read_machine(MILL).with_values(FILMED_TRUTH)
    view = View.of_plane("xz", 2.5e-3, (192.0, 400.0))
    video = film_machine(machine, view, "spindle_nose:+x", rng=np.random.default_rng(4), camera=Camera((432, 384)), frames=400,
                         textured={"housing": False})
    result = study_video(video.clip, view=view, bodies=video.regions, band=(5, 100))
    ranking = rank_interfaces(machine, [result])
    verdicts = {entry.joint: entry.verdict for entry in ranking.interfaces}
    assert verdicts["column_housing"].startswith("unknown") and any("housing" in text for text in ranking.doubts)


@pytest.mark.slow
def test_the_command_reads_a_clip_and_writes_page_and_magnified_frames(frames, tmp_path, capsys):
    _, array = frames
    np.save(tmp_path / "clip.npy", array)
    arguments = ["video", str(tmp_path / "clip.npy"), "--fps", "480", "--points", "60", "--body", "head=96,40,84,60",
                 "-o", str(tmp_path / "page"), "--magnify", str(tmp_path / "m.gif"), "--factor", "10", "-m",
                 str(tmp_path / "modes.h5")]
    main(arguments)
    shown = capsys.readouterr().out
    assert "places of the points are not in the file of modes" in shown
    assert "poles from the video" in shown and "body head" in shown and (tmp_path / "m.gif").stat().st_size > 1000
    assert read_modes(tmp_path / "modes.h5").count == 2
    page = (tmp_path / "page" / "index.html").read_text()
    assert "data:image/webp" in page and "Spectrum of the point" in page
    assert "http" not in page.split("<script")[0].split("<body>")[1]
    main([*arguments[:6], "--json", "-o", str(tmp_path / "page")])
    data = json.loads(capsys.readouterr().out)["videos"][0]
    assert data["accepts_amplitude"] and data["frequency_hz"][0] == pytest.approx(22, abs=0.05)
    with pytest.raises(SystemExit):
        main(["video", str(tmp_path / "clip.npy"), "--fps", "480", "--region", "1,2,3"])
    assert "left,top,width,height" in capsys.readouterr().err


def test_a_region_is_within_the_picture():
    with pytest.raises(ToolpointError, match="must lie within"):
        Region(0, 0, 300, 20).within((100, 200))
