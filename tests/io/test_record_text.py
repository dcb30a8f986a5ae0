"""Time histories in text: units of the columns."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.measured.record_signs import holds_records
from toolpoint.io.text import record_table


@pytest.mark.parametrize(("column", "factor"), [
    ("acceleration", 1.0), ("acceleration [g]", 9.80665), ("acceleration [mm/s^2]", 1e-3), ("velocity [mm/s]", 1e-3),
    ("displacement [um]", 1e-6), ("Fx [kN]", 1e3)])
def test_columns_become_si(tmp_path, column, factor):
    (tmp_path / "r.csv").write_text(f"time [ms],{column}\n0,1\n1,2\n2,3\n")
    record = record_table.read(tmp_path / "r.csv")
    assert record.sample_rate == pytest.approx(1000)
    assert record.samples[:, 0] == pytest.approx([factor, 2 * factor, 3 * factor])


def test_a_unit_of_another_kind_is_refused(tmp_path):
    (tmp_path / "r.csv").write_text("time,acceleration [mm]\n0,1\n1,2\n")
    with pytest.raises(ToolpointError, match="acceleration"):
        record_table.read(tmp_path / "r.csv")


def test_a_column_of_any_name_is_read_in_its_unit(tmp_path):
    path = tmp_path / "positions.csv"
    path.write_text("time [ms],Pos (mm),Angle [deg],Current [A]\n0,1,180,2\n1,2,90,3\n2,3,0,4\n")
    record = record_table.read(path)
    np.testing.assert_allclose(record.samples, [[1e-3, np.pi, 2], [2e-3, np.pi / 2, 3], [3e-3, 0, 4]], rtol=1e-12)


@pytest.mark.parametrize(("text", "encoding"), [
    ("Time [s],Fx [N],Fy [N]\n0,1.5,-2\n0.001,2.5,-3\n0.002,3.5,-4\n", "utf-8"),
    ("Zeit [ms];Fx [kN];Fy [kN]\n0;0,0015;-0,002\n1;0,0025;-0,003\n2;0,0035;-0,004\n", "latin-1"),
    ("Dynamometer\nTime\tFx\tFy\ns\tN\tN\n0\t1,5\t-2\n0,001\t2,5\t-3\n0,002\t3,5\t-4\n", "utf-16"),
    ("Zeit_ms;Fx_kN;Fy_N\n0;0,0015;-2\n1;0,0025;-3\n2;0,0035;-4\n", "utf-8"),
    ("time;Fx;Fy\n[ms];[kN];[N]\n0;0.0015;-2\n1;0.0025;-3\n2;0.0035;-4\n", "utf-8")])
def test_one_record_written_in_the_ways_of_programs_is_one_record(tmp_path, text, encoding):
    """Semicolons with decimal commas, a line of units, UTF-16: what spreadsheets and acquisition programs write."""
    (tmp_path / "r.txt").write_bytes(text.encode(encoding))
    record = record_table.read(tmp_path / "r.txt")
    np.testing.assert_allclose(record.samples, [[1.5, -2], [2.5, -3], [3.5, -4]], rtol=1e-12)
    assert record.sample_rate == pytest.approx(1000) and record.quantities == ("force", "force")


@pytest.mark.parametrize(("head", "is_record"), [
    ("Zeit;Kraft;Beschleunigung", True), ("Zeit_ms;Kraft_N;a_g", True), ("Zeit [s];Kraft [N];a [m/s²]", True),
    ("Frequenz;Real;Imag", False)])
def test_a_record_with_decimal_commas_is_told_from_responses_by_its_first_name(tmp_path, head, is_record):
    """A comma of a decimal parts no columns: three names fit three numbers."""
    path = tmp_path / "r.csv"
    path.write_text(f"{head}\n0,0001;0,2465;-2,79403\n0,0002;0,0991;-3,62716\n", encoding="utf-8")
    assert holds_records(path) == is_record


def test_columns_of_g_are_accelerations_in_si(tmp_path):
    """A column in g is no gram, whatever its name; a name may say quantity, point and direction."""
    path = tmp_path / "blow.csv"
    path.write_text("Time [s];force 3:-z [kN];acceleration tip:+x [g];Sensor 2 [g]\n0;1;1;1\n0.001;2;2;2\n0.002;0;1;1\n")
    record = record_table.read(path)
    assert [str(dof) for dof in record.channels[:2]] == ["3:-z", "tip:+x"]
    assert record.quantities[:2] == ("force", "acceleration")
    assert record.samples[0] == pytest.approx([1000.0, 9.80665, 9.80665])


def test_times_of_few_digits_run_evenly(tmp_path):
    """1.25 ms written with 0.1 ms are 0.0012 and 0.0013 s in turn; the rate is that of all times."""
    path = tmp_path / "logger.csv"
    path.write_text("time [s],ax [m/s^2]\n" + "".join(f"{k / 800:.4f},{k % 7}\n" for k in range(2000)))
    assert record_table.read(path).sample_rate == pytest.approx(800, rel=1e-6)


@pytest.mark.parametrize("missing", [3, 700, 1990])
def test_a_sample_left_out_among_rounded_times_is_refused(tmp_path, missing):
    path = tmp_path / "logger.csv"
    path.write_text("time [s],ax [m/s^2]\n" + "".join(f"{k / 800:.4f},1\n" for k in range(2000) if k != missing))
    with pytest.raises(ToolpointError, match=f"does not run evenly: .* before sample {missing + 1} "):
        record_table.read(path)


def test_one_sample_is_refused_for_what_it_is(tmp_path):
    path = tmp_path / "one.csv"
    path.write_text("time [s],ax [m/s^2]\n0.0,1\n")
    with pytest.raises(ToolpointError, match="one sample; must be at least two"):
        record_table.read(path)


@pytest.mark.parametrize("count", ["Sample", "Nr.", '"Index"'])
@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_numbers_of_the_samples_before_their_times_say_nothing(tmp_path, count, end):
    path = tmp_path / "r.csv"
    lines = [f"{count},Time (ms),Fx [N]", *(f"{k},{2 * k},{k + 1}" for k in range(5))]
    path.write_bytes(end.join(lines).encode("utf-8-sig"))
    record = record_table.read(path)
    assert holds_records(path) and record.sample_rate == pytest.approx(500) and record.samples[:, 0].tolist() == [1, 2, 3, 4, 5]
