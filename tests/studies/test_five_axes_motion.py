"""Five axes: the machine's own axes, times within their limits, gouges, servo and walls, by closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError, io, studies
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.drives.description import (
    DriveAxisDescription,
    DriveDescription,
    MechanicsDescription,
    PositionDescription,
    VelocityDescription,
)
from toolpoint.drives.program.jerk_profile import JerkLimits
from toolpoint.drives.program.path import Path as DrivePath
from toolpoint.io.program.gcode import parse
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.studies.machining.five_axes.axis_course import AxisCourse, find_axis_course, question_travels
from toolpoint.studies.machining.five_axes.axis_times import StepTimes, plan_steps, question_feeds
from toolpoint.studies.machining.five_axes.tool_directions import RotaryAxes
from toolpoint.studies.machining.five_axes.turned_path import TurnedPath, find_ends, split_turned
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.vibration import Modes

CUT = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8, flute_length=0.03)
LINE = "S9000\nG43.4 H1\nG0 X-58 Y10 Z-2 A{a} C{c}\nG1 X48 A{a} C{c} F{feed}\nG49\nG0 Z90"
CHAMFER = "S9000\nG43.5\nG0 X-8 Y0 Z-{z} J-1 K1\nG1 X48 J-1 K1 F1800\nG49\nG0 Z90"


@pytest.fixture(scope="module")
def trunnion(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    path: Path = tmp_path_factory.mktemp("machine") / "trunnion.yaml"
    io.write_template(path, "machine", "trunnion")
    return io.read_machine(path)


def _setup(cut: CuttingDescription = CUT, **options: object) -> studies.MachiningSetup:
    values = {"spacing": 2e-3, **options}
    return studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)), cut, **values)


def _run(text: str, dynamics: object = None, **options: object) -> MachiningStudy:
    return studies.run_five_axes(parse(text, start=(0, 0, 0.05)), _setup(**options), dynamics)


def _servo(gains: tuple[float, float, float] = (20.0, 30.0, 20.0)) -> DriveDescription:
    axes = {name: DriveAxisDescription(mechanics=MechanicsDescription("rigid", lead=0.01, inertia=0.005),
                                       position=PositionDescription(gain=gain), velocity=VelocityDescription(gain=1.0))
            for name, gain in zip("XYZ", gains, strict=True)}
    return DriveDescription("trunnion", axes)


def _prism(corners: list[tuple[float, float]]) -> np.ndarray:
    """Triangles of a convex outline in y and z (mm), counter-clockwise, from x = 0 to 40 mm."""
    n, outline = len(corners), np.array(corners)
    low, high = (np.column_stack([np.full(n, x), outline]) for x in (0.0, 40.0))
    sides = [t for k in range(n) for m in [(k + 1) % n] for t in ((low[k], low[m], high[m]), (low[k], high[m], high[k]))]
    caps = [t for k in range(1, n - 1) for t in ((low[0], low[k + 1], low[k]), (high[0], high[k], high[k + 1]))]
    return np.array(sides + caps)


def _course(text: str, machine: Machine, **options: object) -> tuple[RotaryAxes, DrivePath, TurnedPath, AxisCourse]:
    program = parse(text, start=(0, 0, 0.05))
    rotary, path = RotaryAxes(machine, _setup(**options)), program.tip_path()
    turned = split_turned(path, find_ends(program, rotary, path.line), rotary, step=2e-3, lever=0.02,
                          is_seen=~program.unseen, shape=np.zeros(path.count, int))
    course = find_axis_course(rotary, turned)
    assert course is not None
    return rotary, path, turned, course


def test_the_axes_of_the_course_bring_the_tip_to_its_places(trunnion: Machine) -> None:
    _, _, turned, course = _course("S9000\nG43.4\nG0 X-8 Y2 Z-3 A-40 C10\nG1 X48 Y9 A-15 C70 F1800\nG49", trunnion)
    origin = tool_place(trunnion, {})[0][0]
    for k in (0, len(course.linear) // 2, len(course.linear) - 1):
        for end in (0, 1):
            pose = dict(zip("XYZ", course.linear[k, end], strict=True)) | {"A": course.rotary[k, end, 0],
                                                                           "C": course.rotary[k, end, 2]}
            assert tool_place(trunnion, pose)[0][0] - origin == pytest.approx(turned.moves.tips[k, end], abs=1e-12)


def test_a_place_beyond_the_travel_is_doubted_with_its_line(trunnion: Machine) -> None:
    """With the table turned by 90 degrees, X of the work is Y of the machine."""
    axes = {axis.name: axis for axis in trunnion.chain.axes}
    text = LINE.format(a=0, c=90, feed=1800)
    for beyond, count in ((1e3 * axes["Y"].upper + 200, 1), (10.0, 0)):
        rotary, path, turned, course = _course(text.replace("G49", f"G1 X{beyond:.3f}\nX{-beyond:.3f}\nG49"), trunnion)
        block = turned.moves.block
        doubts = question_travels(rotary, course, line=path.line[block], rapid=path.rapid[block])
        assert len(doubts) == count and all(doubt.what == "travel of Y" and doubt.grave for doubt in doubts)


def _times(text: str, machine: Machine, **options: object) -> tuple[StepTimes, np.ndarray, list[Doubt]]:
    """Times of the steps, the program line of each, and the doubts about feeds."""
    _, path, turned, course = _course(text, machine, **options)
    times = plan_steps(path, turned, course, setup=_setup(**options))
    return times, path.line[turned.moves.block], question_feeds(times, turned, path, setup=_setup(**options))


def test_a_swing_takes_the_time_of_its_rotary_axis(trunnion: Machine) -> None:
    """A turns by 20 degrees about the tip: theta/v + v/a, whatever feed is programmed."""
    text = "S9000\nG43.4\nG0 X20 Y10 Z-15 A-40 C0\nG1 A-20 F6000\nG49\nG0 Z90"
    limits = {"rotary_speed": np.radians(30.0), "rotary_acceleration": np.radians(200.0)}
    times, line, doubts = _times(text, trunnion, **limits)
    assert times.times[line == 4].sum() == pytest.approx(20 / 30 + 30 / 200, rel=1e-6)
    assert [doubt.what for doubt in doubts] == ["feed"] and "line 4" in doubts[0]
    free, line, doubts = _times(text, trunnion)
    assert free.times[line == 4].sum() == pytest.approx(20 / 6000 * 60, rel=1e-6)
    assert any("no limit of speed" in doubt for doubt in doubts)


def test_the_linear_axes_rule_where_the_table_is_far_from_the_tip(trunnion: Machine) -> None:
    """C turns about an axis 200 mm beside the tip, which stands in the work: X and Y run round at r w, at most 0.1 m/s."""
    text = "S9000\nG43.4\nG0 X200 Y0 Z50 A0 C0\nG1 C40 F6000\nG49"
    times, line, _ = _times(text, trunnion, planned=JerkLimits(0.1, 1e3, 1e6))
    _, _, _, course = _course(text, trunnion)
    way = np.abs(np.diff(course.linear, axis=1))[:, 0][line == 4]
    assert (way / times.times[line == 4][:, None]).max() == pytest.approx(0.1, rel=1e-3)


@pytest.mark.slow
def test_a_slower_feed_takes_a_thinner_chip(trunnion: Machine) -> None:
    """C turns by 90 degrees along the line: at 10 degrees a second it takes nine seconds and the feed is 106/9 mm/s."""
    text = LINE.format(a=0, c=0, feed=1800).replace("X48 A0 C0", "X48 A0 C90")
    fast, slow = (_run(text, trunnion, **each) for each in ({}, {"rotary_speed": np.radians(10.0),
                                                               "rotary_acceleration": np.radians(1e4)}))
    k = int(np.flatnonzero(fast.laid.path.line == 4)[0])
    assert slow.laid.time[k] == pytest.approx(9, rel=0.01) and slow.laid.feed[k] == pytest.approx(0.106 / 9, rel=0.01)
    assert slow.blocks.loads["chip"][k] / fast.blocks.loads["chip"][k] == pytest.approx(0.106 / 9 / 0.03, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("deeper", [0.0, 0.3])
def test_a_chamfer_below_the_part_is_a_gouge_of_its_depth(deeper: float) -> None:
    """A chamfer of 3 mm by the end of a leaning tool; the part's own is set out by 0.3 mm along its normal, or is the same."""
    leg = 3 - deeper * np.sqrt(2)
    part = _prism([(leg, 0.0), (0.0, -leg), (0.0, -20.0), (20.0, -20.0), (20.0, 0.0)])
    study = _run(CHAMFER.format(z=3), spacing=1e-3, part=part)
    gouges = [doubt for doubt in study.doubts if doubt.what == "gouge"]
    if not deeper:
        assert not gouges
        return
    assert len(gouges) == 1 and gouges[0].grave and "line 4" in gouges[0]
    assert float(gouges[0].why.split("cuts ")[1].split(" mm")[0]) == pytest.approx(deeper, rel=0.01)


