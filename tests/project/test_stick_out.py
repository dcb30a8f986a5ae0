"""Stick-out of a project's coupled tool: the same as receptance coupling by hand, its bounds, the slider of the workbench."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.project import Project
from toolpoint.samples import write_samples
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.lobes_view import limit_deed
from toolpoint.workbench.views.stick_out import stick_out_slider

PROJECT = """toolpoint: 1
name: coupled
coupling: {tool: tool.yaml, segment: shank, gauge: gauge.yaml, responses: [gauge.uff], noise: 0.3 %}
cuts:
  half: {diameter: 16 mm, teeth: 4, immersion: 0.5, tangential: 800 MPa, normal: 250 MPa, speeds: 6000 14000 rpm}
draws: 20
"""


@pytest.fixture
def folder(tmp_path):
    write_samples("rcsa", tmp_path / "mill")
    (tmp_path / "mill/project.yaml").write_text(PROJECT)
    return tmp_path / "mill"


@pytest.mark.slow
def test_tip_at_a_stick_out_is_that_of_the_coupled_shaft(folder):
    """The likeliest tip is the receptance coupling of the same shaft with that length, computed by hand here."""
    coupled = Project.open(folder).coupled_tool(0.085, draws=20)
    bases = studies.bases_from_gauge(io.read_frf([folder / "gauge.uff"]), io.read_shaft(folder / "gauge.yaml"), noise=0.003,
                                     draws=20, generator=np.random.default_rng(1))
    by_hand = studies.study_tool(bases, io.read_shaft(folder / "tool.yaml").with_length("shank", 0.085),
                                 generator=np.random.default_rng(1))
    assert np.allclose(coupled.coupled.tips[0].values, by_hand.tips[0].values, rtol=1e-9)
    longer = coupled.nominal({}).response.values[:, 0, 0]
    shorter = Project.open(folder).coupled_tool(0.06, draws=20).nominal({}).response.values[:, 0, 0]
    assert np.abs(longer).max() > np.abs(shorter).max()
    assert any("no tool was struck at this length" in doubt for doubt in coupled.doubts)


@pytest.mark.slow
def test_slider_has_the_described_length_and_a_move_changes_the_limit_and_both_lines_that_give_it(folder):
    desk = Desk(folder)
    slider = stick_out_slider(Project.open(folder))
    assert slider["segment"] == "shank" and slider["value"] == pytest.approx(0.07)
    answers = [limit_deed(desk, MachineRequest.of({"speed": 9000, "stick_out": length})) for length in (0.06, 0.09)]
    limits = [answer["limit"]["limit_m"] for answer in answers]
    assert limits[0] > limits[1] > 0
    assert "--stick-out shank=90mm:90mm:1" in answers[1]["commands"][0] and "stick_out=0.09" in answers[1]["calls"][0]


def test_without_a_described_tool_the_slider_is_absent_with_the_reason_and_a_far_length_is_refused(folder):
    with pytest.raises(ToolpointError, match="within a factor"):
        Project.open(folder).coupled_tool(0.3, draws=20)
    lines = [line for line in PROJECT.splitlines() if not line.startswith("coupling")]
    (folder / "project.yaml").write_text("\n".join(lines))
    assert "the tool is not described" in stick_out_slider(Project.open(folder))["reason"]
    with pytest.raises(ToolpointError, match="needs a coupled tool"):
        Project.open(folder).coupled_tool(0.07, draws=20)
    (folder / "project.yaml").write_text(PROJECT.replace("responses: [gauge.uff], ", ""))
    with pytest.raises(ToolpointError, match="gauge and responses"):
        io.read_project(folder / "project.yaml")
