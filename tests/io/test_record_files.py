"""Records of hammer hits from every format: labels, units, rates; what is missing or wrong is named."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat, wavfile

from toolpoint import Dof, Record, ToolpointError, ToolpointWarning
from toolpoint.io import read_frf, read_record, read_records, uff
from toolpoint.io.binary import hdf5
from toolpoint.io.measured.channels import parse_channel
from toolpoint.io.measured.name_patterns import dof_of, read_names
from toolpoint.io.yaml.testing import test_file
from toolpoint.signals.test_description import ChannelDescription, HammerTestDescription, RecordsDescription
from toolpoint.studies.measured.hammer_study import study_hammer_records

RATE = 1000.0
TIME = np.arange(400) / RATE
FORCE = np.where((TIME > 0.05) & (TIME < 0.056), 100 * np.sin(np.pi * (TIME - 0.05) / 0.006), 0.0)
MOTION = np.where(TIME > 0.05, np.exp(-20 * (TIME - 0.05)) * np.sin(300 * (TIME - 0.05)), 0.0)
SI = np.column_stack([FORCE, MOTION])


def text(path: Path, head: str, table: np.ndarray, separator: str = ",", comma: bool = False) -> Path:
    rows = [separator.join(f"{v:.9g}" for v in row) for row in table]
    body = "\n".join(rows)
    path.write_text(head + (body.replace(".", ",") if comma else body) + "\n")
    return path


def test_text_with_units_is_read_to_si(tmp_path):
    path = text(tmp_path / "hit.csv", "time [ms],force 5:-z [kN],acceleration tip:+x [g]\n",
                np.column_stack([1e3 * TIME, FORCE / 1e3, MOTION / 9.80665]))
    record = read_records(path).records[0]
    assert record.channels == (Dof(5, "-z"), Dof("tip", "+x")) and record.quantities == ("force", "acceleration")
    assert np.abs(record.samples - SI).max() < 1e-6 * 100 and record.sample_rate == pytest.approx(RATE)


def test_semicolons_with_decimal_commas_and_no_header_are_read(tmp_path):
    path = text(tmp_path / "hit.csv", "", SI, ";", comma=True)
    records = read_records(path, ["1=force 5:+x", "2=acceleration 5:+x"], rate=RATE)
    assert np.allclose(records.records[0].samples, SI, atol=1e-6)
    assert any("taken as SI" in note for note in records.notes)
    with pytest.raises(ToolpointError, match="no channel is known as force"):
        read_records(path, rate=RATE)
    with pytest.raises(ToolpointError, match="no sample rate"):
        read_records(path, ["1=force", "2=acceleration"])


LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t,
X_Columns\tNo
***End_of_Header***\t
\t
Channels\t2
Samples\t400\t400
Y_Unit_Label\tg\tNewtons
X0\t0,0\t0,0
Delta_X\t1,0E-3\t1,0E-3
***End_of_Header***
X_Value\tAcceleration\tForce\tComment
"""


def test_a_labview_file_and_one_of_several_segments(tmp_path):
    rows = "\n".join(f"\t{m / 9.80665:.9f}\t{f:.9f}".replace(".", ",") for f, m in SI) + "\n"
    path = tmp_path / "hit.lvm"
    path.write_text(LVM + rows)
    record = read_record(path)
    assert record.quantities == ("acceleration", "force") and np.abs(record.samples[:, ::-1] - SI).max() < 1e-6
    path.write_text(LVM + rows + LVM.split("***End_of_Header***\t\n")[1] + rows)
    several = read_records(path)
    assert several.names == ("hit.lvm#1", "hit.lvm#2") and several.records[1].samples.shape == (400, 2)
    path.write_text(LVM + rows[:rows.index("\n", 4000) + 1])
    with pytest.raises(ToolpointError, match=r"hit\.lvm:\d+"):
        read_records(path)