@pytest.mark.slow
def test_a_part_that_is_gone_altogether_is_a_gouge() -> None:
    part = _prism([(0.2, -0.4), (0.2, -0.8), (0.6, -0.8), (0.6, -0.4)])
    gouges = [doubt for doubt in _run(CHAMFER.format(z=3), spacing=5e-4, part=part).doubts if doubt.what == "gouge"]
    assert len(gouges) == 1 and float(gouges[0].why.split()[0]) == pytest.approx(0.16 * 40, rel=0.3)


@pytest.mark.slow
def test_the_body_below_the_stock_is_named() -> None:
    """The end's rim of a tool that leans reaches deeper than its tip: 5 mm sin 45."""
    study = _run(CHAMFER.format(z=17))
    below = [doubt for doubt in study.doubts if doubt.what == "cut below the stock"]
    assert len(below) == 1 and float(below[0].why.split("goes to ")[1].split(" mm")[0]) == pytest.approx(
        -17 - 5 * np.sin(np.pi / 4), abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [45])
def test_unlike_gains_leave_the_contour_error_of_the_machines_own_axes(trunnion: Machine, turn: int) -> None:
    """Along X of the work on a table turned by C: v sin C cos C (1/K_X - 1/K_Y)."""
    soft = CuttingDescription.of(diameter=0.01, teeth=4, tangential=2e6, normal=1e6, flute_length=0.03)
    study = _run(LINE.format(a=0, c=turn, feed=3000), trunnion, drives=_servo(), cut=soft)
    k = int(np.flatnonzero(study.laid.path.line == 4)[0])
    angle = np.radians(turn)
    expected = abs(0.05 * np.sin(angle) * np.cos(angle) * (1 / 20 - 1 / 30))
    assert study.errors is not None
    assert study.errors.columns["contour"][k] == pytest.approx(expected, rel=0.02, abs=2e-5)
    loaded = _run(LINE.format(a=0, c=turn, feed=3000), trunnion, drives=_servo())
    assert loaded.errors is not None and loaded.errors.columns["push"][k] > 100 * study.errors.columns["push"][k] > 0
    assert any("rotary axes are not in the drive file" in doubt for doubt in study.doubts)


