"""A kind of remark stands once, with its range: from sampled charts, chatter maps; the terminal's table of sensitivities."""

import numpy as np

from conftest import MACHINES
from toolpoint.io.yaml import machine_file
from toolpoint.studies import chart_lobes, modal_dynamics
from toolpoint.studies.cuts.uncertain_cut import Uncertainty
from toolpoint.studies.machines.sensitivity_study import MAX_PRINTED_PARAMETERS, study_sensitivity
from toolpoint.studies.remark_kinds import first_of_each_kind
from toolpoint.vibration import Modes


def test_remarks_that_differ_in_numbers_alone_become_one_with_the_range():
    remarks = ["3 % of K2 at 10.5 Hz", "7 % of K2 at 9.5 Hz", "nothing", "5 % of K2 at 1e3 Hz", "nothing"]
    assert first_of_each_kind(remarks) == ("3 to 7 % of K2 at 9.5 to 1e3 Hz", "nothing")
    assert first_of_each_kind(["a 1", "b 1"]) == ("a 1", "b 1")


def test_a_hundred_samples_bring_no_hundred_notes(recwarn):
    """A noticeable lower residual is warned of at every sampled chart, each time with its own numbers."""
    shape = np.eye(2) / np.sqrt(0.03993)
    modes = Modes([922.0, 922.0], 0.011, shape, ("tip:+x", "tip:+y"), lower_residual=100 * np.ones((2, 2)))
    cut = {"diameter": 0.012, "teeth": 2, "tangential": 6e8, "normal": 2e8, "immersion": 0.05, "direction": "down"}
    result = chart_lobes(modal_dynamics(modes), cut, speeds=np.linspace(8000, 12000, 5), uncertainty=Uncertainty(samples=20))
    about = [note for note in result.chart.notes if "lower residual" in note and "sampled" in note]
    assert len(about) == 1 and " to " in about[0]
    assert len({str(w.message) for w in recwarn if "lower residual" in str(w.message)}) <= 1


def test_the_table_of_sensitivities_shows_those_that_matter():
    study = study_sensitivity(machine_file.read(MACHINES / "three_axis_vertical_drives.yaml"))
    assert len(study.paths) > 2 * MAX_PRINTED_PARAMETERS
    lines = study.table().splitlines()
    assert len(lines) <= 2 * MAX_PRINTED_PARAMETERS + 3
    strongest = study.paths[int(np.argmax(np.abs(study.frequency).max(axis=1)))]
    assert lines[1].startswith(strongest)
    assert len(study.to_dict()["relative_sensitivity"]) == len(study.paths)
