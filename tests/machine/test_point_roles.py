"""Roles in labels: `tool` and `table` stand for the points of a machine that have these roles, where no point has the name."""

from dataclasses import replace

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.machine import build
from toolpoint.studies import study_responses_of_machine

LINES = np.linspace(10.0, 200.0, 5)


def response(machine, label):
    return study_responses_of_machine(machine, [{}], [label], inputs=[label], frequency=LINES).frfs[0].values


def renamed(machine, table):
    """The machine with points `tip` and `bench` in place of its tool and table; `table` names the one in that role, or none."""
    description = machine.description
    points = {"tip": description.points[description.tool], "bench": description.points[description.table]}
    return build(replace(description, points=points, tool="tip", table=table))


def test_roles_are_the_points_that_have_them():
    machine = renamed(read_machine(MACHINES / "three_axis_vertical.yaml"), "bench")
    for by_role, by_name in (("tool-table:+x", "tip-bench:+x"), ("tool:+y", "tip:+y"), ("tip-table:+z", "tip-bench:+z")):
        assert np.array_equal(response(machine, by_role), response(machine, by_name)), by_role


def test_the_relative_response_is_made_of_those_of_both_points():
    """G = G_tt - G_tw - G_wt + G_ww, by motions of the two points against the ground."""
    machine = renamed(read_machine(MACHINES / "three_axis_vertical.yaml"), "bench")
    both = ["tip:+x", "bench:+x"]
    parts = study_responses_of_machine(machine, [{}], both, inputs=both, frequency=LINES).frfs[0].values
    expected = parts[:, 0, 0] - parts[:, 0, 1] - parts[:, 1, 0] + parts[:, 1, 1]
    assert response(machine, "tool-table:+x")[:, 0, 0] == pytest.approx(expected, rel=1e-9)


def test_the_ground_is_the_table_where_none_is_named():
    machine = renamed(read_machine(MACHINES / "three_axis_vertical.yaml"), None)
    assert np.array_equal(response(machine, "tool-table:+x"), response(machine, "tip:+x"))


def test_what_is_neither_point_nor_role_is_refused():
    machine = renamed(read_machine(MACHINES / "three_axis_vertical.yaml"), "bench")
    with pytest.raises(ToolpointError, match="no 'tool-desk'"):
        response(machine, "tool-desk:+x")
