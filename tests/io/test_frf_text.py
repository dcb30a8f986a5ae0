"""Text FRFs: any separator, a header, and every fault with its line."""

import numpy as np
import pytest

from toolpoint import Frf
from toolpoint.io.faults import FileFaults
from toolpoint.io.measured import frf_files, frf_writing
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


LINES = np.arange(20.0, 1000.0, 2.0)
TRUE = 1 / (4e7 * (1 - (LINES / 412) ** 2 + 2j * 0.03 * LINES / 412))  # m/N


def tabled(path, head, columns, separator=",", encoding="utf-8", form=repr):
    rows = (separator.join(map(form, row)) for row in np.column_stack(columns).tolist())
    path.write_text("\n".join([*head, *rows]) + "\n", encoding=encoding)
    return path


WRITTEN = {  # what stands above the numbers, and the columns that say the same response
    "named": ("Frequency [Hz],Real [m/N],Imaginary [m/N]", [LINES, TRUE.real, TRUE.imag]),
    "micrometres": ("Frequency (Hz),Real (um/N),Imag (um/N)", [LINES, 1e6 * TRUE.real, 1e6 * TRUE.imag]),
    "each its unit": ("f [Hz],Re [um/N],Im [mm/N]", [LINES, 1e6 * TRUE.real, 1e3 * TRUE.imag]),
    "functions": ("f (Hz),Re(H),Im(H)", [LINES, TRUE.real, TRUE.imag]),
    "joined": ("f_Hz,H11_re,H11_im", [LINES, TRUE.real, TRUE.imag]),
    "remarks": ("f (Hz),Magnitude (linear),Phase (wrapped) [deg]", [LINES, np.abs(TRUE), np.degrees(np.angle(TRUE))]),
    "kilohertz": ("f [kHz],re,im", [LINES / 1e3, TRUE.real, TRUE.imag]),
    "angular": ("omega [rad/s],Real [m/N],Imaginary [m/N]", [2 * np.pi * LINES, TRUE.real, TRUE.imag]),
    "units below": ("Frequency,Real,Imaginary\nHz,nm/N,nm/N", [LINES, 1e9 * TRUE.real, 1e9 * TRUE.imag]),
    "degrees": ("Frequency (Hz),Magnitude (m/N),Phase (deg)", [LINES, np.abs(TRUE), np.degrees(np.angle(TRUE))]),
    "phase without a unit": ("Hz,Amplitude [um/N],Phase", [LINES, 1e6 * np.abs(TRUE), np.degrees(np.angle(TRUE))]),
    "radians": ("Hz,|H| [m/N],Angle [rad]", [LINES, np.abs(TRUE), np.angle(TRUE)]),
    "decibels": ("Hz,Magnitude [dB re 1 um/N],Phase [deg]",
                 [LINES, 20 * np.log10(1e6 * np.abs(TRUE)), np.degrees(np.angle(TRUE))]),
    "coherence": ("Hz,Real,Imag,Coherence", [LINES, TRUE.real, TRUE.imag, np.full(LINES.size, 0.98)]),
    "German": ("Frequenz [Hz],Realteil [m/N],Imaginaerteil [m/N]", [LINES, TRUE.real, TRUE.imag]),
    "pounds": ("Hz,Real [in/lbf],Imag [in/lbf]", [LINES, 4.4482216152605 / 0.0254 * TRUE.real,
                                                  4.4482216152605 / 0.0254 * TRUE.imag])}


@pytest.mark.parametrize("form", WRITTEN)
def test_the_line_of_names_says_what_the_columns_are(tmp_path, form):
    head, columns = WRITTEN[form]
    frf = frf_table.read(tabled(tmp_path / "tip.csv", [head], columns))
    np.testing.assert_allclose(frf.frequency, LINES, rtol=1e-12)
    np.testing.assert_allclose(frf.values[:, 0, 0], TRUE, rtol=1e-9)
    stated = "/N" in head or "/lbf" in head
    assert frf.quantity == "receptance" and frf_files.states_quantity(tmp_path / "tip.csv") == stated


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_decimal_commas_and_the_encodings_of_spreadsheets(tmp_path, separator, encoding):
    head = separator.join(["Frequenz [Hz]", "Real [m/N]", "Imag [m/N]"])
    path = tabled(tmp_path / "tip.txt", ["Prüfstand 7;Nr. 3", head], [LINES, TRUE.real, TRUE.imag], separator, encoding,
                  lambda value: repr(value).replace(".", ","))
    np.testing.assert_array_equal(frf_table.read(path).values[:, 0, 0], TRUE)


@pytest.mark.parametrize(("unit", "quantity", "factor"), [
    ("(m/s^2)/N", "accelerance", 1), ("m/s^2/N", "accelerance", 1), ("g/N", "accelerance", 1 / 9.80665),
    ("1/kg", "accelerance", 1), ("(mm/s)/N", "mobility", 1e3), ("m/s/N", "mobility", 1)])
