"""The chip along a path: constant or by the feed, a doubt where they contradict, and the error that a run states."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting.build import engagement_of, tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.yaml import machine_file
from toolpoint.machine import build
from toolpoint.machine import description as d
from toolpoint.pages.robots.accuracy import accuracy_page
from toolpoint.studies.accuracy.accuracy_metric import AccuracyMetric
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_path, mill_side
from toolpoint.studies.accuracy.side_run import _keep_interval, time_shares
from toolpoint.studies.accuracy.tool_paths import line

CUT = CuttingDescription.of(diameter=0.006, teeth=2, helix=np.radians(42), tangential=1780e6, normal=593e6, edge_tangential=9e3,
                            edge_normal=7e3, direction="slot", feed_per_tooth=1e-5)
SETUP = MillingSetup(15000, 0.5e-3, halved=False)
FITTING = 1e-5 * 2 * 250  # m/s


def slide(cut=CUT):
    body = d.BodyDescription(mass=8.0, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"y": 4e5}, damping={"y": 60.0})
    return build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", "x")},
                                      {"tip": d.PointDescription("slide")}, tool="tip", cutting=cut))


def side(feed):
    return line([0, 0, 0], [0.02, 0, 0], law="jerk-limited", feed=feed)


@pytest.mark.slow
def test_the_path_that_fits_the_described_chip_gives_the_same_with_both():
    constant, fed = (mill_path(slide(), side(FITTING), replace(SETUP, chip=chip, window=0.1), judged=False)
                     for chip in ("constant", "path"))
    expected = fed.sides[0].relative
    np.testing.assert_allclose(constant.sides[0].relative, expected, atol=1e-9 * np.abs(expected).max())
    assert constant.doubts == fed.doubts == ()
    assert "the chip constant" in constant.loads and "as the path gives it" in fed.loads


def test_a_constant_chip_does_not_ask_the_path():
    """The mean deflection along one spring is the mean force of the described chip over it, whatever the feed."""
    slow, fast = (mill_side(slide(), side(share * FITTING)[0], replace(SETUP, chip="constant", window=0.1), judged=False)
                  for share in (0.5, 30.0))
    fed = mill_side(slide(), side(30 * FITTING)[0], replace(SETUP, chip="path", window=0.1), judged=False)
    assert fast.relative[:, 1].mean() == pytest.approx(slow.relative[:, 1].mean(), rel=1e-6)
    assert abs(fed.relative[:, 1].mean()) > 5 * abs(fast.relative[:, 1].mean())


@pytest.mark.parametrize("chip", ["", "path", "constant"])
@pytest.mark.default_cases(1)
def test_a_feed_that_contradicts_the_described_chip_is_doubted_first(chip):
    result = mill_path(slide(), side(37.5 * FITTING), replace(SETUP, chip=chip, window=0.05), judged=False)
    (doubt,) = result.doubts
    assert doubt.what == "chip" and "0.375 mm a tooth" in doubt and "0.01 mm" in doubt and "11250 mm/min" in doubt
    assert ("the described one is used" in doubt) == (chip == "constant")
    assert result.table().splitlines()[0] == f"doubt: {doubt}"
    assert next(iter(result.to_dict())) == "doubts" and result.to_dict()["chip"] == (chip or "path")
    assert result.status.startswith("doubtful") and "Doubtful (chip" in accuracy_page(result, 2).html()
    assert any("the chip " in note and not isinstance(note, Doubt) for note in result.notes)
    assert mill_path(slide(), side(1.02 * FITTING), replace(SETUP, chip=chip, window=0.05), judged=False).doubts == ()
    metric = AccuracyMetric(side(37.5 * FITTING), replace(SETUP, chip=chip, depth=1e-5))
    assert [line for line in metric.judge(slide()) if line.startswith("chip: ")] == [doubt]


def test_the_chip_of_a_file_and_what_it_needs(tmp_path):
    stated = slide(CUT.replaced(chip="constant"))
    machine_file.write(stated.description, tmp_path / "m.yaml")
    assert machine_file.read(tmp_path / "m.yaml").description.cutting.chip == "constant"
    assert mill_path(stated, side(FITTING), replace(SETUP, window=0.05)).setup.chip == "constant"
    assert mill_path(stated, side(FITTING), replace(SETUP, window=0.05, chip="path")).setup.chip == "path"
    with pytest.raises(ToolpointError, match="feed_per_tooth"):
        mill_path(slide(CUT.replaced(feed_per_tooth=0.0)), side(FITTING), replace(SETUP, chip="constant"))
    with pytest.raises(ToolpointError, match="must be one of path, constant"):
        mill_path(slide(), side(FITTING), replace(SETUP, chip="variable"))


@pytest.mark.parametrize("per_turn", [32, 100, 150, 200, 210, 720])
@pytest.mark.parametrize("steps", [1000, 1_000_001, 2_500_000, 3_750_000, 8_400_001])
def test_samples_that_are_kept_take_all_phases_of_a_revolution_alike(steps, per_turn):
    keep = _keep_interval(steps, per_turn)
    assert math.gcd(keep, per_turn) == 1 and steps / keep <= 1_000_000
    assert len(set(keep * np.arange(per_turn) % per_turn)) == per_turn


@pytest.mark.parametrize("end", [0.98, 1.0, 1.013])
def test_means_are_those_of_a_line_to_the_very_ends(end):
    time = np.arange(1, 50) * 0.0207
    time = time[time < end + 0.0207]
    shares = time_shares(time, 0.0, end)
    assert shares.sum() == pytest.approx(1.0, rel=1e-12) and (shares >= 0).all()
    # A line through the samples; before the first one its value is held.
    line_mean = end / 2 + 0.0207**2 / (2 * end)
    assert shares @ time == pytest.approx(line_mean, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("feed", "chip"), [(0.02, "path"), (0.02, "constant"), (0.15, "path")])
def test_an_independent_integrator_agrees_within_the_stated_error(feed, chip):
    """Average acceleration of one mode with the force at the instant, from 1000 strips, begun with the harmonics' state."""
    lead, depth, teeth, steps = np.tan(CUT.tool.helix) / 0.003, 0.5e-3, 2, 400
    turn = 60 / SETUP.speed
    h, mass, damping, stiffness = turn / (teeth * steps), 8.0, 60.0, 4e5
    course = side(feed)[0]
    result = mill_side(slide(), course, replace(SETUP, chip=chip, halved=True), judged=False)
    k, angle = CUT.coefficients, np.arange(teeth * steps) * 2 * np.pi / (teeth * steps)
    height = (np.arange(1000) + 0.5) * depth / 1000
    phi = (angle[:, None, None] - np.pi * np.arange(2)[:, None] - lead * height) % (2 * np.pi)
    inside = phi < np.pi
    per_chip, edge = ((inside * part).sum(axis=(1, 2)) * depth / 1000 for part in (
        k.tangential * np.sin(phi) ** 2 - k.normal * np.sin(phi) * np.cos(phi),
        k.edge_tangential * np.sin(phi) - k.edge_normal * np.cos(phi)))
    time = np.arange(int(course.law.duration / h) + 1) * h
    fed = np.full(time.size, 1e-5) if chip == "constant" else course.law.sample(time)[:, 1] * turn / teeth
    force = fed * per_chip[np.arange(time.size) % angle.size] + edge[np.arange(time.size) % angle.size]
    lines = np.fft.rfft(fed[0] * per_chip + edge) / angle.size
    omega = 2 * np.pi / turn * np.arange(lines.size)
    first = lines / (stiffness - omega**2 * mass + 1j * omega * damping) * np.where(omega > 0, 2, 1)
    u, v, path = float(first.real.sum()), float((1j * omega * first).real.sum()), np.empty(time.size)
    a = (force[0] - damping * v - stiffness * u) / mass
    path[0] = u
    for i in range(1, time.size):
        speed, place = v + h / 2 * a, u + h * v + h * h / 4 * a
        a = (force[i] - damping * speed - stiffness * place) / (mass + h / 2 * damping + h * h / 4 * stiffness)
        v, u = speed + h / 2 * a, place + h * h / 4 * a
        path[i] = u
    error = np.abs(path - path.mean()).mean()
    assert abs(result.position_error / error - 1) < max(result.halving, 2e-5)


def test_the_arc_and_tool_of_the_integrator_are_those_of_the_cut():
    arc = engagement_of(CUT)
    assert (arc.entry, arc.exit) == (0.0, pytest.approx(np.pi)) and tool_of(CUT).radius == pytest.approx(0.003)


def test_the_option_reaches_the_run(capsys):
    from toolpoint.app.main import main

    machine = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot.yaml"
    with pytest.raises(SystemExit) as end:
        main(["accuracy", str(machine), "--line", "650mm,-5mm,100mm", "--line", "650mm,5mm,100mm", "--speed", "15000",
              "--depth", "0.5", "--feed", "300", "--window", "0.02", "--chip", "variable"])
    assert end.value.code == 2 and "constant" in capsys.readouterr().err
