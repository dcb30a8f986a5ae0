"""Five axes: tilted planes and three axes beside them, a trunnion's own angles, dialects, poses, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError, io, studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.studies.machining.five_axes.tool_directions import RotaryAxes
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

CUT = {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8, "flute_length": 0.03}
ANGLES = "S9000\n{on}\nG0 X-8 Y0 Z-3 A{first} C{turn}\nG1 X48 A{last} C{turn} F1800\n{off}\nG0 Z90"


@pytest.fixture(scope="module")
def trunnion(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    path: Path = tmp_path_factory.mktemp("machine") / "trunnion.yaml"
    io.write_template(path, "machine", "trunnion")
    return io.read_machine(path)


def _run(text: str, dynamics: object = None, *, spacing: float = 5e-4, **tool: float) -> MachiningStudy:
    return studies.run_five_axes(parse(text, start=(0, 0, 0.05)), _setup(spacing, **tool), dynamics)


def _setup(spacing: float = 5e-4, **tool: float) -> studies.MachiningSetup:
    return studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)),
                                      CuttingDescription.of(**CUT, **tool), spacing=spacing)


def _tip() -> object:
    return studies.modal_dynamics(Modes([900.0, 1080.0], [0.02, 0.02], [[1.6, 0], [0, 1.5]], ("tool:+x", "tool:+y")))


@pytest.mark.slow
def test_a_constant_direction_is_a_tilted_plane() -> None:
    """The chamfer of the tests of tilted planes: volume, largest arc, loads and the limit of the block, by both engines."""
    leg = 3.0
    tilted = ("S9000\nG68.2 J45\nG53.1\nG0 X-7 Y0 Z9\n"
              f"Z-{leg / np.sqrt(2):.6f}\nG1 X47 F1800\nG0 Z9\nG69")
    depth = leg / np.sqrt(2) * np.array([0, -np.sin(np.pi / 4), np.cos(np.pi / 4)])
    place = f"Y{-depth[1]:.6f} Z{-depth[2]:.6f}"
    text = f"S9000\nG43.5\nG0 X-7 {place} J-1 K1\nG1 X47 {place} J-1 K1 F1800\nG49\nG0 Z90"
    plane = studies.run_stages(parse(tilted, start=(0, 0, 0.05)), _setup(), _tip()).stages[0]
    study = _run(text, _tip())
    assert 1e9 * study.removed.total_volume == pytest.approx(leg**2 / 2 * 40, rel=2e-3)
    k, m = int(np.argmax(study.blocks.depth)), int(np.argmax(plane.blocks.depth))
    assert np.degrees(study.blocks.arc[k]) == pytest.approx(np.degrees(plane.blocks.arc[m]), abs=0.5)
    assert 1e3 * study.blocks.depth[k] == pytest.approx(leg / np.sqrt(2), rel=2e-3)
    assert study.blocks.depth[k] == pytest.approx(plane.blocks.depth[m], rel=3e-3)
    inner = (study.loads.power > 0) & (np.abs(study.removed.tip[:, 0] - 0.02) < 0.01)
    assert study.loads.power[inner] == pytest.approx(8e8 * leg**2 / 2 * 1e-6 * 0.03, rel=0.01)  # K_t times what is cut a second
    for name in ("lateral", "torque", "power"):
        assert study.blocks.loads[name][k] == pytest.approx(plane.blocks.loads[name][m], rel=0.02)
    assert study.blocks.limit[k] == pytest.approx(plane.blocks.limit[m], rel=0.03)
    assert study.blocks.verdict[k] == plane.blocks.verdict[m]


def test_angles_of_the_machine_are_its_own_and_vectors_come_back_to_them(trunnion: Machine) -> None:
    """The axis along the path is that of the chain at interpolated angles; vectors lead to near angles within the travels."""
    rotary = RotaryAxes(trunnion, _setup())
    angles = np.array([[-0.6, 0, 0.4], [-0.2, 0, -1.0], [0.3, 0, 2.0]])
    direct = np.array([tool_place(trunnion, {"A": a, "C": c})[1][0] for a, _, c in angles])
    assert np.allclose(rotary.frames(angles)[:, :, 2], direct, atol=1e-12)
    for k in range(3):
        solution = rotary.angles_for(direct[k], angles[k] + [0.05, 0, -0.05])
        assert solution == pytest.approx(angles[k], abs=1e-7)
    with pytest.raises(ToolpointError, match="no position of A, C"):
        rotary.angles_for(np.array([0.0, 0.1, -0.995]) / np.linalg.norm([0.1, 0.995]), angles[0])


@pytest.mark.slow
def test_a_turn_of_the_table_alone_leaves_the_cut_as_it_is(trunnion: Machine) -> None:
    """C turned all along, at A = 0: the work turns under an upright tool, and the program's places turn with it."""
    still, turned = (_run(ANGLES.format(on="G43.4 H1", off="G49", first=0, last=0, turn=c), trunnion, spacing=1e-3)
                     for c in (0, 60))
    assert turned.removed.total_volume == pytest.approx(still.removed.total_volume, rel=1e-6)
    k = int(np.argmax(still.blocks.depth))
    assert turned.blocks.loads["lateral"][k] == pytest.approx(still.blocks.loads["lateral"][k], rel=1e-6)
    turn = float(turned.arcs.angle[0] - still.arcs.angle[0])
    assert abs(turn) == pytest.approx(np.radians(60), abs=1e-9)  # the tool sees its feed turned


