"""Heads of three freedoms: posed in their own coordinates, with legs and parasitic shift; places that were rounded."""

import json
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io.yaml import machine_file
from toolpoint.machine.pose.tool_pose import pose_for, tool_place
from toolpoint.studies.robots.own_coordinates import leg_pose, own_coordinates
from toolpoint.studies.robots.reach_study import study_reach

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
HEADS = ("three_prs_head", "three_rps_head")
RADIUS = 0.25  # m, of the platform's joints


@pytest.fixture(scope="module", params=HEADS)
def head(request):
    return machine_file.read(MACHINES / f"{request.param}.yaml")


def random_pose(head, rng):
    rest = next(axis.reference_position for axis in head.chain.axes if axis.name == "Z")
    return {"Z": rest + rng.uniform(-0.03, 0.03), "tilt": rng.uniform(0.02, 0.4), "azimuth": rng.uniform(-3, 3)}


@pytest.mark.parametrize("seed", range(3))
def test_the_parasitic_shift_is_the_closed_form_of_three_planes(head, seed):
    """x = -(r/2) (1 - cos tilt) cos 2 azimuth, y = (r/2) (1 - cos tilt) sin 2 azimuth; no torsion (Carretero et al., 2000)."""
    pose = random_pose(head, np.random.default_rng(seed))
    legs = leg_pose(head, pose)
    own = own_coordinates(head, legs)
    size = RADIUS / 2 * (1 - np.cos(pose["tilt"]))
    expected = {"x": -size * np.cos(2 * pose["azimuth"]), "y": size * np.sin(2 * pose["azimuth"]), "torsion": 0.0}
    assert dict(own.shift) == pytest.approx(expected, abs=1e-9) and dict(own.values) == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize("digits", [5, 6, 8])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.default_cases(4)
def test_a_place_and_direction_that_were_rounded_are_reached(head, seed, digits):
    """Five coordinates of three axes never fit exactly; what is left is of the size of the rounding, and is said."""
    pose = random_pose(head, np.random.default_rng(seed))
    (tip,), (direction,) = tool_place(head, pose)
    solution = pose_for(head, np.round(tip, digits), np.round(direction, digits))
    assert solution.is_reached and solution.place_error < 2 * 10.0**-digits


@pytest.mark.slow
def test_what_is_left_of_a_rounded_place_is_said(head):
    pose = random_pose(head, np.random.default_rng(0))
    (tip,), (direction,) = tool_place(head, pose)
    study = study_reach(head, np.round(tip, 5), np.round(direction, 5))
    assert len(study.poses) >= 1 and "µm from the place" in study.table() and study.poses[0].miss < 1e-5


def test_a_place_that_cannot_be_is_still_refused_with_the_way_out(head):
    (tip,), (direction,) = tool_place(head, {"Z": next(a.reference_position for a in head.chain.axes if a.name == "Z"),
                                             "tilt": 0.2})
    solution = pose_for(head, tip + np.array([1e-4, 0, 0]), direction)
    assert not solution.is_reached and "5 coordinates are asked of 3 axes" in solution.status
    assert "own coordinates" in solution.status


def test_a_fully_determined_place_is_met_as_closely_as_before():
    hexapod = machine_file.read(MACHINES / "hexapod_6_ups.yaml")
    solution = pose_for(hexapod, [0.01, -0.02, 0.015], [0.05, 0.1, 1.0], turn=0.1)
    assert solution.is_reached and solution.place_error < 1e-9


@pytest.mark.slow
def test_reach_takes_a_pose_by_coordinates_or_by_legs(head, tmp_path, capsys):
    file = tmp_path / "head.yaml"
    machine_file.write(head.description, file)
    pose = random_pose(head, np.random.default_rng(1))
    main(["reach", str(file), "--json", "--pose", ",".join(f"{name}={value!r}" for name, value in pose.items())])
    first = json.loads(capsys.readouterr().out)["poses"][0]
    main(["reach", str(file), "--json", "--pose", ",".join(f"{name}={value!r}" for name, value in first["pose"].items())])
    second = json.loads(capsys.readouterr().out)["poses"][0]
    assert second["coordinates"] == pytest.approx(pose, abs=1e-8)
    assert set(first["pose"]) == {axis.name for axis in head.chain.driven_axes}
    assert second["parasitic_shift"] == pytest.approx(first["parasitic_shift"], abs=1e-8)
    main(["reach", str(file), "--pose", "tilt=10deg"])
    text = capsys.readouterr().out
    assert "tilt 10°" in text and "parasitic shift of platform" in text and "mm" in text


@pytest.mark.parametrize(("options", "words"), [
    ([], "neither --tip nor --pose"), (["--tip", "0,0,0", "--pose", "tilt=1deg"], "--tip"),
    (["--pose", "tilt=10mm"], "a length"), (["--pose", "tilt=80deg"], "tilt")])
def test_wrong_poses_of_reach(options, words, capsys):
    with pytest.raises(SystemExit) as end:
        main(["reach", str(MACHINES / "three_prs_head.yaml"), *options])
    assert end.value.code == 2 and words in capsys.readouterr().err
