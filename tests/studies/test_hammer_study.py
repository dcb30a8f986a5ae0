"""A hammer test from its records to responses: groups of struck Dofs, verdicts by name, decisions, all bad; the band."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from signals.hammer_case import DURATION, MODES, RATE, struck, truth
from toolpoint import Frf, Record, ToolpointError, ToolpointWarning
from toolpoint.modal_identification import identify, without_window
from toolpoint.signals.record_set import RecordSet
from toolpoint.signals.usable_band import usable_band
from toolpoint.studies.measured.hammer_study import study_hammer_records

DATA = Path(__file__).parents[2] / ".." / "shared" / "data"


def named(*heights: float, at: str = "1:+x", **more) -> RecordSet:
    """Return a set of one hit a record."""
    records = tuple(struck([height], at=at, **more) for height in heights)
    return RecordSet(records, tuple(f"{at[0]}_{k}.csv" for k in range(1, len(records) + 1)))


def both(first: RecordSet, second: RecordSet) -> RecordSet:
    return RecordSet(first.records + second.records, first.names + second.names)


def test_two_struck_points_give_two_columns_and_are_reciprocal():
    study = study_hammer_records(both(named(100, 80, 90), named(100, 110, 95, at="2:+x")))
    assert study.used == 6 and [str(dof) for dof in study.frf.inputs] == ["1:+x", "2:+x"]
    assert len(study.pairs) == 1 and study.pairs[0].agreement > 0.999 and all(check.share > 0.95 for check in study.driving)
    exact = truth(study.frf.frequency)[:, :, 0]
    assert np.abs(study.frf.values[20:300, :, 0] - exact[20:300]).max() < 0.02 * np.abs(exact).max()
    assert "6 of 6 hits used" in study.table() or "from 6 of 6 hits" in study.status
    assert study.to_dict()["hits"][0]["name"] == "1_1.csv"


def test_verdicts_carry_names_and_a_person_decides():
    given = named(100, 9, 90, 95)
    study = study_hammer_records(given)
    assert [v.verdict for v in study.verdicts] == ["accepted", "refused", "accepted", "accepted"]
    assert "weak hit" in study.rows()[1][4]
    study = study_hammer_records(given, decisions={"1_2.csv": True, "1_1.csv": False})
    assert [v.verdict for v in study.verdicts] == ["refused by hand", "accepted by hand", "accepted", "accepted"]
    with pytest.raises(ToolpointError, match=r"no such hit; did you mean '1_3.csv'"):
        study_hammer_records(given, decisions={"1_3.cs": False})


def test_all_hits_bad_is_an_error_with_every_name_and_reason():
    given = named(100, 90)
    cut = RecordSet(tuple(replace(record, samples=record.samples[203:]) for record in given.records), given.names)
    with pytest.raises(ToolpointError, match=r"1_1\.csv: the record begins within the pulse.*1_2\.csv: the record begins"):
        study_hammer_records(cut)


def test_a_struck_point_without_a_good_hit_is_left_out_and_doubted():
    bad = named(100, 90, at="2:+x")
    cut = RecordSet(tuple(replace(record, samples=record.samples[203:]) for record in bad.records), bad.names)
    study = study_hammer_records(both(named(100, 80, 90), cut))
    assert [str(dof) for dof in study.frf.inputs] == ["1:+x"]
    assert study.doubts[0].startswith("left out: struck at 2:+x")


def test_a_sensor_without_a_good_hit_at_one_struck_point_is_left_out_of_both():
    """A sensor that is moved: its record at one of two struck points is cut off."""
    def records(last: int) -> RecordSet:
        """Return a record a sensor and struck point; last : first sample of that of sensor 3 struck at 2."""
        parts, names = [], []
        for at in ("1:+x", "2:+x"):
            whole_record = struck([100.0, 100.0], at=at)
            for sensor in (1, 2, 3):
                first = last if (at, sensor) == ("2:+x", 3) else 0
                samples = whole_record.samples[first:, [0, sensor]]
                parts.append(Record(samples, RATE, [at, f"{sensor}:+x"], ("force", "velocity")))
                names.append(f"{at[0]}_{sensor}.csv")
        return RecordSet(tuple(parts), tuple(names))

    study = study_hammer_records(records(0), duration=DURATION)
    assert len(study.frf.outputs) == 3 and study.doubts == ()
    one = records(0).records[4]  # of sensor 2 struck at 2: its second hit is taken away
    single = replace(one, samples=one.samples[:2600])
    given = records(0)
    with pytest.warns(ToolpointWarning, match="one hit only"):
        study = study_hammer_records(RecordSet((*given.records[:4], single, given.records[5]), given.names), duration=DURATION)
    assert any("in 1 of 6 set-ups (struck / first sensor: 2:+x / 2:+x)" in doubt for doubt in study.doubts)
    study = study_hammer_records(records(2403), duration=DURATION)
    assert [str(dof) for dof in study.frf.outputs] == ["1:+x", "2:+x"] and len(study.frf.inputs) == 2
    assert study.doubts[0].startswith("left out: struck at 2:+x") and study.doubts[1].startswith("sensors 3:+x: they lack")


def test_struck_points_share_one_window_and_block():
    light = MODES.with_damping([0.0008, 0.02, 0.02])
    study = study_hammer_records(both(named(100, 90, 95), named(100, 90, 95, at="2:+x", modes=light)), duration=DURATION)
    assert study.frf.decay > 0 and {test.frf.decay for test in study.tests} == {study.frf.decay}


def test_the_window_is_taken_out_by_the_modes():
    light = MODES.with_damping([0.0008, 0.02, 0.02])
    study = study_hammer_records(named(100, 90, 95, 105, modes=light), duration=DURATION)
    frf = study.frf.between(30, 320)
    free = without_window(frf, identify(frf).modes)
    exact = truth(frf.frequency, modes=light)
    near = np.abs(frf.frequency - 60) > 0.5  # the peak itself is narrower than a line
    error, before = (np.abs(values - exact)[near].max() / np.abs(exact[near]).max() for values in (free.values, frf.values))
    assert error < 0.06 and before > 4 * error and free.decay == 0


def test_swapped_channels_and_no_force_are_named():
    record = struck([100.0], modes=MODES.with_damping(0.01))
    swapped = Record(record.samples[:, [1, 0, 2, 3]], RATE, record.channels, record.quantities)
    with pytest.raises(ToolpointError, match="wrong channel"):
        study_hammer_records([swapped])
    with pytest.raises(ToolpointError, match="0 force channels"):
        study_hammer_records([record.selected([1, 2])])


def test_lines_that_only_drift_or_noise_show_are_left_out():
    rng = np.random.default_rng(0)
    lines = np.arange(0.0, 4001)
    s = 2j * np.pi * lines
    receptance = sum(1 / (s**2 + 2 * 0.03 * w * s + w**2) for w in 2 * np.pi * np.array([700.0, 1500, 2100]))
    noise = 3.0 * (rng.standard_normal(lines.size) + 1j * rng.standard_normal(lines.size)) * 1e-2
    drifting = receptance + np.where(lines > 0, noise / np.maximum(np.abs(s), 1) ** 2, 5.0)
    band = usable_band(Frf(lines, drifting[:, None, None], ["1:+x"], ["1:+x"]))
    assert 30 < band.low < 400 and "drift" in band.notes[0]
    clean = usable_band(Frf(lines, receptance[:, None, None], ["1:+x"], ["1:+x"]))
    assert clean.ends == (1.0, 4000.0) and not clean.notes
    loud = drifting + 1e-7 * np.where(lines > 3000, 1, 0) * rng.standard_normal(lines.size)
    assert 2500 < usable_band(Frf(lines, loud[:, None, None], ["1:+x"], ["1:+x"])).high < 3200


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("modes", [((412.0, 0.02, 1e7), (935.0, 0.013, 1e7)), ((935.0, 0.013, 1e7), (1700.0, 0.02, 6e8))])
def test_a_mode_behind_a_gap_of_noise_belongs_to_the_band(seed, modes):
    """Between a weak mode and a strong one the accelerance passes below the noise of the sensor over more windows than end a
    band: the weak mode stands out of the noise again, below and above the strong one; pure noise beyond stays out."""
    rng = np.random.default_rng(seed)
    lines = np.arange(1.0, 4001)
    values = sum(-(2 * np.pi * lines) ** 2 / (k * (1 - (lines / f) ** 2 + 2j * z * lines / f)) for f, z, k in modes)
    values[(lines > modes[0][0] * 1.25) & (lines < modes[1][0] * 0.8)] *= 1e-3  # antiresonance
    values[lines > 2200] = 0
    values += 0.004 * np.abs(values).max() * (rng.standard_normal(lines.size) + 1j * rng.standard_normal(lines.size))
    band = usable_band(Frf(lines, values[:, None, None], ["1:+x"], ["1:+x"], "accelerance"))
    assert band.low < modes[0][0] and modes[1][0] < band.high < 2350


@pytest.mark.parametrize("seed", range(4))
def test_strong_modes_far_below_a_louder_one_are_no_drift(seed):
    """A machine on its feet beside its spindle: as accelerance the low modes are faint, and noise fills the lines between."""
    rng = np.random.default_rng(seed)
    lines = np.arange(60.0, 2000, 0.25)
    modes = (85.0, 0.014, 1.0), (158.0, 0.008, 0.3), (1750.0, 0.007, 20.0)
    values = sum(a / (f**2 - lines**2 + 2j * z * f * lines) for f, z, a in modes)
    noise = rng.standard_normal(lines.size) + 1j * rng.standard_normal(lines.size)
    values += 3e-2 * np.sqrt((np.abs(values) ** 2).mean()) * noise
    band = usable_band(Frf(lines, values[:, None, None], ["1:+x"], ["1:+x"]))
    assert band.low < 85 and band.high > 1750


@pytest.mark.slow
def test_measured_beam_from_its_file():
    path = DATA / "beam_hammer" / "acceleration.lvm"
    if not path.exists():
        pytest.skip("the measured data are not beside this project")
    from toolpoint.io import read_records

    with pytest.warns(ToolpointWarning, match="one hit only"):
        study = study_hammer_records(read_records(path))
    assert study.used == 1 and study.band.high == pytest.approx(6395, rel=0.02)
    assert all(any(words in doubt for doubt in study.doubts) for words in ("one hit only", "not a driving point"))