def test_sound_files_need_sensitivity_and_full_scale(tmp_path):
    path = tmp_path / "hit.wav"
    wavfile.write(path, 1000, (np.column_stack([FORCE / 200, MOTION / 2]) * 32767).astype(np.int16))
    with pytest.raises(ToolpointError, match="no sensitivity"):
        read_records(path, ["1=force", "2=acceleration"])
    with pytest.raises(ToolpointError, match="full scale"):
        read_records(path, ["1=force 10mV/N", "2=acceleration 100mV/(m/s^2)"])
    channels = [ChannelDescription("1", "force", "5:-z", "10 mV/N", 2.0), ChannelDescription("2", "acceleration", "5:+z",
                                                                                          "100 mV/(m/s^2)", 0.2)]
    record = read_records(path, channels).records[0]
    assert np.abs(record.samples - SI).max() < 0.02


def test_the_full_scale_of_a_sound_file_stands_with_its_sensitivity(tmp_path):
    volts = np.column_stack([FORCE * 2.25e-3, MOTION / 9.80665 * 0.1]) / 2.5
    wavfile.write(tmp_path / "hit.wav", int(RATE), volts.astype(np.float32))
    said = ["1=force tip:+x 2.25mV/N 2.5V", "2=acceleration tip:+x 100 mV/g 2500 mV"]
    assert np.abs(read_records(tmp_path / "hit.wav", said).records[0].samples - SI).max() < 1e-4
    with pytest.raises(ToolpointError, match=r"channel 1=force 2\.25mV/N 10V"):
        read_records(tmp_path / "hit.wav", ["1=force tip:+x 2.25mV/N", said[1]])


def test_matlab_numpy_universal_and_hdf5(tmp_path):
    savemat(tmp_path / "a.mat", {"fs": RATE, "force": FORCE, "acc": MOTION})
    savemat(tmp_path / "b.mat", {"daten": SI, "abtast": RATE})
    np.savez(tmp_path / "c.npz", samples=SI, fs=RATE, channels=["force 5:-z", "acceleration tip:+x"])
    record = Record(SI, RATE, ("5:-z", "6:+x"), ("force", "acceleration"))
    uff.write(tmp_path / "d.uff", record)
    hdf5.write({"one": record, "two": record}, tmp_path / "e.h5")
    described = ["1=force 5:-z", "2=acceleration 6:+x"]
    named = {"samples": "daten", "rate": "abtast"}
    sets = [read_records(tmp_path / "a.mat", ["force=force 5:-z", "acc=acceleration 6:+x"]),
            read_records(tmp_path / "b.mat", described, variables=named), read_records(tmp_path / "c.npz"),
            read_records(tmp_path / "d.uff"), read_records(tmp_path / "e.h5")]
    assert [len(some.records) for some in sets] == [1, 1, 1, 1, 2]
    for some in sets:
        at = some.records[0].quantities.index("force")
        assert some.records[0].channels[at] == Dof(5, "-z")
        assert np.abs(some.records[0].samples[:, [at, 1 - at]] - SI).max() < 1e-6


def test_tdms(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    step = {"wf_increment": 1 / RATE}
    with nptdms.TdmsWriter(tmp_path / "hit.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("hits", "Hammer", FORCE, {**step, "unit_string": "N"}),
                              nptdms.ChannelObject("hits", "Acc 1", MOTION / 9.80665, {**step, "unit_string": "g"})])
    record = read_records(tmp_path / "hit.tdms").records[0]
    assert record.quantities == ("force", "acceleration") and np.abs(record.samples - SI).max() < 1e-6


def test_a_torn_tdms_file_is_said_by_us_and_not_by_its_library(tmp_path, capfd):
    nptdms = pytest.importorskip("nptdms")
    channel = nptdms.ChannelObject("hits", "Hammer", FORCE, {"wf_increment": 1e-3, "unit_string": "N"})
    with nptdms.TdmsWriter(tmp_path / "whole.tdms") as writer:
        writer.write_segment([channel])
        writer.write_segment([channel])
    (tmp_path / "torn.tdms").write_bytes((tmp_path / "whole.tdms").read_bytes()[:-5])
    with pytest.warns(ToolpointWarning, match="torn.tdms: the file is not whole"):
        record = read_records(tmp_path / "torn.tdms").records[0]
    assert FORCE.size <= len(record.samples) < 2 * FORCE.size
    assert not capfd.readouterr().err



