"""A trunnion in tilted planes: poses by its own chain, the plane's x where the tool sees it, limits of the turned machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError, io, studies
from toolpoint.cutting import Engagement, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.tilted_poses import find_tilted_poses, plane_angle
from toolpoint.studies.machining.tilted_stages import StagedStudy

TEXT = "S9000\nG68.2 X0 Y0 Z0 {turns}\nG53.1\nG0 X-7 Y0 Z9\nZ-2\nG1 X47 F1800\nG0 Z9\nG69\nG0 Z30"


@pytest.fixture(scope="module")
def trunnion(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    path: Path = tmp_path_factory.mktemp("machine") / "trunnion.yaml"
    io.write_template(path, "machine", "trunnion")
    return io.read_machine(path)


def _run(machine: Machine, turns: str) -> StagedStudy:
    cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    setup = studies.describe_machining(studies.stock_of("box", (0, -0.01, -0.02, 0.04, 0.02, 0)), cut, spacing=6e-4)
    return studies.run_stages(parse(TEXT.format(turns=turns), start=(0, 0, 0.05)), setup, machine)


@pytest.mark.slow
def test_the_tool_stands_along_the_plane_and_limits_are_those_of_that_pose(trunnion: Machine) -> None:
    """The cradle turns by the tilt; the limit of the block is that of the exact engine on the machine at its pose."""
    study = _run(trunnion, "J40")
    stage = study.stages[0]
    assert stage.margins is not None and stage.arcs is not None and np.isfinite(stage.margins.limit).any()
    pose, dynamics, angles = find_tilted_poses(trunnion, stage.removed, stage.setup, rotation=study.rotations[0])
    direction = tool_place(trunnion, dict(dynamics[0].pose))[1][0]
    assert np.allclose(direction, study.rotations[0][:, 2], atol=1e-7) and not pose.any()
    m = stage.arcs.place.size // 2
    problem = milling_problem(stage.setup.cut.replaced(immersion=0.5), dynamics[0].response, dynamics[0].x, y=dynamics[0].y)
    arc = Engagement(float(stage.arcs.entry[m]), float(stage.arcs.exit[m]))
    problem = problem.changed(engagement=arc, feed_angle=angles[0])
    chart = stability.chart(problem, np.array([9000.0]), depth_max=4 * float(stage.arcs.depth[m]))
    assert chart.limit[0] == pytest.approx(stage.margins.limit[m], rel=0.1)


def test_the_angle_of_the_planes_x_follows_the_table(trunnion: Machine) -> None:
    """With the table turned by C the plane's x, fixed in the work, is seen turned by the other sign (C turns the work)."""
    assert plane_angle(trunnion, {"A": 0.0, "C": 0.0}, np.eye(3)) == pytest.approx(0.0, abs=1e-12)
    assert abs(plane_angle(trunnion, {"A": 0.0, "C": 0.3}, np.eye(3))) == pytest.approx(0.3, abs=1e-12)
    half = plane_angle(trunnion, {"A": np.radians(-40), "C": np.pi}, np.array(
        [[1, 0, 0], [0, np.cos(0.698), -np.sin(0.698)], [0, np.sin(0.698), np.cos(0.698)]]))
    assert abs(half) == pytest.approx(np.pi, abs=1e-3)


def test_a_plane_beyond_the_travel_is_refused_with_its_direction(trunnion: Machine) -> None:
    with pytest.raises(ToolpointError, match="the tool does not come to"):
        _run(trunnion, "J150")
