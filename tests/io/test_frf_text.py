"""Text FRFs: any separator, a header, and every fault with its line."""

import numpy as np
import pytest

from toolpoint.io.faults import FileFaults
from toolpoint.io.measured import frf_files
from toolpoint.io.text import frf_table

ROWS = "{0}10{1}1e-6{1}-2e-6{2}\n{0}11{1}1.5E-006{1}-2.5e-006{2}\n{0}12{1}2e-6{1}-3e-6{2}\n"


@pytest.mark.parametrize("marks", [("", "\t", ""), ("  ", "   ", " "), ("", ", ", ""), ("", ";", ";")])
def test_separators_and_header(tmp_path, marks):
    path = tmp_path / "a.txt"
    path.write_text("Frequency Real Imag\n# Hz m/N m/N\n\n" + ROWS.format(*marks))
    frf = frf_table.read(path, "tool:+x")
    np.testing.assert_allclose(frf.frequency, [10, 11, 12])
    np.testing.assert_allclose(frf.values[:, 0, 0], [1e-6 - 2e-6j, 1.5e-6 - 2.5e-6j, 2e-6 - 3e-6j])


def test_round_trip_is_bit_exact(tmp_path):
    (tmp_path / "a.txt").write_text(ROWS.format("", " ", ""))
    frf = frf_table.read(tmp_path / "a.txt")
    odd = frf.converted_to("accelerance")
    frf_table.write(odd, tmp_path / "b.txt")
    np.testing.assert_array_equal(frf_table.read(tmp_path / "b.txt", quantity="accelerance").values, odd.values)


@pytest.mark.parametrize(("text", "line", "message"), [
    ("10 1 2\n11 nan 2\n12 1 2\n", 2, "not finite"), ("10 1 2\n9 1 2\n", 2, "must increase"),
    ("10 1 2\n11 1\n", 2, "not three numbers"), ("10,5 1,2 3,4\n11,5 1,2 3,4\n", 1, "decimal comma"),
    ("no numbers here\n", 1, "no line with three numbers"), ("-1 1 2\n3 1 2\n", 1, "negative")])
def test_faults_name_their_line(tmp_path, text, line, message):
    path = tmp_path / "a.txt"
    path.write_text(text)
    with pytest.raises(FileFaults, match=message) as caught:
        frf_table.read(path)
    assert caught.value.faults[0].line == line


def test_binary_and_missing_files(tmp_path):
    (tmp_path / "a.txt").write_bytes(b"\0\1\2")
    with pytest.raises(ValueError, match="binary"):
        frf_table.read(tmp_path / "a.txt")
    with pytest.raises(ValueError, match="cannot be read"):
        frf_table.read(tmp_path / "none.txt")


def test_measured_tool_holder(measured):
    paths = [measured / "tool_holder_frf" / f"Point_{i}_Channel_1_CH1.txt" for i in range(1, 6)]
    frf = frf_files.read(paths, names=[f"{i}__1" for i in range(1, 6)])
    assert frf.values.shape == (5001, 5, 1)
    np.testing.assert_allclose(np.diff(frf.frequency), 1.0)
