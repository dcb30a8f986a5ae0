"""`toolpoint drive`: gains out of sense are doubted before the figures, the servo of the template is not."""

from __future__ import annotations

import pytest

from toolpoint.drives.controller.loop_doubts import doubt_margins
from toolpoint.io import read_drives
from toolpoint.io.template_files import read_template
from toolpoint.studies import run_drives

CIRCLE = (0.01, 4.0 / 60)  # m, m/s


def experiment(tmp_path, before="", after=""):
    """Return the circle of the template's servo with a word of it changed."""
    text = read_template("servo")
    assert before in text
    (tmp_path / "servo.yaml").write_text(text.replace(before, after) if before else text, encoding="utf-8")
    return run_drives(read_drives(tmp_path / "servo.yaml"), circle=CIRCLE)


def test_the_template_is_not_doubted(tmp_path):
    result = experiment(tmp_path)
    assert result.doubts == [] and "doubt" not in result.table()


@pytest.mark.parametrize(("before", "after", "words"), [
    ("gain: 60 1/s", "gain: 600 1/s", "phase margin"), ("gain: 60 1/s", "gain: 1.5 1/s", "no machine's axis"),
    ("gain: 60 1/s", "gain: 5 1/s", "beside the circle"), ("sample_time: 1 ms", "sample_time: 20 ms", "gain margin")])
def test_gains_out_of_sense_are_doubted_first(tmp_path, before, after, words):
    result = experiment(tmp_path, before, after)
    assert any(words in doubt for doubt in result.doubts)
    assert result.table().startswith("doubt:") and result.to_dict()["doubts"]


def test_margins_at_their_limits():
    row = lambda gain, phase, width: [("velocity", "X", gain, phase, width)]
    assert doubt_margins(row(6.1, 31.0, 50.0)) == []
    assert "5.9 dB" in doubt_margins(row(5.9, 31.0, 50.0))[0] and "29.0°" in doubt_margins(row(8.0, 29.0, 50.0))[0]
    assert "half the sample rate" in doubt_margins(row(8.0, 60.0, float("nan")))[0]