def test_a_sensitivity_of_another_quantity_is_refused(tmp_path):
    path = text(tmp_path / "hit.csv", "time [s],a [V],b [V]\n", np.column_stack([TIME, SI]))
    with pytest.raises(ToolpointError, match="channels may be swapped"):
        read_records(path, ["a=force 100mV/g", "b=acceleration 2mV/N"])
    record = read_records(path, ["a=5:-z 2 mV/N", "b=tip:+x -100 mV/g"]).records[0]
    assert record.samples[:, 0].max() == pytest.approx(FORCE.max() / 2e-3)
    assert np.allclose(record.samples[:, 1], -MOTION / 0.1 * 9.80665, atol=1e-5)


STAMPS = {"clock": "10:59:59.{:06.0f}", "date and clock": "2026-11-23T10:59:59.{:06.0f}Z",
          "German": "23.11.2026 10:59:59,{:06.0f}"}


@pytest.mark.parametrize("form", STAMPS)
def test_times_of_a_clock_give_the_rate(tmp_path, form):
    separator, point = (";", ",") if "," in STAMPS[form] else (",", ".")
    rows = [separator.join([STAMPS[form].format(1e6 * t), *(f"{v:.9g}".replace(".", point) for v in row)])
            for t, row in zip(TIME, SI, strict=True)]
    head = separator.join(["Timestamp", "force [N]", "acceleration [m/s^2]"])
    (tmp_path / "hit.csv").write_text("\n".join([head, *rows]))
    record = read_records(tmp_path / "hit.csv").records[0]
    assert record.sample_rate == pytest.approx(RATE) and np.abs(record.samples - SI).max() < 1e-5


def test_midnight_between_two_samples(tmp_path):
    rows = [f"{'23:59:59' if t < 0.2 else '00:00:00'}.{1e6 * ((t + 0.8) % 1):06.0f},{f:.9g},{a:.9g}"
            for t, (f, a) in zip(TIME, SI, strict=True)]
    (tmp_path / "hit.csv").write_text("\n".join(["time,force [N],acceleration [m/s^2]", *rows]))
    assert read_records(tmp_path / "hit.csv").records[0].sample_rate == pytest.approx(RATE)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-8-sig"])
def test_quoted_cells_and_wide_encodings(tmp_path, encoding):
    rows = [",".join(f'"{v:.9g}"' for v in row) for row in np.column_stack([TIME, FORCE / 4.4482216152605, MOTION / 9.80665])]
    text = "\n".join(['"Time (s)","Force (lbf)","Acceleration (g)"', *rows])
    (tmp_path / "hit.csv").write_text(("\ufeff" if encoding == "utf-16-le" else "") + text, encoding=encoding)
    assert np.abs(read_records(tmp_path / "hit.csv").records[0].samples - SI).max() < 1e-5


def test_a_date_above_responses_is_no_column_of_time(tmp_path):
    rows = "".join(f"{line},1e-6,-1e-6\n" for line in range(1, 20))
    (tmp_path / "tip.csv").write_text("Date,2026-11-23\nTime: 10:00\nHz,real,imaginary\n" + rows)
    assert read_frf(tmp_path / "tip.csv").frequency.size == 19


@pytest.mark.parametrize(("texts", "words"), [
    (["force 5:-z"], "`channel` 'force 5:-z'"), (["9=force"], "no channel '9'"), (["a=kraft"], "'kraft' is no quantity"),
    (["a=force 2pC/N"], "charge sensors"), (["a=force", "1=acceleration"], "described twice"),
    (["a=force 0mV/N"], "must not be zero")])
def test_wrong_channels_are_named(tmp_path, texts, words):
    path = text(tmp_path / "hit.csv", "time [s],a [V],b [V]\n", np.column_stack([TIME, SI]))
    with pytest.raises(ToolpointError, match=words):
        read_records(path, texts)


def test_records_of_other_rates_are_refused_by_name(tmp_path):
    first = text(tmp_path / "a.csv", "time [s],force [N],acc [g]\n", np.column_stack([TIME, SI]))
    second = text(tmp_path / "b.csv", "time [s],force [N],acc [g]\n", np.column_stack([2 * TIME, SI]))
    with pytest.raises(ToolpointError, match=r"b\.csv: 500 samples a second beside 1000 of a\.csv"):
        read_records([first, second])