def test_the_tip_follows_a_turn_of_the_table_by_its_arm(trunnion: Machine) -> None:
    """C alone moves the work under the tip by its distance from the axis, square to it; linear axes move it one to one."""
    _, _, _, course = _course("S9000\nG43.4\nG0 X30 Y40 Z5 A0 C0\nG1 X31 C20 F1800\nG49", trunnion)
    turn = course.slopes[1, 0, :, 5]
    assert np.linalg.norm(turn) == pytest.approx(0.05, rel=1e-6)
    assert abs(turn @ [0.03, 0.04, 0.0]) < 1e-9 and abs(turn[2]) < 1e-9
    assert np.linalg.norm(course.slopes[:, :, :, :3], axis=2) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.slow
def test_a_late_rotary_axis_leaves_its_own_error(trunnion: Machine) -> None:
    """The tip goes outwards from the table's axis, which turns: r w (1/K_C - 1/K_X) across its way, at the largest r."""
    servo = _servo((20.0, 20.0, 20.0))
    table = MechanicsDescription("reducer", inertia=0.005, gear_ratio=100.0, load_inertia=1.0, torsion=1e7,
                                 torsion_damping=500.0)
    axes = {**servo.axes, "C": DriveAxisDescription(mechanics=table, position=PositionDescription(gain=10.0),
                                                    velocity=VelocityDescription(gain=1.0))}
    soft = CuttingDescription.of(diameter=0.01, teeth=4, tangential=2e6, normal=1e6, flute_length=0.03)
    text = "S9000\nG43.4 H1\nG0 X-8 Y0 Z-2 A0 C0\nG1 X38 Y0 A0 C40 F1200\nG49\nG0 Z90"
    errors = {}
    for name, drives in (("late", DriveDescription("trunnion", axes)), ("not driven", servo)):
        study = _run(text, trunnion, drives=drives, cut=soft)
        k = int(np.flatnonzero(study.laid.path.line == 4)[0])
        assert study.errors is not None
        errors[name] = float(study.errors.columns["contour"][k])
        said = any("rotary axes are not in the drive file" in doubt for doubt in study.doubts)
        assert said == (name == "not driven")
    rate = np.radians(40) / (0.046 / 0.02)
    assert errors["late"] == pytest.approx(0.038 * rate * (1 / 10 - 1 / 20), rel=0.05)
    # A table that is taken in step has no error of its own; the start from rest, where X and Y fall behind first, is left.
    assert errors["not driven"] < 0.3 * errors["late"]


def test_drives_of_foreign_axes_are_refused_by_name(trunnion: Machine) -> None:
    servo = _servo()
    rigid = next(iter(servo.axes.values()))
    for name, words in (("U", "axis U"), ("C", "must be reducer")):
        with pytest.raises(ToolpointError, match=words):
            _run(LINE.format(a=0, c=0, feed=1800), trunnion, drives=DriveDescription("trunnion", {**servo.axes, name: rigid}))


@pytest.mark.slow
def test_walls_of_a_constant_direction_are_those_of_three_axes() -> None:
    """Upright under tool centre control: location error and feed marks of the wall as by dexels along z."""
    tip = studies.modal_dynamics(Modes([900.0, 1080.0], [0.02, 0.02], [[1.6, 0], [0, 1.5]], ("tool:+x", "tool:+y")))
    upright = parse("S9000\nG0 X-8 Y-3 Z-0.5\nG1 X48 F1800\nG0 Z90", start=(0, 0, 0.05))
    turned = "S9000\nG43.5\nG0 X-8 Y-3 Z-0.5 I0 J0 K1\nG1 X48 I0 J0 K1 F1800\nG49\nG0 Z90"
    three, five = studies.run_program(upright, _setup(spacing=5e-4), tip), _run(turned, tip, spacing=5e-4)
    k, m = int(np.argmax(three.blocks.depth)), int(np.argmax(five.blocks.depth))
    assert three.errors is not None and five.errors is not None
    for name in ("location", "marks"):
        expected = three.errors.columns[name][k]
        assert np.isfinite(expected) and five.errors.columns[name][m] == pytest.approx(expected, rel=0.03)
