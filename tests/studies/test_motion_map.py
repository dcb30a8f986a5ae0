"""Motion over a grid: parasitic shift of a 3-RPS head in closed form, symmetry, determinant; paths of the greatest response."""

import json
from pathlib import Path

import numpy as np
import pytest

from toolpoint import io
from toolpoint.app.main import main
from toolpoint.kinematics.three_rps import ThreeRps
from toolpoint.studies import map_motion, map_responses
from toolpoint.studies.machines.pose_grid import Grid

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"


@pytest.fixture(scope="module")
def head():
    return io.read_machine(MACHINES / "three_rps_head.yaml")


@pytest.fixture(scope="module")
def motion(head):
    return map_motion(head, {"tilt": np.radians([0.0, 10.0, 20.0]), "azimuth": np.radians([0.0, 45.0, 120.0])})


def test_parasitic_shift_is_that_of_the_closed_form(motion):
    """x = -r/2 cos(2 azimuth)(1 - cos tilt), y = r/2 sin(2 azimuth)(1 - cos tilt): the file's balls lie at r = 250 mm."""
    shift = np.stack([motion.of("parasitic x"), motion.of("parasitic y")], axis=-1)
    tilt, azimuth = np.meshgrid(*motion.axes.values(), indexing="ij")
    assert shift == pytest.approx(ThreeRps(0.35, 0.25).parasitic(tilt, azimuth), abs=1e-9)
    assert motion.of("parasitic torsion") == pytest.approx(0, abs=1e-12)


def test_what_is_zero_by_symmetry_is_shown_as_zero(head):
    """Tilted in the plane of a limb the head neither turns nor moves across; rounding stood there as 1.7e-10 degrees."""
    motion = map_motion(head, {"tilt": np.radians([-30.0, -15.0, 0.0, 15.0, 30.0])})
    for name in ("ball1.ry", "ball1.rz", "parasitic y", "parasitic torsion"):
        assert not motion.of(name).any() and not np.signbit(motion.of(name)).any(), name


def test_a_turn_by_a_third_exchanges_the_legs(motion):
    first, third = motion.values[:, 0], motion.values[:, 2]
    legs = [[column.name for column in motion.columns].index(name) for name in ("L1", "L2", "L3")]
    assert np.sort(third[:, legs], axis=1) == pytest.approx(np.sort(first[:, legs], axis=1), abs=1e-9)
    for name in ("determinant", "condition of the tool"):
        assert motion.of(name)[:, 2] == pytest.approx(motion.of(name)[:, 0], rel=1e-6)


def test_the_determinant_is_that_of_finite_differences(head, motion):
    """Rates of height and of the turning across the tool's axis (tilt', sin(tilt) azimuth') over those of the legs, by central
    differences of the legs over the task's coordinates."""
    pose = {"tilt": 0.2, "azimuth": 0.4, "Z": float(head.chain.coordinates({})["Z"][0])}
    jacobian = []
    for name in head.chain.task.coordinates:
        ends = [head.chain.positions({**{k: np.array([v]) for k, v in pose.items()}, name: np.array([pose[name] + way])})[0]
                for way in (1e-5, -1e-5)]
        jacobian.append((ends[0] - ends[1]) / 2e-5)
    determinant = np.sin(pose["tilt"]) / np.linalg.det(np.array(jacobian).T)
    mapped = map_motion(head, {name: [value] for name, value in pose.items()})
    assert abs(float(mapped.of("determinant").ravel()[0])) == pytest.approx(abs(determinant), rel=1e-5)


def test_poses_beyond_the_travel_cost_no_other(head):
    far = map_motion(head, {"tilt": np.radians([0.0, 85.0]), "azimuth": [0.0]})
    assert np.isfinite(far.values[0]).all() and np.isnan(far.values[1]).all()
    assert len(far.failed()) == 1 and "tilt: 85 deg; must be within" in far.failed()[0]
    assert far.to_dict()["values"][1][0][0] is None


def test_a_serial_machine_has_axes_and_condition_alone():
    machine = io.read_machine(MACHINES / "three_axis_vertical.yaml")
    motion = map_motion(machine, {"X": [-0.1, 0.1]})
    assert [column.name for column in motion.columns] == ["X", "Y", "Z", "condition of the tool"]
    assert motion.of("X").tolist() == [-0.1, 0.1] and motion.of("condition of the tool") == pytest.approx(1.0)


def test_the_path_of_the_greatest_is_told():
    grid = Grid({"A": np.array([0.0, 0.1, 0.2]), "B": np.array([0.0, 0.5])}, ())
    values = np.array([[1.0, 2.0], [1.0, 3.0], [4.0, 1.0]])[..., None]
    assert grid.path_lines(values, ["along x"]) == [
        "along x: over A the greatest runs along B 500 mm at 0 mm to 100 mm, 0 mm at 200 mm"]
    assert Grid({"A": np.array([0.0, 0.1, 0.2])}, ()).path_lines(values[:, 0], ["along x"]) == []


def test_one_frequency_is_the_line_of_the_whole_map(head):
    axes = {"tilt": np.radians([0.0, 20.0]), "azimuth": np.radians([0.0, 60.0])}
    line, lines = map_responses(head, axes, [60.0]), map_responses(head, axes, [50.0, 60.0, 70.0])
    assert line.values[..., 0, :] == pytest.approx(lines.values[..., 1, :], rel=1e-12)
    assert "at 60 Hz" in repr(line) and any("the greatest runs along azimuth" in text for text in line.extremes())


def test_by_command(tmp_path, capsys):
    source = str(MACHINES / "three_rps_head.yaml")
    grid = ["--axis", "tilt=0deg:20deg:2", "--axis", "azimuth=0deg:60deg:2"]
    main(["map", source, *grid, "--quantity", "motion", "--json", "-o", str(tmp_path)])
    assert "parasitic x" in json.loads(capsys.readouterr().out)["columns"]
    main(["map", source, *grid, "--quantity", "response", "--frequency", "60", "-o", str(tmp_path / "r")])
    assert "at 60 Hz" in capsys.readouterr().out
    assert "at 60 Hz" in (tmp_path / "r/index.html").read_text()
    with pytest.raises(SystemExit):
        main(["map", source, *grid, "--frequency", "60"])
