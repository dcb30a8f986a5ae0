"""Poles that a person chose for a test of a project: the modes follow, the choice is a doubt, and it can be taken back."""

from __future__ import annotations

import json

import numpy as np
import pytest

from toolpoint import ToolpointError, io
from toolpoint.project import Project
from toolpoint.vibration import Modes, frequency_response

FREQUENCY = (20.0, 45.0)  # Hz of the structure's modes


@pytest.fixture
def folder(tmp_path):
    rng = np.random.default_rng(3)
    modes = Modes(FREQUENCY, [0.02, 0.02], rng.normal(size=(3, 2)), ("1:+x", "2:+x", "3:+x"))
    io.write_frf(frequency_response.modal(modes, np.linspace(5, 80, 300), inputs=["1:+x"], quantity="accelerance"),
                 tmp_path / "test.h5")
    (tmp_path / "project.yaml").write_text("toolpoint: 1\nname: Test\ntests:\n  structure: {responses: [test.h5]}\n")
    return tmp_path


def frequencies(folder):
    Project.open(folder).run(["modes/structure"])
    return json.loads((folder / "results/modes/structure/modes.json").read_text())["frequency_hz"]


def test_a_removed_mode_is_gone_after_the_next_run_and_comes_back_when_the_choice_is_taken_back(folder):
    assert frequencies(folder) == pytest.approx(FREQUENCY, rel=1e-3)
    place = Project.open(folder).choose_poles("structure", "toolpoint: 1\nremove:\n  - 45 Hz\n")
    states = {entry.step.name: entry for entry in Project.open(folder).outlook()}
    assert not states["modes/structure"].is_of_today and f"--choice {place}" in states["modes/structure"].step.command
    assert frequencies(folder) == pytest.approx(FREQUENCY[:1], rel=1e-3)
    record = next(entry.record for entry in Project.open(folder).outlook() if entry.step.name == "modes/structure")
    assert any("chosen by hand" in str(doubt.doubt) for doubt in record.doubts)  # whoever reads the modes is told
    Project.open(folder).choose_poles("structure", "")
    assert frequencies(folder) == pytest.approx(FREQUENCY, rel=1e-3)


@pytest.mark.parametrize(("test", "text", "words"), [
    ("structure", "remove: 45 kg", "45 kg"), ("structure", "toolpoint: 1\n", "changes nothing"),
    ("tip", "", "must be one whose modes")])
def test_what_is_no_choice_or_no_test_is_refused_and_nothing_is_written(folder, test, text, words):
    with pytest.raises(ToolpointError, match=words):
        Project.open(folder).choose_poles(test, text)
    assert not (folder / "choices").exists() or not list((folder / "choices").iterdir())
