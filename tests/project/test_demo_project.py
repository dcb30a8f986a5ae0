"""The demo of a project: raw records with slips to answers that hold the truth; the wrong channel is named."""

import numpy as np
import pytest

from toolpoint.cutting import stability
from toolpoint.project import Project, write_demo
from toolpoint.project.demo import TURNED_RECORD, demo_machine
from toolpoint.project.limits.drawn_limits import FIRST_LOSS
from toolpoint.project.limits.systems import problem_of
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_demo_names_the_wrong_channel_and_its_intervals_hold_the_true_limits(tmp_path):
    write_demo(tmp_path / "mill")
    project = Project.open(tmp_path / "mill")
    results = project.run()
    assert any(f"[{TURNED_RECORD + 1}]" in doubt for doubt in results.doubts)
    hits = [hit for hit in _hits(tmp_path) if not hit["accepted"]]
    assert hits and all(f"P{6}" in hit["name"] or f"P{12}" in hit["name"] for hit in hits)
    for name, goal in results.data["goals"].items():
        problem = problem_of(machine_dynamics(demo_machine(), goal["pose"]), project.description.cuts["face"].cut)
        truth = float(stability.chart(problem, np.array([goal["speed_rpm"]]), FIRST_LOSS, depth_max=0.1).limit[0])
        assert goal["interval_m"][0] < truth < goal["interval_m"][1], name
        assert goal["limit_m"] == pytest.approx(truth, rel=0.03)


def _hits(folder):
    from toolpoint.project.steps.plain_files import read_json

    return read_json(folder / "mill/results/responses/structure/hits.json")["hits"]
