"""Records of controllers: tables of any header, held values, several times; the measured files; damaged ones."""

from __future__ import annotations

import json
from contextlib import suppress

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.drives.accuracy.axis_record import AxisRecord, AxisSignal
from toolpoint.io import read_servo_data
from toolpoint.studies import judge_servo_data

TIME = np.arange(0, 4, 2e-3)
SPEED = 0.05 * np.sign(np.sin(np.pi * TIME + 1e-9)) * np.where(TIME < 2, 1.0, 0.5)


def write(tmp_path, text, name="record.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e-3), ("m", 1.0), ("um", 1e-6), ("deg", np.pi / 180), ("inch", 0.0254)])
@pytest.mark.parametrize("brackets", ["[{}]", "({})"])
def test_units_in_brackets_of_either_kind(tmp_path, unit, factor, brackets):
    record = read_servo_data(write(tmp_path, f"some title\ntime [ms];pos X {brackets.format(unit)}\n0;1,5\n2;2,5\n4;3,5\n"))
    np.testing.assert_allclose(record.signals[0].values, factor * np.array([1.5, 2.5, 3.5]))
    np.testing.assert_allclose(record.signals[0].time, [0, 2e-3, 4e-3])
    assert (record.signals[0].role, record.signals[0].axis) == ("position", "X")


def test_a_column_without_unit_is_not_judged_but_named(tmp_path):
    path = write(tmp_path, "time [s],pos X\n0,1\n1,2\n2,3\n")
    record = read_servo_data(path)
    assert record.signals[0].role == "" and any("no unit" in note for note in record.notes)
    assert read_servo_data(path, {"pos X": "mm"}).signals[0].role == "position"


def test_groups_with_their_own_time_and_held_values(tmp_path):
    text = "time [s]\tv set X [mm/s]\ttime [s]\tcurrent X [mA]\n0\t1\t0\t100\n0.1\t\t0.5\t200\n0.2\t3\t1.0\t300\n"
    speed, current = read_servo_data(write(tmp_path, text)).signals
    np.testing.assert_allclose(speed.at(np.array([0.0, 0.1, 0.2])), [1e-3, 1e-3, 3e-3])
    np.testing.assert_allclose(current.at(np.array([0.0, 0.49, 0.5, 2.0])), [0.1, 0.1, 0.2, 0.3])


def record_of(current, error):
    make = lambda name, unit, role, values: AxisSignal(name, unit, role, "X", TIME, values)
    return AxisRecord((make("v", "m/s", "velocity_set", SPEED), make("i", "A", "current", current),
                       make("e", "m", "following_error", error)))


def test_a_record_of_known_friction_and_gain():
    """I = 3 + 1.2 sgn v + 4 v, e = v/25: a vertical axis."""
    rng = np.random.default_rng(0)
    data = judge_servo_data(record_of(3 + 1.2 * np.sign(SPEED) + 4 * SPEED + 1e-3 * rng.standard_normal(TIME.size), SPEED / 25))
    axis = data.axes[0]
    assert axis.velocity_gain == pytest.approx(25)
    assert axis.friction is not None
    assert (axis.friction.dry, axis.friction.offset, axis.friction.slope) == pytest.approx((1.2, 3, 4), rel=0.01)
    assert any("offset is larger" in words for words in axis.notes)
    assert any("two speeds only" in words for words in axis.doubts)
    assert data.table().startswith("doubt:")


def test_a_scope_with_german_names_and_a_load_in_per_cent_gives_what_was_put_in(tmp_path):
    """Dry friction 12 %, 50 % per m/s, K_v 30 1/s: the units and names of a control's own scope."""
    speed = np.repeat([5.0, -5, 20, -20, 60, -60, 150, -150], 400)  # mm/s
    place, rng = np.cumsum(speed) * 2e-3, np.random.default_rng(3)
    columns = np.c_[2.0 * np.arange(speed.size), place, place - speed / 30, 60 * speed,
                    12 * np.sign(speed) + 0.05 * speed + rng.normal(0, 0.5, speed.size)]
    rows = [";".join(f"{value:.5f}" for value in row).replace(".", ",") for row in columns]
    head = "Name;Messung\n\nZeit [ms];X.SollPos [mm];X.IstPos [mm];X.SollGeschw [mm/min];X.Drehmoment [%]"
    found = judge_servo_data(read_servo_data(write(tmp_path, "\n".join([head, *rows])))).axes[0]
    assert found.velocity_gain == pytest.approx(30, rel=1e-3) and found.force_unit == "%"
    low, high = found.friction.dry_interval
    assert low < 12 < high and high - low < 0.5 and any("rated torque" in note for note in found.notes)


def test_a_sign_that_is_turned_is_said():
    data = judge_servo_data(record_of(-1.2 * np.sign(SPEED) - 4 * SPEED, SPEED / 25))
    assert any("opposite signs" in words for words in data.axes[0].doubts)
    assert data.axes[0].friction.dry == pytest.approx(1.2, rel=0.01)


@pytest.mark.slow
def test_rotary_table_of_a_trace(measured):
    """Plateau 108 deg/s, following error 0.664012 deg, so K_v 162.6 1/s; friction current 9.44 and 9.30 A."""
    data = judge_servo_data(read_servo_data(measured / "controller" / "sinu_trace.xml"))
    axis = data.axes[0]
    np.testing.assert_allclose(np.abs(np.degrees(axis.runs.velocity)), 108, rtol=1e-6)
    np.testing.assert_allclose(np.abs(np.degrees(axis.runs.following_error)), 0.664012, rtol=1e-3)
    assert axis.velocity_gain == pytest.approx(162.6, abs=0.2)
    np.testing.assert_allclose(sorted(np.abs(axis.levels)), [9.30, 9.44], rtol=0.01)
    assert any("deg" in note for note in data.notes)


def test_scope_files_of_two_controls(measured):
    record = read_servo_data(measured / "controller" / "FeedStep150_N300_H55.sco")
    assert {s.role for s in record.signals} == {"velocity", "velocity_set", "position", "position_set", "current"}
    assert np.diff(record.signals[0].time) == pytest.approx(3e-3) and record.signals[0].values.size == 7136
    assert judge_servo_data(record).axes[0].axis == "Y"
    scope = read_servo_data(measured / "controller" / "twincat.csv")
    assert len(scope.signals) == 21
    assert {round(float(np.median(np.diff(s.time))), 7) for s in scope.signals} == {0.0002, 0.001, 0.005}
    with pytest.raises(ToolpointError, match="no axis"):
        judge_servo_data(scope)


def test_positioning_run_by_a_second_computation(measured):
    path = measured / "controller" / "report_target_y.md_ISO230.dat"
    cells = dict(line.split("=") for line in path.read_text().splitlines() if line.startswith(("TGT_DATA[", "REF_DATA_")))
    value = lambda way, i, j: float(cells[f"REF_DATA_{way}[{i},{j}]"]) - float(cells[f"TGT_DATA[{i}]"])
    means = [[np.mean([value(way, i, j) for j in range(1, 6)]) for i in range(1, 10)] for way in ("FWD", "BWD")]
    result = judge_servo_data(read_servo_data(path)).positioning
    assert 1e3 * result.reversal == pytest.approx(max(abs(a - b) for a, b in zip(*means, strict=True)))
    assert 1e3 * result.systematic == pytest.approx(max(map(max, means)) - min(map(min, means)))


@pytest.mark.slow
def test_command_and_page(measured, tmp_path, capsys):
    main(["servo-data", str(measured / "controller" / "sinu_trace.xml"), "-o", str(tmp_path), "--json"])
    assert json.loads(capsys.readouterr().out)["axes"]["7"]["velocity_gain_1_s"] == pytest.approx(162.6, abs=0.2)
    assert "K<sub>v</sub>" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize("text", ["", "a", "time [s]\n", "time [s],x [mm]\n1,2\n1,3\n", "<traceSession/>", "<traceSession",
                                  "%TNCscopeNT data file\n", "TGT_DATA[1]=2\n", "TGT_DATA[1]=x\n", "1,2\n3,4\n",
                                  "Name\tx\nStarttime of export\t\n",
                                  "<!DOCTYPE a [<!ENTITY b 'c'>]><traceSession>&b;</traceSession>"])
def test_damaged_files_are_refused(tmp_path, text):
    with pytest.raises(ToolpointError):
        read_servo_data(write(tmp_path, text))


@pytest.mark.parametrize("time", [[0, 1, np.nan], [0, 1, np.inf], [0, 1, 1], [0, 2, 1]])
def test_times_that_are_none_are_refused(time):
    with pytest.raises(ToolpointError, match="increasing"):
        AxisSignal("pos", "m", "position", "X", np.array(time), np.zeros(3))


def test_cut_files_never_end_in_a_foreign_error(measured, tmp_path):
    for name in ("sinu_trace.xml", "FeedStep150_N300_H55.sco", "twincat.csv", "report_target_y.md_ISO230.dat"):
        raw = (measured / "controller" / name).read_bytes()[:60_000]
        for end in np.random.default_rng(1).integers(1, len(raw), 25):
            (tmp_path / name).write_bytes(raw[:end])
            with suppress(ToolpointError):
                judge_servo_data(read_servo_data(tmp_path / name))
