"""Sound files of every kind, and what is wrong with them."""

import numpy as np
import pytest
from scipy.io import wavfile

from toolpoint._check import ToolpointError
from toolpoint.io import read_listened

RATE = 22050
TONE = 0.5 * np.sin(2 * np.pi * 440 * np.arange(RATE) / RATE)


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.float32, np.uint8])
def test_wav_of_every_sample_format_is_the_same_sound(tmp_path, kind):
    scaled = {np.int16: TONE * 32768, np.int32: TONE * 2**31, np.float32: TONE, np.uint8: TONE * 128 + 128}[kind]
    wavfile.write(tmp_path / "a.wav", RATE, scaled.astype(kind))
    record = read_listened(tmp_path / "a.wav")
    assert record.sample_rate == RATE and record.quantities == ("sound",) and record.units == ("full scale",)
    assert np.abs(record.samples[:, 0] - TONE).max() < 0.02


@pytest.mark.parametrize(("name", "accuracy"), [("a.flac", 1e-3), ("a.mp3", 0.05), ("a.ogg", 0.05)])
def test_compressed_sound_is_read(tmp_path, name, accuracy):
    soundfile = pytest.importorskip("soundfile")
    soundfile.write(tmp_path / name, TONE, RATE)
    record = read_listened(tmp_path / name)
    assert record.samples.shape[1] == 1
    middle = record.samples[5000:15000, 0]
    assert np.std(middle) == pytest.approx(0.5 / np.sqrt(2), rel=accuracy)
    peak = np.argmax(np.abs(np.fft.rfft(middle * np.hanning(10000)))) * RATE / 10000
    assert peak == pytest.approx(440, abs=3)


def test_the_sound_of_a_video_is_read(tmp_path):
    av = pytest.importorskip("av")
    with av.open(str(tmp_path / "cut.mkv"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=RATE, layout="mono")
        frame = av.AudioFrame.from_ndarray((TONE * 32767).astype(np.int16)[None, :], format="s16", layout="mono")
        frame.sample_rate = RATE
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    record = read_listened(tmp_path / "cut.mkv")
    assert record.sample_rate == RATE
    assert np.abs(record.samples[:RATE, 0] - TONE).max() < 1e-3


def test_stereo_is_two_channels(tmp_path):
    wavfile.write(tmp_path / "a.wav", RATE, np.stack([TONE, -TONE], axis=1).astype(np.float32))
    record = read_listened(tmp_path / "a.wav")
    assert record.samples.shape == (RATE, 2) and [str(c) for c in record.channels] == ["sound-1:+x", "sound-2:+x"]


def test_a_text_record_of_an_accelerometer_is_read_as_well(tmp_path):
    lines = ["Time [s],Acceleration [g]", *(f"{k / 1000:.6f},{v:.6f}" for k, v in enumerate(TONE[:2000]))]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    assert read_listened(tmp_path / "a.csv").quantities == ("acceleration",)


def test_faulty_files_are_refused_with_the_remedy(tmp_path):
    wavfile.write(tmp_path / "good.wav", RATE, TONE.astype(np.float32))
    whole = (tmp_path / "good.wav").read_bytes()
    (tmp_path / "cut.wav").write_bytes(whole[:3000])
    (tmp_path / "name.mp3").write_bytes(whole)
    (tmp_path / "empty.wav").write_bytes(b"")
    (tmp_path / "text.wav").write_text("no sound at all, and more than twelve bytes")
    (tmp_path / "text.mkv").write_text("no video at all, and more than twelve bytes")
    for name, words in (("cut.wav", "not a whole WAV file"), ("name.mp3", "begins like a .wav file"), ("empty.wav", "is empty"),
                        ("text.wav", "not a whole WAV file"), ("text.mkv", "no sound that can be decoded"),
                        ("none.wav", "no such file")):
        with pytest.raises(ToolpointError, match=words):
            read_listened(tmp_path / name)
