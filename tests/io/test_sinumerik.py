"""Sinumerik servo-tuning XML: the controller's own Bode from its own series; broken files."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from toolpoint.io.faults import FileFaults
from toolpoint.io.servo_data import sinumerik


def averaged(trace):
    """Return H1 over the runs by a plain discrete Fourier transform, and the frequencies of its lines."""
    lines = [[np.fft.rfft(r.samples[:, 0]) for r in part] for part in (trace.output, trace.input)]
    cross = sum(y * u.conj() for y, u in zip(*lines, strict=True))
    return cross / sum(np.abs(u) ** 2 for u in lines[1])


def test_bode_equals_the_controllers(measured):
    """Bars: 0.15 dB and 1.5 deg from 10 to 200 Hz."""
    trace = sinumerik.read(measured / "sinumerik" / "freq_trace.XML")
    assert len(trace.input) == 2
    assert trace.input[0].samples.shape[0] == 2047
    assert trace.input[0].sample_rate == pytest.approx(8000.0)
    own, f = averaged(trace)[: trace.frequency.size], trace.line_frequency
    band = (f >= 10) & (f <= 200)
    ratio = own[: f.size][band] / trace.response[: own.size][band]
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.15
    assert np.abs(np.degrees(np.angle(ratio))).max() < 1.5
    assert trace.coherence[1:].max() <= 1 + 1e-6


def test_base85_words():
    values = np.array([1.0, 0.0, -2.5e-7, 1e300])
    packed = ""
    for value in values:
        for word in struct.unpack(">II", struct.pack(">d", value)):
            digits, number = [], word
            for _ in range(5):
                digits.append(sinumerik._ALPHABET[number % 85])
                number //= 85
            packed += "." if word == 0 else "".join(reversed(digits))
    np.testing.assert_array_equal(sinumerik._decoded(packed), values)
    with pytest.raises(ValueError, match="cut short"):
        sinumerik._decoded(packed + "00")


def test_broken_files(tmp_path):
    for text, message in (("<a><b></a>", "broken XML"), ("<a></a>", "no frequency response")):
        path = tmp_path / "trace.xml"
        path.write_text(text)
        with pytest.raises(FileFaults, match=message):
            sinumerik.read(path)