def test_names_of_files_say_where_was_struck(tmp_path):
    paths = [text(tmp_path / f"P{k}_{n}.csv", "time [s],force [N],acc [g]\n", np.column_stack([TIME, SI]))
             for k in ("3-z", "4-z") for n in (1, 2)]
    records = read_records(paths, pattern="P{input}_*").records
    assert [str(record.channels[0]) for record in records] == ["3:-z", "3:-z", "4:-z", "4:-z"]
    with pytest.raises(ToolpointError, match=r"does not fit 'P3-z_1.csv'"):
        read_records(paths, pattern="Q{input}_*")
    with pytest.raises(ToolpointError, match=r"unknown place {point}"):
        read_records(paths, pattern="P{point}_*")
    with pytest.raises(ToolpointError, match="names no point"):
        read_records(paths, pattern="P*")
    assert read_names([Path("at_7z_from_2.txt")], "at_{output}_from_{input}")[0].output == Dof(7, "+z")
    assert [str(dof_of(t)) for t in ("5", "5:-z", "5=+rx", "tip+y", "12x")] == ["5:+x", "5:-z", "5:+rx", "tip:+y", "12:+x"]


def test_time_data_given_as_responses_are_sent_to_frf(tmp_path):
    path = text(tmp_path / "hit.csv", "time [s],force [N],acc [g]\n", np.column_stack([TIME, SI]))
    savemat(tmp_path / "a.mat", {"fs": RATE, "force": FORCE, "acc": MOTION})
    uff.write(tmp_path / "d.uff", Record(SI, RATE, ("5:-z", "6:+x"), ("force", "acceleration")))
    for file in (path, tmp_path / "a.mat", tmp_path / "d.uff"):
        with pytest.raises(ToolpointError, match=r"toolpoint frf .* --save responses.h5"):
            read_frf(file)


def test_a_test_file_round_trips_and_names_its_faults(tmp_path):
    channels = (ChannelDescription("1", "force", "5:-z", "2.25 mV/N"), ChannelDescription("Acc \"2\"", "acceleration"))
    given = HammerTestDescription("bed", (RecordsDescription(("a_*.csv",), "5:-z"),), channels, "Hv", 1.5, 0.1, 2000.0,
                                  None, {"a_1.csv#2": "refused"})
    path = tmp_path / "test.yaml"
    test_file.write(given, path)
    assert test_file.read(path) == given
    with pytest.raises(ToolpointError, match="exists already; nothing was written"):
        test_file.write(given, path)
    path.write_text("toolpoint: 1\ntest: x\nrecords: [{file: a}]\nestimator: H3\nhits: {a: maybe}\n")
    with pytest.raises(ToolpointError) as error:
        test_file.read(path)
    assert all(word in str(error.value) for word in ("unknown key 'file'", "'H3'", "'maybe'"))
    assert json.dumps(test_file.json_schema())


def test_a_pattern_of_records_that_fits_nothing_is_named(tmp_path):
    from toolpoint.io.measured.record_files import read_test

    with pytest.raises(ToolpointError, match=r"no file fits 'hit_\*.csv'"):
        read_test(HammerTestDescription("x", (RecordsDescription(("hit_*.csv",)),)), tmp_path)
    assert parse_channel("acc 1=acceleration tip:+x 100 mV/g").sensitivity == "100mV/g"


def test_files_of_one_rate_and_several_lengths_are_one_test(tmp_path):
    """A rate that is no whole number comes out of times of files of other lengths with other last digits."""
    rate, rng = 1706.6666666, np.random.default_rng(1)
    for number, count in enumerate((3000, 3177, 2900)):
        time = np.arange(count) / rate
        force = np.where((time > 0.2) & (time < 0.21), 100 * np.sin(np.pi * (time - 0.2) / 0.01), 0)
        motion = np.where(time > 0.2, np.exp(-30 * (time - 0.2)) * np.sin(250 * (time - 0.2)), 0)
        motion += 1e-4 * rng.normal(size=count)
        rows = "".join(f"{t:.8f},{f:.6g},{a:.6g}\n" for t, f, a in zip(time, force, motion, strict=True))
        (tmp_path / f"blow{number}.csv").write_text("time [s],force 1:+x [N],acceleration 1:+x [m/s^2]\n" + rows)
    assert study_hammer_records(read_records(sorted(tmp_path.glob("*.csv")))).used == 3
