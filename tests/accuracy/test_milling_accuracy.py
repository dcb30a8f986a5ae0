"""Milling accuracy along a path: closed form of one mode, laws (energy, convergence, zero force, base), and wrong input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.cutting import stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.drives import JerkLimits
from toolpoint.io.point_table import read_places
from toolpoint.io.yaml import machine_file, robot_file
from toolpoint.machine import assemble, build
from toolpoint.machine import description as d
from toolpoint.machine.assembly.inverse_dynamics import base_reaction
from toolpoint.machine.robot.model import rigid_members, robot_machine
from toolpoint.pages.robots.accuracy import accuracy_page
from toolpoint.studies.accuracy.milling_accuracy import MillingAccuracy, MillingSetup, mill_path, mill_side
from toolpoint.studies.accuracy.moving_structure import ToolStance, structure_along
from toolpoint.studies.accuracy.tool_paths import along_points, arc, line, sides_of, square
from toolpoint.studies.machines.tool_point import pose_problem, tool_point

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
CUT = CuttingDescription.of(diameter=0.006, teeth=2, helix=np.radians(42), tangential=1780e6, normal=593e6, edge_tangential=9e3,
                            edge_normal=7e3, direction="slot", feed_per_tooth=1e-5)
SETUP = MillingSetup(15000, 0.5e-3, window=0.2, halved=False)


@pytest.fixture(scope="module")
def robot():
    return build(robot_machine(rigid_members(robot_file.read(MACHINES / "milling_robot_datasheet.yaml")), cutting=CUT))


@pytest.fixture(scope="module")
def sides():
    return square(0.2, centre=(0.69, 0, 0.1), first=(0, 1, 0), second=(0, 0, 1), law="jerk-limited")


def slide(stiffness=4e5, damping=60.0, mass=8.0):
    """A slide that is driven along x and gives way along y on one spring."""
    body = d.BodyDescription(mass=mass, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"y": stiffness}, damping={"y": damping})
    return build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", "x")},
                                      {"tip": d.PointDescription("slide")}, tool="tip", cutting=CUT))


@pytest.mark.slow
def test_one_mode_against_its_closed_form():
    machine = slide()
    side = line([0, 0, 0], [0.02, 0, 0], law="jerk-limited")[0]
    result = mill_side(machine, side, replace(SETUP, steps=400, window=0.05))
    problem = pose_problem(tool_point(machine, [{}], np.array([0.0, 1.0])), CUT, 0)
    angle = (np.arange(40000) + 0.5) * 2 * np.pi / 40000
    force = rigid_forces(problem, 0.5e-3, angle).force[:, 1]
    harmonics = np.fft.rfft(force) / force.size
    omega = 2 * np.pi * 250 * np.arange(harmonics.size)
    response = harmonics / (4e5 - omega**2 * 8.0 + 1j * omega * 60.0)
    response[0] = 0
    radius = np.abs(np.fft.irfft(response * force.size))
    assert result.position_error == pytest.approx(radius.mean(), rel=1e-4)
    assert result.rotation_error == 0
    assert result.relative[:, 1].mean() == pytest.approx(harmonics[0].real / 4e5, rel=1e-4)


@pytest.mark.slow
def test_zero_force_gives_zero_error(robot, sides):
    result = mill_side(robot, sides[0], replace(SETUP, with_force=False))
    assert result.position_error == 0 and result.rotation_error == 0


@pytest.mark.slow
def test_work_and_energy_balance(robot, sides):
    result = mill_side(robot, sides[0], replace(SETUP, window=0.5, with_energy=True))
    assert result.energy.gap < 1e-6
    assert result.energy.dissipated > 0


def test_half_the_step_gives_a_quarter_of_the_error(robot, sides):
    errors = [mill_side(robot, sides[0], replace(SETUP, steps=steps)).position_error for steps in (25, 50, 100, 200)]
    first, second, third = (abs(e - errors[-1]) for e in errors[:3])
    assert 3.5 < first / second < 4.6 and 3.3 < second / third < 5.5


def test_half_the_spacing_changes_little_and_nothing_beats_with_whole_tooth_periods(robot, sides):
    # 10 mm at 5 mm/s are 1000 tooth periods: nodes at whole and half ones, and at others, agree.
    values = [mill_side(robot, sides[0], replace(SETUP, spacing=spacing, window=1.0)).position_error
              for spacing in (2e-3, 1.7e-3, 1e-3)]
    np.testing.assert_allclose(values, values[-1], rtol=0.01)


@pytest.mark.slow
def test_the_stated_halving_bounds_the_change_of_half_the_step(robot, sides):
    coarse = mill_side(robot, sides[0], replace(SETUP, halved=True))
    fine = mill_side(robot, sides[0], replace(SETUP, steps=200, spacing=1e-3))
    assert abs(fine.position_error / coarse.position_error - 1) < max(coarse.halving, 1e-4)


def test_mean_deflection_is_the_compliance_times_the_mean_force(robot, sides):
    structure = structure_along(robot, sides[0], ToolStance(), spacing=0.05)
    result = mill_side(robot, sides[0], replace(SETUP, window=0.1))
    pose = {name: values[len(values) // 2] for name, values in structure.reach.batch().items()}
    system = assemble(robot, pose, ["tip:+x", "tip:+y", "tip:+z"])
    compliance = system.output_map @ np.linalg.solve(system.stiffness, system.input_map)
    problem = pose_problem(tool_point(robot, [pose], np.array([0.0, 1.0])), CUT, 0)
    mean = rigid_forces(problem, 0.5e-3, np.arange(3600) * np.pi / 1800).force.mean(axis=0)
    expected = compliance @ (structure.axes[len(structure.axes) // 2] @ mean)
    np.testing.assert_allclose(result.relative[:, :3].mean(axis=0), expected, rtol=5e-3)


@pytest.mark.slow
def test_base_carries_weight_and_mean_force(robot, sides):
    result = mill_side(robot, sides[0], replace(SETUP, loads=("cutting", "gravity"), with_base=True))
    structure = structure_along(robot, sides[0], ToolStance(), spacing=0.05)
    k = len(structure.axes) // 2
    pose = {name: values[k] for name, values in structure.reach.batch().items()}
    problem = pose_problem(tool_point(robot, [pose], np.array([0.0, 1.0])), CUT, 0)
    mean = structure.axes[k] @ rigid_forces(problem, 0.5e-3, np.arange(3600) * np.pi / 1800).force.mean(axis=0)
    weight = base_reaction(robot, pose, gravity=(0, 0, -9.80665))[0, :3]
    np.testing.assert_allclose(result.base[:, :3].mean(axis=0), weight - mean, atol=0.02)
    whole = MillingAccuracy("robot", SETUP, (result,))
    assert whole.base_lines()[0] in whole.table() and whole.to_dict()["sides"][0]["base"][1][2] == result.base[:, 2].max()


def test_loads_are_stated_and_matter(robot, sides):
    cutting = mill_path(robot, sides[:1], replace(SETUP, window=2.0))
    sagging = mill_path(robot, sides[:1], replace(SETUP, window=2.0, loads=("cutting", "gravity")))
    assert cutting.loads != sagging.loads and "gravity" in sagging.loads
    assert sagging.position_error > 1.5 * cutting.position_error


def test_gravity_alone_is_the_sag_along_the_path(robot):
    sides = square(0.06, centre=(0.69, 0, 0.1), first=(0, 1, 0), second=(0, 0, 1), law="jerk-limited")
    result = mill_side(robot, sides[0], replace(SETUP, window=None, steps=20, spacing=5e-3, loads=("gravity",),
                                                with_force=False))
    sag = []
    for at in (0.0, sides[0].length):
        structure = structure_along(robot, sides[0], ToolStance(), spacing=0.05, loads=("gravity",))
        i = 0 if at == 0 else -1
        system = structure.system
        sag.append(system.output_map[i, :3] @ np.linalg.solve(system.stiffness[i], system.input_map[i, :, 3]))
    np.testing.assert_allclose(result.relative[[0, -1], :3], sag, rtol=1e-3, atol=1e-9)


@pytest.mark.slow
def test_regeneration_agrees_with_the_stability_chart():
    machine = slide()
    problem = pose_problem(tool_point(machine, [{}], np.array([0.0, 1.0])), CUT, 0)
    limit = float(stability.chart(problem, [1500.0], depth_max=2e-3).limit[0])
    side = line([0, 0, 0], [0.02, 0, 0], law="jerk-limited")[0]  # speeding up disturbs the cut at its start

    def grown(depth):
        setup = replace(SETUP, speed=1500.0, depth=depth, window=None, steps=60, regenerative=True)
        radius = mill_side(machine, side, setup).position_radius
        n = radius.size // 4
        return radius[2 * n:3 * n].max() / radius[n:2 * n].max()

    assert grown(0.8 * limit) < 1.0 < grown(1.2 * limit)


@pytest.mark.parametrize("regenerative", [False, True])
@pytest.mark.default_cases(1)
def test_a_cut_that_chatters_is_doubted_whatever_the_halving_says(regenerative):
    """Without feedback nothing grows, and half the step changes nothing: only the stability chart knows."""
    machine = slide()
    problem = pose_problem(tool_point(machine, [{}], np.array([0.0, 1.0])), CUT, 0)
    limit = float(stability.chart(problem, [1500.0], depth_max=2e-3).limit[0])
    sides = line([0, 0, 0], [0.02, 0, 0], feed=CUT.feed_per_tooth * 2 * 1500 / 60)
    below, above = (mill_path(machine, sides, replace(SETUP, speed=1500.0, depth=share * limit, window=0.1,
                                                      regenerative=regenerative, halved=True)) for share in (0.95, 1.05))
    assert below.doubts == () and below.status.startswith("converged")
    assert above.sides[0].halving < 0.05 and len(above.doubts) == 1 and above.status.startswith("doubtful")
    assert "chatters at 3 of 3 poses" in above.table() and above.to_dict()["doubts"]
    assert "only 0.1 s of the middle" in below.table() and "Doubtful" in accuracy_page(above, 2).html()
    assert mill_path(machine, sides, replace(SETUP, depth=0.1, window=0.1, with_force=False)).doubts == ()


@pytest.mark.slow
def test_a_cut_that_grows_without_bound_is_named():
    side = line([0, 0, 0], [0.02, 0, 0], law="jerk-limited")[0]
    with pytest.raises(ToolpointError, match="grows without bound"):
        mill_side(slide(), side, replace(SETUP, speed=1500.0, depth=2e-3, window=None, steps=60, regenerative=True))


@pytest.mark.slow
def test_members_that_bend_balance_and_converge_too(sides):
    bending = machine_file.read(MACHINES / "milling_robot.yaml")
    wide, near = (mill_side(bending, sides[0],
                            replace(SETUP, with_energy=True, spacing=spacing, window=0.1)) for spacing in (2e-3, 1e-3))
    # The gap is that of blending between nodes.
    assert near.energy.gap < 0.6 * wide.energy.gap < 1e-6
    assert near.position_error == pytest.approx(wide.position_error, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.01, 0.02, 0.05])
def test_short_lines_balance_with_members_that_bend(length):
    """At the default spacing, wherever the window lies between nodes."""
    bending = machine_file.read(MACHINES / "milling_robot.yaml")
    side = line([0.69, -length / 2, 0.1], [0.69, length / 2, 0.1])[0]
    assert mill_side(bending, side, replace(SETUP, with_energy=True, window=0.1)).energy.gap < 1e-6


def test_paths_and_their_laws():
    sides = square(0.1, law="quintic", feed=0.005)
    assert [side.length for side in sides] == pytest.approx([0.1] * 4)
    # Peak speed of the quintic is 15/8 L/T.
    assert sides[0].law.duration == pytest.approx(15 / 8 * 0.1 / 0.005)
    assert sides[0].law.sample(np.array([sides[0].law.duration / 2]))[0, 1] == pytest.approx(0.005)
    round_ = arc(0.05, np.pi, first=(1, 0, 0), second=(0, 1, 0), centre=(0, 0, 0.2))[0]
    assert round_.length == pytest.approx(0.05 * np.pi)
    np.testing.assert_allclose(round_.points(np.array([round_.length / 2])), [[0, 0.05, 0.2]], atol=1e-12)
    np.testing.assert_allclose(round_.tangents(np.array([0.0])), [[0, 1, 0]], atol=1e-9)
    limits = JerkLimits(0.005, 0.5, 5.0)
    assert line([0, 0, 0], [0.1, 0, 0], law="jerk-limited",
                limits=limits)[0].law.duration == pytest.approx(20 + 2 * (0.005 / 5) ** 0.5)


@pytest.mark.parametrize(("text", "expected"), [
    ("0.1,0,0.2\n0.2,0,0.2\n", [[0.1, 0, 0.2], [0.2, 0, 0.2]]), ("x,y,z\n0.1,0,0.2\n", [[0.1, 0, 0.2]]),
    ("X [mm], Y [mm], Z [mm]\n100,0,200\n", [[0.1, 0, 0.2]]), ("x mm,y mm,z mm\n\n100,0,200\n", [[0.1, 0, 0.2]]),
    ("z,y,x\n0,0,0\n", "columns must be x, y, z in this order"), ("x mm,y cm,z m\n100,0,0.2\n", [[0.1, 0, 0.2]]),
    ("x mm,y,z\n0,0,0\n", "unit of some columns"), ("x ft,y ft,z ft\n0,0,0\n", "unknown unit 'ft'"),
    ("1,2\n3,4\n", "2 lines of 2 numbers"),
    ("", "must be lines of x,y,z"), ("0,0,nan\n", "finite")])
def test_places_of_a_path_with_and_without_names(tmp_path, text, expected):
    (tmp_path / "p.csv").write_text(text)
    if isinstance(expected, str):
        with pytest.raises(ToolpointError, match=expected):
            read_places(tmp_path / "p.csv")
    else:
        np.testing.assert_allclose(read_places(tmp_path / "p.csv"), expected, rtol=1e-12)


def test_program_becomes_sides(tmp_path):
    from toolpoint.io import read_path

    (tmp_path / "p.nc").write_text("G90 G17\nG0 X0 Y0\nG1 X50 Y0 F300\nG1 X50 Y50\nG3 X40 Y60 I-10 J0\nM30\n")
    sides = sides_of(read_path(tmp_path / "p.nc"))
    assert [round(1e3 * side.length, 3) for side in sides] == [50, 65.708]  # the arc goes on tangentially


@pytest.mark.parametrize(("call", "words"), [
    (lambda robot: mill_path(robot, square(0.2, centre=(1.2, 0, 0.1), first=(0, 1, 0), second=(0, 0, 1)), SETUP),
     "out of reach"),
    (lambda robot: mill_path(robot, line([0.72, -0.002, 0.325], [0.72, 0.002, 0.325]), replace(
        SETUP, spacing=1e-4, stance=ToolStance(branch="front up no flip"))), "singular"),
    (lambda robot: mill_path(robot, line([0.6, 0, 0.1], [0.7, 0, 0.1]), SETUP), "along the tool's axis"),
    (lambda robot: mill_path(robot, square(0.02, centre=(0.69, 0, 0.1), first=(0, 1, 0), second=(0, 0, 1)), SETUP,
                             cut=CuttingDescription.of(diameter=0.006, teeth=2, direction="slot")), "oefficient"),
    (lambda robot: mill_path(robot, line([0.65, 0, 0.1], [0.65, 0.1, 0.1]), replace(SETUP, loads=("wind",))),
     "must be of cutting"),
    (lambda robot: along_points([[0, 0, 0], [1e-3, 0, 0], [2e-3, 0, 0], [3e-3, 0, 0], [4e-3, 0, 0], [0.5, 0, 0]]),
     "a jump of 496 mm from point 5 to 6"),
    (lambda robot: along_points([[0, 0, 0], [0, 0, 0]]), "point 2 repeats"),
    (lambda robot: mill_path(robot, line([0.65, 0, 0.1], [0.65, 0.1, 0.1]), replace(SETUP, window=0.0)),
     "window: 0; must be above"),
    (lambda robot: mill_path(robot, square(0.2, centre=(0.69, 0, 0.1)), replace(
        SETUP, stance=ToolStance(branch="front sideways"))), "must be of front up no flip"),
])
def test_bad_input(robot, call, words):
    with pytest.raises(ToolpointError, match=words):
        call(robot)
