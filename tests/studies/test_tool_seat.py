"""Doubts of where a machine's tool sits, and the depths at which charts end."""

from dataclasses import replace

import numpy as np

from conftest import MACHINES
from toolpoint import io
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import build
from toolpoint.studies import chart_lobes, machine_dynamics
from toolpoint.studies.machines.tool_seat import question_tool_seat

MACHINE = io.read_machine(MACHINES / "three_axis_vertical_drives.yaml")


def test_tool_and_table_on_one_body_are_grave():
    description = MACHINE.description
    points = {**description.points, description.table: replace(description.points[description.table],
                                                               body=description.points[description.tool].body)}
    doubts = question_tool_seat(build(replace(description, points=points)))
    assert doubts[0].grave and "both on body" in doubts[0]


def test_a_tip_on_a_heavy_head_is_doubted_and_its_cut_is_given():
    doubts = question_tool_seat(MACHINE)
    assert len(doubts) == 1 and not doubts[0].grave and "no spindle, holder or tool vibrates" in doubts[0]
    assert machine_dynamics(MACHINE).withheld == []


def test_charts_end_at_the_edges_and_say_so():
    speeds = np.array([3000.0, 9000.0])
    short = chart_lobes(machine_dynamics(MACHINE), {"deepest": 1e-5}, speeds=speeds)
    data = short.to_dict()
    assert data["depth_max_m"] == 1e-5 and data["is_end_of_search"] == [True, True]
    assert any("end of the searched depths (the deepest cut that was asked for)" in note for note in short.chart.notes)
    assert "end of the searched depths" in short.advice[0][-1]
    flutes = chart_lobes(machine_dynamics(MACHINE), {"flute_length": 2e-5}, speeds=speeds)
    assert flutes.chart.depth_max == 2e-5 and any("the length of the edges" in note for note in flutes.chart.notes)


def test_the_depth_of_the_edges_is_two_diameters_where_it_is_not_given():
    cut = CuttingDescription.of(diameter=0.02, teeth=4, immersion=0.5, tangential=8e8, normal=2e8)
    assert cut.depth_end[0] == 0.04 and cut.with_values({"flute_length": 0.03}).depth_end[0] == 0.03
    assert cut.with_values({"flute_length": 0.03, "deepest": 0.01}).depth_end[0] == 0.01
