"""Which noun files hold, and hammer tests with the description of their records."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io import hold_records, read_described_records, read_hammer_test, read_measured, read_test_nouns, write_noun
from toolpoint.io.yaml.testing import test_file
from toolpoint.studies import pair_measurements
from toolpoint.vibration import Frf, Modes, Record

FRF = Frf(np.array([1.0, 2.0, 3.0]), np.full((3, 1, 1), 1e-6 + 1e-7j), ("tip:+x",), ("tip:+x",))
MODES = Modes(np.array([10.0]), np.array([0.02]), np.ones((1, 1)), ("tip:+x",))
RECORD = Record(np.random.default_rng(0).normal(size=(64, 2)), 64.0, ("tip:+x", "tip:+x"), ("force", "acceleration"))


@pytest.fixture
def files(tmp_path):
    """One file of every noun, and a second one of modes."""
    nouns = {"frf": FRF, "modes": MODES, "record": RECORD, "more": MODES}
    for name, noun in nouns.items():
        write_noun(noun, tmp_path / f"{name}.h5")
    return {name: tmp_path / f"{name}.h5" for name in nouns}


def test_what_is_written_is_read_as_the_same_noun(files):
    assert isinstance(read_measured([files["frf"]]), Frf) and isinstance(read_measured([files["modes"]]), Modes)
    record = read_measured([files["record"]])
    assert isinstance(record, Record) and np.array_equal(record.samples, RECORD.samples)


def test_a_test_is_modes_and_responses_and_no_guess_between_several(files):
    modes, frf = read_test_nouns([files["modes"], files["frf"]])
    assert isinstance(modes, Modes) and isinstance(frf, Frf)
    assert read_test_nouns([files["frf"]])[0] is None and read_test_nouns([files["modes"]])[1] is None
    with pytest.raises(ToolpointError, match="must be one file of modes"):
        read_test_nouns([files["modes"], files["more"]])


def test_records_and_responses_are_not_mixed(files):
    assert hold_records([files["record"]]) and not hold_records([files["frf"]])
    with pytest.raises(ToolpointError, match="must be one kind"):
        hold_records([files["record"], files["frf"]])


def test_a_test_file_is_read_alone_and_names_its_records(files, tmp_path):
    records, described = read_described_records([files["record"]], folder=tmp_path, block=0.5)
    assert described.records[0].files == ("record.h5",) and described.block == 0.5
    decided = described.with_decisions({records.names[0]: False, "other": True})
    test_file.write(decided, tmp_path / "test.yaml")
    again, description = read_hammer_test([tmp_path / "test.yaml"])
    assert description == decided and again.decisions == {records.names[0]: False, "other": True}
    with pytest.raises(ToolpointError, match="names its records itself"):
        read_hammer_test([tmp_path / "test.yaml", files["record"]])


@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_a_struck_side_needs_the_pattern_of_the_other(files):
    """It would be left unread, and the responses taken for those of another point."""
    with pytest.raises(ToolpointError, match="given without `name`"):
        read_measured([files["frf"]], struck="tip:+y")


def test_measurements_are_paired_with_poses_in_their_order():
    here, there = {"X": 0.0}, {"X": 0.2}
    joined = pair_measurements([MODES], [FRF], [here])
    assert [(part.modes, part.frf, part.pose) for part in joined] == [(MODES, FRF, here)]
    repeated = pair_measurements([MODES, MODES], [FRF])
    assert [(part.modes is None, part.frf is None, part.pose) for part in repeated] == [
        (False, True, None), (False, True, None), (True, False, None)]
    several = pair_measurements([], [FRF, FRF], [here, there])
    assert [part.pose for part in several] == [here, there] and all(part.modes is None for part in several)
    with pytest.raises(ToolpointError, match="1 files for 2 poses"):
        pair_measurements([MODES], [], [here, there])
    with pytest.raises(ToolpointError, match="at least one measurement"):
        pair_measurements([], [])
