"""Every kind that a file can have is read by its kind."""

from importlib import resources

import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml.file_kinds import kind_of, read_kind


def test_a_machine_file_is_read_by_the_kind_that_it_is_recognised_as():
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        words, machine = read_kind(path, kind_of(path))
    assert words.startswith("a machine, ") and machine.body_names


def test_an_unknown_kind_is_refused_by_name(tmp_path):
    with pytest.raises(ToolpointError, match=r"kind.*must be one of"):
        read_kind(tmp_path / "x.yaml", "shafts")
