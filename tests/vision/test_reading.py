"""Reading: every kind of file gives back its frames, every fault is said."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.measure import scan
from toolpoint.vision.displacement.quality import judge_quality
from toolpoint.vision.magnification.writing import write_frames
from toolpoint.vision.reading import files

RNG = np.random.default_rng(21)
FRAMES = RNG.integers(0, 256, (20, 40, 56), dtype=np.uint8)


def whole(clip, size=7):
    return np.concatenate(list(clip.chunks(size)))


def encoded(path, frames, codec="ffv1", times=None, rate=30, **options):
    av = pytest.importorskip("av")
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate)
        stream.height, stream.width = frames.shape[1:]
        stream.pix_fmt = "gray" if codec == "ffv1" else "yuv420p"
        stream.options = {name: str(value) for name, value in options.items()}
        for k, frame in enumerate(frames):
            grey = av.VideoFrame.from_ndarray(frame, format="gray")
            if codec != "ffv1":  # the luminance as it is, not squeezed into the range of television
                planes = np.full((frames.shape[1] * 3 // 2, frames.shape[2]), 128, np.uint8)
                planes[:frames.shape[1]] = frame
                grey = av.VideoFrame.from_ndarray(planes, format="yuv420p")
            grey.pts = k if times is None else int(times[k])
            container.mux(stream.encode(grey))
        container.mux(stream.encode())
    return path


def test_arrays_images_and_plain_frames_come_back(tmp_path):
    np.save(tmp_path / "a.npy", FRAMES)
    np.save(tmp_path / "b.npy", FRAMES.astype(">u2") * 16)
    FRAMES.tofile(tmp_path / "c.raw")
    write_frames(FRAMES, tmp_path / "images")
    write_frames(FRAMES.astype(np.uint16) * 257, tmp_path / "deep")
    for name, factor, options in (("a.npy", 1, {}), ("b.npy", 16, {"bits": 12}), ("c.raw", 1, {"shape": (40, 56)}),
                                  ("images", 1, {}), ("deep", 257, {})):
        clip = files.read(tmp_path / name, 500.0, **options)
        np.testing.assert_array_equal(whole(clip), FRAMES.astype(int) * factor)
        np.testing.assert_array_equal(whole(clip, 3), whole(clip, 20))
    part = files.read(tmp_path / "a.npy", 500.0, region=Region(8, 4, 24, 16))
    np.testing.assert_array_equal(whole(part), FRAMES[:, 4:20, 8:32])


def test_videos_come_back_and_are_decoded_once(tmp_path):
    clip = files.read(encoded(tmp_path / "a.mkv", FRAMES), 500.0)
    np.testing.assert_array_equal(whole(clip), FRAMES)
    assert clip.source.scratch.is_whole and not clip.is_lossy
    np.testing.assert_array_equal(whole(clip, 5), FRAMES)
    # Without room on disk it is decoded again.
    np.testing.assert_array_equal(whole(files.read(tmp_path / "a.mkv", 500.0, scratch=0)), FRAMES)


@pytest.mark.parametrize(("make", "words"), [
    (lambda p: p / "none.mp4", "cannot be read"), (lambda p: (p / "a.txt").write_text("x") and p / "a.txt", "must end in"),
    (lambda p: (p / "a.mp4").write_bytes(b"\0" * 999) and p / "a.mp4", "no video that can be read"),
    (lambda p: (p / "a.npy").write_bytes(b"\x93NUMPY\x01\0v\0{'descr'") and p / "a.npy", "no .npy file"),
    (lambda p: (p / "a.raw").write_bytes(b"\0" * 999) and p / "a.raw", "state rows and columns"),
    (lambda p: p, "images in")])
def test_faults_are_said(tmp_path, make, words):
    with pytest.raises(ToolpointError, match=words):
        whole(files.read(make(tmp_path), 500.0))


def test_cut_files_are_said(tmp_path):
    np.save(tmp_path / "a.npy", FRAMES)
    data = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(data[:-100])
    with pytest.raises(ToolpointError, match="it was cut"):
        files.read(tmp_path / "a.npy", 500.0)
    (tmp_path / "b.raw").write_bytes(data[128:-100])
    with pytest.raises(ToolpointError, match="whole number of frames"):
        files.read(tmp_path / "b.raw", 500.0, shape=(40, 56))
    video = encoded(tmp_path / "c.mp4", np.repeat(FRAMES, 3, axis=0), "libx264", crf=10)
    video.write_bytes(video.read_bytes()[:-20_000])
    with pytest.raises(ToolpointError, match=r"no video that can be read|cannot be decoded"):
        whole(files.read(video, 500.0))


def test_time_stamps_tell_missing_frames_and_a_variable_rate(tmp_path):
    from toolpoint.vision.displacement.survey import survey_clip

    gap = encoded(tmp_path / "gap.mkv", FRAMES, times=np.r_[np.arange(12), np.arange(15, 23)])
    assert any("3 frames are missing" in text for text in survey_clip(files.read(gap, 500.0)).doubts)
    uneven = encoded(tmp_path / "uneven.mkv", FRAMES, times=np.cumsum(RNG.integers(1, 4, 20)))
    assert any("variable frame rate" in text for text in survey_clip(files.read(uneven, 500.0)).doubts)
    even = encoded(tmp_path / "even.mkv", FRAMES)
    assert survey_clip(files.read(even, 500.0)).doubts == ()


def test_the_rate_of_the_player_is_doubted(tmp_path):
    video = encoded(tmp_path / "a.mkv", FRAMES)
    assert any("played" in text for text in files.read(video, 30.0).doubts)
    assert files.read(video, 960.0).doubts == ()


def test_a_turned_video_stands_upright(tmp_path):
    av = pytest.importorskip("av")
    source = encoded(tmp_path / "a.mp4", FRAMES, "libx264", crf=0)
    header = files.read(source, 500.0).source.header
    from dataclasses import replace

    clip = files.read(source, 500.0)
    turned = replace(clip.source, header=replace(header, turns=1))
    assert turned.shape == (56, 40)
    np.testing.assert_array_equal(next(turned.chunks(4))[0], np.rot90(next(clip.source.chunks(4))[0]))
    assert av.__version__


@pytest.mark.slow
def test_compression_that_smooths_noise_is_refused(tmp_path):
    rng = np.random.default_rng(22)
    import video_scenes as scenes

    frames = next(iter(scenes.filmed(scenes.c_frame(rng, contrast=8.0), rng, frames=120).chunks(120)))
    verdicts = {}
    for crf in (10, 18, 23):
        video = encoded(tmp_path / f"{crf}.mp4", frames, "libx264", crf=crf)
        verdicts[crf] = judge_quality(scan(files.read(video, 480.0)))
    assert verdicts[10].accepts_amplitude
    assert not verdicts[18].accepts_amplitude and not verdicts[23].accepts_amplitude
    assert "compressed too much" in verdicts[18].doubts[0]


def test_missing_images_and_odd_ones_are_said(tmp_path):
    write_frames(FRAMES, tmp_path / "images")
    (tmp_path / "images" / "frame_000007.png").unlink()
    assert "may be missing" in files.read(tmp_path / "images", 500.0).doubts[0]
    write_frames([FRAMES[0, :20]], tmp_path / "odd")
    (tmp_path / "odd" / "frame_000000.png").rename(tmp_path / "images" / "frame_000007.png")
    with pytest.raises(ToolpointError, match="like the first image"):
        whole(files.read(tmp_path / "images", 500.0))


def test_a_true_rate_is_a_positive_number(tmp_path):
    np.save(tmp_path / "a.npy", FRAMES)
    for rate in (0.0, -960.0, float("nan")):
        with pytest.raises(ToolpointError, match="frame_rate"):
            files.read(tmp_path / "a.npy", rate)
    with pytest.raises(ToolpointError, match="longer than a frame"):
        files.read(tmp_path / "a.npy", 960.0, row_delay=1e-3)


def test_interlaced_video_is_said(tmp_path):
    path = encoded(tmp_path / "i.mp4", np.repeat(FRAMES, 3, axis=0), "libx264", crf=10, flags="+ilme+ildct",
                   **{"x264-params": "interlaced=1:tff=1"})
    assert any("interlaced video" in doubt for doubt in files.read(path, 960.0).doubts)
    plain = encoded(tmp_path / "p.mp4", np.repeat(FRAMES, 3, axis=0), "libx264", crf=10)
    assert not any("interlaced" in doubt for doubt in files.read(plain, 960.0).doubts)
