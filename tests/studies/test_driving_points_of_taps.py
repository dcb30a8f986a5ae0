"""Law: a driving point is judged on the lines that can be believed, alike in the check, the doubts and the tip's door."""

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from toolpoint.io import read_machine
from toolpoint.signals import driving_points
from toolpoint.studies import study_responses_of_machine
from toolpoint.studies.cuts.tip_doubts import question_tip
from toolpoint.studies.machines.virtual_test import Hammer, Imperfections, hammer_records
from toolpoint.studies.measured.hammer_study import study_hammer_records
from toolpoint.vibration import Dof, Modes


def tap(seed, contact=1.5e-4, noise=0.0):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 6))
    frequency = 150 * np.cumprod(1 + rng.uniform(0.2, 0.8, count))
    shape = np.sign(rng.normal(size=(1, count))) * rng.uniform(0.2, 1.0, (1, count))
    modes = Modes(frequency, rng.uniform(0.005, 0.05, count), shape, (Dof("tip", "+x"),))
    spoilt = None if not noise else Imperfections(noise=noise)
    record = hammer_records(modes, "tip:+x", ["tip:+x"], rng=rng, imperfections=spoilt,
                            hammer=Hammer(contact=contact, sample_rate=12800.0, block=1.0))
    return study_hammer_records([record])


@pytest.mark.parametrize("seed", range(7))
def test_a_perfect_tap_has_a_driving_point(seed):
    study = tap(seed)
    assert not study.doubts and study.driving[0].share == 1.0 and not study.driving[0].doubts
    assert study.to_dict()["driving_points"] == [{"dof": "tip:+x", "passive_share": 1.0, "doubts": []}]


@pytest.mark.parametrize("seed", range(3))
def test_lines_without_force_are_not_asked(seed):
    # A soft tip: above about 1.5 kHz of 5 kHz there is noise alone, half of which gives off power.
    study = tap(seed, contact=1e-3, noise=1e-3)
    assert study.band.high < 0.7 * study.frf.frequency[-1]
    assert study.driving[0].share > 0.98
    assert not any("driving point" in doubt for doubt in study.doubts)


@pytest.mark.slow
def test_check_doubts_and_door_say_the_same():
    frf = tap(1).frf
    for slip in (-1.0, np.exp(-2j * np.pi * frf.frequency * 1e-4)[:, None, None]):
        wrong = type(frf)(frf.frequency, frf.values * slip, frf.outputs, frf.inputs, frf.quantity)
        check = driving_points(wrong)[0]
        assert check.doubts and [str(d) for d in check.doubts] == [str(d) for d in question_tip(wrong)]


def test_overlapping_modes_of_a_machine_are_no_delay():
    """Exact responses of a template, 14 modes with 3 % of damping: overlapped peaks turn alike, and nothing is late."""
    machine = read_machine(resources.files("toolpoint.io") / "templates" / "machine" / "three-axis-horizontal.yaml")
    frf = study_responses_of_machine(machine, [{}]).frfs[0]
    assert [check.doubts for check in driving_points(frf)] == [()] * 3
    late = replace(frf, values=frf.values * np.exp(-2j * np.pi * frf.frequency * 2e-3)[:, None, None])
    assert all("delay of about +" in str(check.doubts[0]) for check in driving_points(late))
