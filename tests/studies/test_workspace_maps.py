"""Maps over any workspace: stiffness in principal directions, symmetry, poses that cannot be, extremes in words."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import parallel_machines
from toolpoint.app.main import cli
from toolpoint.machine import assemble, build
from toolpoint.pages.machines.frequency_map import map_page
from toolpoint.studies.machines.pose_map import pose_map
from toolpoint.studies.machines.response_map import response_map
from toolpoint.studies.machines.stiffness_map import stiffness_map
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.vibration import frequency_response


@pytest.fixture(scope="module")
def head():
    return parallel_machines.three_rps()


def test_largest_compliance_grows_with_tilt_as_the_reference_says(head):
    """22.2 nm/N at home, 25.5 at 30 degrees (reference case of the 3-RPS): rigid limbs, springs that lean with the tilt."""
    machine = build(replace(head.description, tool="centre"))
    result = stiffness_map(machine, {"tilt": np.radians([0, 30]), "azimuth": [0.0]})
    np.testing.assert_allclose(1e9 / result.stiffness[:, 0, 3], [22.2, 25.5], atol=0.05)


def test_static_stiffness_is_that_of_the_equations(head):
    pose = {"Z": 0.95, "tilt": 0.2, "azimuth": 1.1}
    result = stiffness_map(head, {name: [value] for name, value in pose.items()})
    labels = [f"tool:+{way}" for way in "xyz"]
    flexibility = frequency_response.direct(assemble(head, pose, labels), np.array([0.0])).values[0].real
    # Principal values are those of any axes; along the tool's axis it is the flexibility in its direction.
    np.testing.assert_allclose(1 / result.stiffness[0, 0, 0, 3:], np.linalg.svd(flexibility)[1], rtol=1e-9)
    tool = np.array([np.sin(0.2) * np.cos(1.1), np.sin(0.2) * np.sin(1.1), np.cos(0.2)])
    assert 1 / result.stiffness[0, 0, 0, 2] == pytest.approx(tool @ flexibility @ tool, rel=1e-9)


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_principal_stiffness_has_the_threefold_symmetry(head, kind):
    axes = {"tilt": np.radians([10, 25]), "azimuth": np.radians([20, 140, 260])}
    stiffness = stiffness_map(head, axes, kind).stiffness[..., 3:]
    np.testing.assert_allclose(stiffness, stiffness[:, :1].repeat(3, axis=1), rtol=1e-6 if kind == "dynamic" else 1e-9)
    frequency = pose_map(head, axes).frequency
    np.testing.assert_allclose(frequency, frequency[:, :1].repeat(3, axis=1), rtol=1e-9)


def test_dynamic_stiffness_is_least_at_a_resonance(head):
    result = stiffness_map(head, {"tilt": [0.1]}, "dynamic")
    static = stiffness_map(head, {"tilt": [0.1]})
    # Damping of 2 %: the dynamic stiffness of one mode is 2 zeta = 4 % of its static one.
    assert 0.03 < result.stiffness[0, 3] / static.stiffness[0, 3] < 0.08
    modes = pose_map(head, {"tilt": [0.1]}).frequency[0]
    assert np.abs(modes / result.frequency[0] - 1).min() < 0.01


def test_poses_that_cannot_be_are_kept_with_their_reason_and_drawn(head, tmp_path):
    result = pose_map(head, {"Z": np.array([0.9, 1.39]), "tilt": np.radians([0, 50]), "azimuth": [np.pi]})
    assert list(result.failures) == [(1, 1, 0)]
    assert "beyond 0.3 m .. 1.5 m" in result.failed()[0]
    assert "tilt 50°" in result.failed()[0]
    assert np.isnan(result.frequency[1, 1]).all()
    assert result.extremes()[0].startswith("mode 1: lowest")
    two = pose_map(head, {"Z": np.array([0.9, 1.0, 1.39]), "tilt": np.radians([0, 30, 60])})
    page = map_page(two, "head").html()
    assert "Where it is lowest and highest" in page
    if two.failures:
        assert "pose failed" in page


@pytest.mark.parametrize("axes", [{"tilt": [0.0, 0.1], "azimuth": [0.3]},
                                  pytest.param({"azimuth": [0.3], "tilt": [0.0, 0.1, 0.2]}, marks=pytest.mark.slow),
                                  pytest.param({"tilt": [0.1]}, marks=pytest.mark.slow),
                                  {"azimuth": [0.3], "tilt": [0.1, 0.2], "Z": [0.9, 1.0]}])
def test_axes_of_one_position_are_no_axes_of_the_picture(head, axes):
    for result in (pose_map(head, axes), stiffness_map(head, axes), response_map(head, axes, [10.0, 20.0, 30.0])):
        page = map_page(result, "head").html()
        assert "Where it is lowest and highest" in page


def test_map_command_speaks_degrees(tmp_path):
    machine = "src/toolpoint/app/machines/three_rps_head.yaml"
    axes = ["--axis", "tilt=0:20deg:2", "--axis", "azimuth=0:240deg:3"]
    done = CliRunner().invoke(cli, ["map", machine, *axes, "--quantity", "static", "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "at tilt 20°, azimuth" in done.output
    page = (tmp_path / "index.html").read_text()
    assert "tilt, °" in page and "azimuth, °" in page
    shown = CliRunner().invoke(cli, ["map", machine, "--axis", "tilt=0:20deg:2", "--json"]).output
    assert len(json.loads(shown)["frequency_hz"]) == 2


@pytest.mark.parametrize("name", ["three-rps-head", "gantry"])
@pytest.mark.slow
def test_demos_of_moving_machines(tmp_path, name):
    done = CliRunner().invoke(cli, ["demo", name, "-o", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "softest direction: lowest" in done.output
    assert name in CliRunner().invoke(cli, ["demo", "--list"]).output


def test_responses_over_the_workspace_are_those_of_every_pose(head):
    axes = {"tilt": np.radians([10, 25]), "azimuth": np.radians([20, 140, 260])}
    lines = np.linspace(5, 300, 40)
    result = response_map(head, axes, lines)
    pose = {"tilt": axes["tilt"][1], "azimuth": axes["azimuth"][2]}
    expected = tool_point(head, [pose], lines).frf.values[0]
    for k in range(3):
        np.testing.assert_allclose(result.values[1, 2, :, k], expected[:, k, k], rtol=1e-12)
    # The sum over x and y does not turn with the azimuth of a head of three equal limbs: neither does the response along z.
    np.testing.assert_allclose(result.values[:, 0, :, 2], result.values[:, 1, :, 2], rtol=1e-6)
    assert "azimuth" in result.table() and len(result.to_dict()["real_m_per_n"]) == 2


def test_a_peak_between_the_lines_is_said_and_one_that_they_carry_is_not(head):
    axes = {"tilt": [0.0, 0.2]}
    fine, coarse = response_map(head, axes, np.linspace(1, 500, 4000)), response_map(head, axes, np.linspace(1, 500, 30))
    assert not fine.notes and "single line" in coarse.notes[0]
    default = response_map(head, axes)
    modes = pose_map(head, axes, 12).frequency
    assert default.frequency[0] < modes.min() and default.frequency[-1] > modes.max()


def test_responses_of_poses_that_cannot_be_are_left_out_with_their_reason(head, tmp_path):
    result = response_map(head, {"Z": [0.9, 1.39], "tilt": np.radians([50]), "azimuth": [np.pi]}, [10.0, 20.0])
    assert np.isnan(result.values[1]).all() and np.isfinite(result.values[0]).all()
    assert len(result.failed()) == 1 and result.to_dict()["real_m_per_n"][1][0][0][0][0] is None
    assert "Failed poses" in map_page(result, "head").save(tmp_path / "m.html").read_text(encoding="utf-8")


def test_the_command_maps_responses(tmp_path):
    name = "src/toolpoint/app/machines/three_axis_vertical.yaml"
    args = ["map", name, "--axis", "X=-0.1:0.1:3", "-o", str(tmp_path / "m")]
    done = CliRunner().invoke(cli, [*args, "--quantity", "response", "--lines", "10:200:50"])
    assert done.exit_code == 0, done.output
    assert "greatest µm/N" in done.output
    wrong = CliRunner().invoke(cli, [*args, "--lines", "10:200:50"])
    assert wrong.exit_code == 2 and "--quantity response" in wrong.output
