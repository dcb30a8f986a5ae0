"""Comparison of two tests in the workbench: by the date of their files, with intervals; a machine is no test."""

import os

import numpy as np
import pytest

from toolpoint.io.measured.noun_writing import write_modes
from toolpoint.vibration import Modes
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.catalogue import view_of


@pytest.fixture
def tested(folder):
    shapes, labels = np.array([[0.1, 0.05], [0.02, -0.1]]), ["tool:+x", "tool:+y"]
    for name, frequency, day in (("may.h5", [80.0, 120.0], 1746100000), ("june.h5", [78.0, 120.0], 1748800000)):
        write_modes(Modes(frequency, 0.02, shapes, labels), folder / name)
        os.utime(folder / name, (day, day))
    return folder


def test_two_tests_stand_side_by_side_with_their_dates(tested):
    view = view_of(Desk(tested), "compare", {"first": "may.h5", "second": "june.h5"})
    assert view.answer.startswith("june.h5, 2025-06-01 beside may.h5, 2025-05-01: 2 modes are paired")
    assert "-2.50 %" in view.answer and view.data["test_rows"][0][:3] == ["1", "80.000", "78.000"]
    assert view.commands == ("toolpoint compare may.h5 june.h5",)
    assert any("dates" in str(doubt) for doubt in view.doubts)


def test_a_machine_and_a_test_and_a_test_with_itself_are_answered_in_words(tested):
    desk = Desk(tested)
    assert "two kinds" in view_of(desk, "compare", {"first": "machine.yaml", "second": "june.h5"}).answer
    assert "beside itself" in view_of(desk, "compare", {"first": "may.h5", "second": "may.h5"}).answer
    assert {"may.h5", "june.h5", "machine.yaml"} <= set(view_of(desk, "compare").data["files"])