@pytest.mark.slow
def test_blocks_are_judged_at_their_own_poses(trunnion: Machine) -> None:
    """A leans from 45 to 25 degrees within a block: several poses, the last of them with the chain's direction at the end."""
    study = _run(ANGLES.format(on="G43.4 H1", off="G49", first=-45, last=-25, turn=0), trunnion, spacing=8e-4)
    assert study.margins is not None and study.judged is not None
    poses = study.judged.solver.dynamics
    leans = sorted(np.degrees(each.pose["A"]) for each in poses)
    assert len(poses) >= 2 and -46 < leans[0] < -35 and -35 < leans[-1] < -24
    assert np.isfinite(study.margins.limit).any() and (study.blocks.verdict[1] > 0)
    assert study.errors is not None and study.errors.floors is not None and np.isfinite(study.errors.columns["marks"]).any()


@pytest.mark.slow
def test_the_feed_of_a_swing_is_that_of_the_edge() -> None:
    """A turn about the tip at 600 degrees a minute: the chip is thin at the tip and thick above it, and is doubted."""
    text = "S9000\nG43.5\nG0 X-2 Y10 Z-15 I-0.3 K1\nG1 I0.3 K1 F600\nG49\nG0 Z90"
    study = _run(text, spacing=1e-3)
    k = int(np.argmax(study.loads.lateral))
    expected = 0.5 * study.removed.reach[k] * np.radians(600) / 60
    assert study.laid.place_feed[k] == pytest.approx(expected, rel=0.02)
    assert any(doubt.what == "feed along the edge" for doubt in study.doubts)
    assert study.laid.time[~study.laid.path.rapid].sum() == pytest.approx(2 * np.degrees(np.arctan(0.3)) / 10, rel=0.02)


@pytest.mark.parametrize(("text", "words"), [
    (ANGLES.format(on="G43.4", off="G49", first=-10, last=-20, turn=0), "line 3 turns rotary axes"),
    ("S9000\nG0 X0 Y0 Z5\nG0 B30\nG1 X10 F900\nG0 B0\nG43.4\nG1 X5\nG49", "line 4 cut with A, B or C turned")])
def test_what_no_machine_tells_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(ToolpointError, match=words):
        _run(text)


def test_axes_that_the_machine_does_not_have_are_refused(trunnion: Machine) -> None:
    with pytest.raises(ToolpointError, match="line 3 turns B, and the machine turns A, C"):
        _run("S9000\nG43.4\nG1 X5 Y5 Z0 B10 F900\nG49", trunnion)


def test_angles_beyond_the_travel_are_refused(trunnion: Machine) -> None:
    with pytest.raises(ToolpointError, match=r"line 4 turns A to 35°, beyond its travel of -110 \.\. 30°"):
        _run(ANGLES.format(on="G43.4", off="G49", first=25, last=35, turn=0), trunnion)
