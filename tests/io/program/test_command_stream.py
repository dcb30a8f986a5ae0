"""Command streams in CSV: units, round trip, faults with their lines."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.faults import FileFaults
from toolpoint.io.program import command_stream


def written(tmp_path, text):
    path = tmp_path / "stream.csv"
    path.write_text(text)
    return path


def test_units_and_names(tmp_path):
    stream = command_stream.read(written(tmp_path, "time [ms]; X [mm]; n [rpm]\n0;1;60\n2;2;60\n4;3;120\n"))
    assert stream.sample_time == pytest.approx(2e-3)
    np.testing.assert_allclose(stream.columns(["X"])[:, 0], [1e-3, 2e-3, 3e-3])
    assert stream.columns(["n"])[0, 0] == pytest.approx(2 * np.pi)
    assert stream.units == ("m", "rad/s")
    assert stream.record.quantities == ("displacement", "velocity")
    with pytest.raises(ToolpointError, match="must be one of"):
        stream.columns(["Y"])


def test_round_trip(tmp_path):
    rng = np.random.default_rng(0)
    stream = command_stream.CommandStream(rng.standard_normal((50, 2)), 1 / 1024, ("X", "Y"), ("m", "N m"), 0.5)
    command_stream.write(stream, tmp_path / "a.csv")
    back = command_stream.read(tmp_path / "a.csv")
    np.testing.assert_array_equal(back.values, stream.values)
    assert (back.names, back.units, back.start) == (stream.names, stream.units, stream.start)
    assert back.sample_time == pytest.approx(1 / 1024, rel=1e-12)


@pytest.mark.parametrize(("text", "line", "message"), [
    ("time [s], X [mm]\n0, 1\n1, 2, 3\n2, 3\n", 3, "the header names 2"),
    ("time [s], X [mm]\n0, 1\n1, a\n2, 3\n", 3, "not a number"),
    ("time [s], X [mm]\n0, 1\n1, nan\n2, 3\n", 3, "not finite"),
    ("time [s], X [furlong]\n0, 1\n1, 2\n", 1, "unknown unit"),
    ("time [s], X [mm]\n0, 1\n1, 2\n2, 3\n4, 3\n", 5, "resample"),
    ("time [s]; X [mm]\n0; 1\n1; 2,5\n", 3, "decimal points"),
    ("X [mm], X [mm]\n0, 1\n1, 2\n", 1, "stands before"),
    ("X [mm], Y [mm]\n0, 1\n1, 2\n", 1, "no time column")])
def test_faults(tmp_path, text, line, message):
    with pytest.raises(FileFaults, match=message) as error:
        command_stream.read(written(tmp_path, text))
    assert error.value.faults[0].line == line