def test_units_state_the_quantity(tmp_path, unit, quantity, factor):
    values = factor * TRUE
    path = tabled(tmp_path / "tip.csv", [f"Hz,real [{unit}],imaginary [{unit}]"], [LINES, values.real, values.imag])
    frf = frf_files.read(path)
    assert frf.quantity == quantity and not any("read as" in note for note in frf.notes)
    np.testing.assert_allclose(frf.values[:, 0, 0], TRUE, rtol=1e-12)
    with pytest.raises(ValueError, match="leave it out"):
        frf_files.read(path, quantity="receptance")


@pytest.mark.parametrize("mark", ["{0.real!r}{0.imag:+}j", "({0.real!r}{0.imag:+}i)", "{0.real!r} {0.imag:+}i"])
def test_complex_numbers(tmp_path, mark):
    rows = (f"{line!r},{mark.format(value)}" for line, value in zip(LINES.tolist(), TRUE.tolist(), strict=True))
    (tmp_path / "tip.csv").write_text("Frequency [Hz],H [m/N]\n" + "\n".join(rows))
    np.testing.assert_array_equal(frf_table.read(tmp_path / "tip.csv").values[:, 0, 0], TRUE)


def test_responses_saved_as_csv_come_back(tmp_path):
    """Several outputs and inputs, as accelerance: labels, quantity and every bit."""
    rng = np.random.default_rng(1)
    values = rng.standard_normal((9, 3, 2)) + 1j * rng.standard_normal((9, 3, 2))
    frf = Frf(np.arange(1.0, 10.0), values, ("1:+x", "tip:-z", "7:+rx"), ("1:+x", "2:+y"), "accelerance")
    frf_writing.write(frf, tmp_path / "all.csv")
    again = frf_files.read(tmp_path / "all.csv")
    assert (again.outputs, again.inputs, again.quantity, again.notes) == (frf.outputs, frf.inputs, frf.quantity, ())
    np.testing.assert_array_equal(again.values, values)


def test_several_unlabelled_responses_are_points_and_said(tmp_path):
    path = tabled(tmp_path / "all.csv", ["Hz,A re,A im,B re,B im"], [LINES, TRUE.real, TRUE.imag, 2 * TRUE.real, 2 * TRUE.imag])
    frf = frf_files.read(path)
    assert list(map(str, frf.outputs)) == ["1:+x", "2:+x"] and any("name no points" in note for note in frf.notes)
    np.testing.assert_allclose(frf.values[:, 1, 0], 2 * TRUE)


@pytest.mark.parametrize(("head", "columns", "words"), [
    ("Hz,Magnitude [m/N],Coherence", [LINES, np.abs(TRUE), np.ones(LINES.size)], "no column of phase"),
    ("Hz,Phase [deg],Magnitude", [LINES, np.degrees(np.angle(TRUE)), np.abs(TRUE)], "its other part"),
    ("Zeit_ms,Kraft_N,a_g", [LINES, TRUE.real, TRUE.imag], "times are of a record"),  # a record of a hammer, no response
    ("t,F,a", [LINES, TRUE.real, TRUE.imag], "times are of a record"),
    ("Time [s],Real,Imag", [LINES, TRUE.real, TRUE.imag], "must be a frequency"),
    ("Hz,Real [um],Imag [um]", [LINES, TRUE.real, TRUE.imag], "no motion over force"),
    ("Hz,Real [V/V],Imag [V/V]", [LINES, TRUE.real, TRUE.imag], "no motion over force"),
    ("Hz,Real [m/N],Imag [g/N]", [LINES, TRUE.real, TRUE.imag], "one quantity"),
    ("Hz,Real,Imag,Temperature", [LINES, TRUE.real, TRUE.imag, LINES], "'temperature' is not understood"),
    ("", [LINES, np.abs(TRUE), np.degrees(np.angle(TRUE))], "magnitude and phase"),
    ("", [LINES, TRUE.real, TRUE.imag, TRUE.real, TRUE.imag], "5 columns, and no line before them names them")])
def test_columns_that_are_something_else_are_refused(tmp_path, head, columns, words):
    with pytest.raises(FileFaults, match=words):
        frf_table.read(tabled(tmp_path / "tip.csv", [head] if head else [], columns))


def test_names_that_say_nothing_are_noted_and_counts_above_the_table_are_no_table(tmp_path):
    path = tabled(tmp_path / "tip.csv", ["490,2", "X,Y1,Y2"], [LINES, TRUE.real, TRUE.imag])
    frf = frf_table.read(path)
    np.testing.assert_array_equal(frf.values[:, 0, 0], TRUE)
    assert any("taken as Hz, real, imaginary" in note for note in frf.notes)


@pytest.mark.parametrize(("columns", "words"), [
    (lambda k: (k / 10000, 0.1, 0.2), "runs to 0.06 in 599 steps of 0.0001: these are times"),
    (lambda k: ((-1) ** k, 0.2, k / 10000), "the first column does not increase"), ])
def test_a_record_without_names_is_told_how_to_name_its_columns(tmp_path, columns, words):
    (tmp_path / "a.txt").write_text("\n".join(" ".join(map(str, columns(k))) for k in range(600)))
    with pytest.raises(FileFaults, match=r"time .s.,force .N.,acceleration") as refused:
        frf_table.read(tmp_path / "a.txt")
    assert words.replace("0.06", "0.0599") in str(refused.value) and len(refused.value.faults) == 1
