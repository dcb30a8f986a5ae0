"""One page of every kind from small studies, for the tests that look at pages."""

from __future__ import annotations

import importlib
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint.plot import Report

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "src/toolpoint/app/machines"
CASES: dict[str, Callable[[], Report]] = {}


def case(function: Callable[[], Report]) -> Callable[[], Report]:
    """List a page by its name."""
    CASES[function.__name__] = function
    return function


def machine(name: str = "three_axis_vertical.yaml") -> Any:
    from toolpoint.io import read_machine

    return read_machine(FOLDER / name)


def text(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


def rough() -> Any:
    from toolpoint.cutting import ZeroOrder

    return ZeroOrder()


def example(name: str) -> Any:
    if str(ROOT / "examples") not in sys.path:
        sys.path.append(str(ROOT / "examples"))
    return importlib.import_module(name)


def tip(frequency: float = 922.0, second: float = 1140.0) -> Any:
    from toolpoint.studies import modal_dynamics
    from toolpoint.vibration import Modes

    return modal_dynamics(Modes([frequency, second], [0.011, 0.02], np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y")))


CUT = {"diameter": 0.012, "teeth": 2, "immersion": 0.5, "direction": "down", "tangential": 6e8, "normal": 2e8}


@case
def demo() -> Report:
    from toolpoint.pages.machines.demo import demo_page
    from toolpoint.studies.machines.machine_report import study_machine, study_modes

    names = "three_axis_vertical.yaml", "three_axis_vertical_drives.yaml"
    studied = study_machine(machine(names[1]), method=rough())
    return demo_page(study_modes(machine(names[0])), studied, [(name, text(name)) for name in names])


@case
def machine_of_file() -> Report:
    from toolpoint.pages.machines.machine import machine_page
    from toolpoint.studies.machines.machine_report import study_machine

    name = "hexapod_6_ups.yaml"
    return machine_page(study_machine(machine(name), method=rough()), text(name), name)


@case
def workspace() -> Report:
    from toolpoint.pages.machines.demo import workspace_page
    from toolpoint.studies.robots.workspace import study_workspace

    name = "three_rps_head.yaml"
    axes = {"tilt": np.radians(np.linspace(0, 30, 7)), "azimuth": np.radians(np.linspace(0, 360, 9))}
    return workspace_page(study_workspace(machine(name), axes, method=rough()), source=text(name), file_name=name)


@case
def map_of_one_axis() -> Report:
    from toolpoint.pages import map_page
    from toolpoint.studies.machines.pose_map import pose_map

    return map_page(pose_map(machine(), {"X": np.linspace(-0.3, 0.3, 21)}), "three_axis_vertical")


@case
def map_of_few_poses() -> Report:
    from toolpoint.pages import map_page
    from toolpoint.studies.machines.pose_map import pose_map

    return map_page(pose_map(machine(), {"X": np.linspace(-0.3, 0.3, 5), "Y": np.linspace(-0.2, 0.2, 3)}), "mill")


@case
def map_of_responses() -> Report:
    from toolpoint.pages import map_page
    from toolpoint.studies.machines.response_map import response_map

    grid = {"X": np.linspace(-0.3, 0.3, 5), "Y": np.linspace(-0.2, 0.2, 3)}
    return map_page(response_map(machine("three_axis_vertical_drives.yaml"), grid), "mill")


@case
def two_states() -> Report:
    from toolpoint.pages import state_comparison_page
    from toolpoint.studies import compare_two_states

    one = machine()
    other = one.with_values({"joints.foundation.stiffness.rx": 0.9 * one.value("joints.foundation.stiffness.rx")})
    return state_comparison_page(compare_two_states(("new", one), ("worn", other), rng=np.random.default_rng(1)))


@case
def head_beside_its_source() -> Report:
    from toolpoint.pages import head_source_page
    from toolpoint.studies import study_published_head

    name = "three_rps_tested_head.yaml"
    return head_source_page(study_published_head(machine(name), method=rough()), source=text(name), file_name=name)


@case
def program_on_a_machine() -> Report:
    from toolpoint.io.program.gcode import parse
    from toolpoint.pages import machining_page
    from toolpoint.studies import compare_record, cuts_of_options, describe_machining, run_program, stock_of
    from toolpoint.studies.machining.recorded.spindle_load import spindle_load

    program = "S9000 G1 F1800 X-20 Y25 Z-2\nX60\nY32\nX-20\n"
    cut = cuts_of_options(None, {key: CUT[key] for key in ("diameter", "teeth", "tangential", "normal")})
    setup = describe_machining(stock_of("box", (0, 0, -0.01, 0.04, 0.05, 0)), cut, spacing=5e-4)
    result = run_program(parse(program, start=(-0.02, 0.025, 0.1)), setup, tip(), text=program, lobes=2)
    load = spindle_load(result.laid, result.removed, result.loads, setup=setup, step=0.01)
    recorded = 300 + 1.1 * load.total + np.random.default_rng(0).normal(0, 5, load.time.size)
    return machining_page(compare_record(result, load.time, recorded, name="spindle power"))


@case
def program_of_a_project() -> Report:
    from toolpoint.io.program.gcode import parse
    from toolpoint.pages import project_program_page
    from toolpoint.project.programs.run_files import ProgramRun
    from toolpoint.studies import ToolTips, cuts_of_options, describe_machining, run_program, stock_of

    program = "S9000 G1 F1800 X-20 Y25 Z-2\nX60\nY32\nX-20\n"
    cut = cuts_of_options(None, {key: CUT[key] for key in ("diameter", "teeth", "tangential", "normal")})
    setup = describe_machining(stock_of("box", (0, 0, -0.01, 0.04, 0.05, 0)), cut, spacing=5e-4)
    study = run_program(parse(program, start=(-0.02, 0.025, 0.1)), setup, tip(), text=program)
    places = [{"line": line, "tool": 1, "speed_rpm": 9000.0, "depth_m": 2e-3, "limit_m": limit, "interval_m": [1.7e-3, upper],
               "stable_probability": chance, "chatter_frequency_hz": 640.0}
              for line, limit, upper, chance in ((2, 2.2e-3, 2.9e-3, 0.81), (4, None, None, 0.98))]
    advice = [{"words": "Advice for tool 1: 9600 rev/min in place of 9000."}]
    return project_program_page(ProgramRun(study, {0: ("slot", 0.1)}, (), (), ToolTips()), {
        "places": places, "draws": 60, "stable_probability": 0.8, "stable_probability_advised": 0.97, "advice": advice,
        "record": None})


@case
def program_in_tilted_planes() -> Report:
    from toolpoint.io.program.gcode import parse
    from toolpoint.pages import stages_page
    from toolpoint.studies import cuts_of_options, describe_machining, run_stages, stock_of

    run = example("mill_in_a_tilted_plane")
    cut = cuts_of_options(None, {key: CUT[key] for key in ("diameter", "teeth", "tangential", "normal")})
    setup = describe_machining(stock_of("box", (0, 0, -0.02, 0.04, 0.02, 0)), cut, spacing=8e-4)
    return stages_page(run_stages(parse(run.PROGRAM, start=(0, 0, 0.05)), setup, text=run.PROGRAM))


@case
def program_of_five_axes() -> Report:
    from toolpoint.io.program.gcode import parse
    from toolpoint.pages import machining_page
    from toolpoint.studies import cuts_of_options, describe_machining, run_five_axes, stock_of

    run = example("mill_with_a_leaning_tool")
    values = {key: CUT[key] for key in ("diameter", "teeth", "tangential", "normal")} | {"flute_length": 0.02}
    setup = describe_machining(stock_of("box", (0, 0, -0.01, 0.04, 0.02, 0)), cuts_of_options(None, values), spacing=1e-3)
    return machining_page(run_five_axes(parse(run.PROGRAM, start=(0, 0, 0.05)), setup, text=run.PROGRAM))


@case
def campbell() -> Report:
    from toolpoint.io import read_machine
    from toolpoint.pages import campbell_page
    from toolpoint.studies import map_speeds

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "spindle.yaml"
        file.write_text(example("draw_a_campbell_diagram").SPINDLE)
        return campbell_page(map_speeds(read_machine(file), np.linspace(0, 30000, 13), 6))


@case
def identification() -> Report:
    from toolpoint.pages import identification_page
    from toolpoint.studies.measured.identification import identify_modes
    from toolpoint.vibration import Dof, Modes, frequency_response
    from toolpoint.vibration.geometry import Geometry

    rng = np.random.default_rng(5)
    points = {k: rng.uniform(0, 1, 3) for k in range(1, 7)}
    labels = tuple(Dof(p, w) for p in points for w in ("+x", "+y", "+z"))
    truth = Modes([21.0, 34.0, 36.0, 52.0], [0.02, 0.03, 0.02, 0.015], rng.normal(size=(18, 4)), labels)
    frf = frequency_response.modal(truth, np.linspace(5, 80, 601), inputs=[labels[0], labels[4]], quantity="accelerance")
    noise = rng.normal(size=(2, *frf.values.shape))
    frf = replace(frf, values=frf.values * (1 + 0.02 * (noise[0] + 1j * noise[1])),
                  coherence=1 - 0.02 * rng.random(frf.values.shape))
    shape = Geometry(points, [(1, 2), (2, 3), (3, 4), (4, 5)])
    return identification_page(identify_modes(frf, "refined", (5, 80)), shape, ["test.uff"])


@case
def lobes() -> Report:
    from toolpoint.pages import lobes_page
    from toolpoint.studies import Uncertainty, chart_lobes

    known = Uncertainty(20, cuts=((12000.0, 0.3e-3, False),))
    return lobes_page(chart_lobes(tip(), CUT, speeds=np.linspace(8000, 20000, 40), uncertainty=known, other_cuts=None))


@case
def turning() -> Report:
    from toolpoint.pages import turning_page
    from toolpoint.studies.cuts.turning.study import TurningCut, chart_turning

    return turning_page(chart_turning(tip(250, 330), TurningCut(1.5e9, 0.0, None, None, 0.0, None, None),
                                      np.linspace(300, 6000, 100)))


@case
def simulated_cut() -> Report:
    from toolpoint.pages import simulation_page
    from toolpoint.studies.cuts.simulated_cut import simulate_cut

    return simulation_page(simulate_cut(tip(), CUT, speed=12000.0, depth=0.1e-3, revolutions=40))


@case
def chatter_map() -> Report:
    from toolpoint.pages import chatter_map_page
    from toolpoint.studies import map_chatter

    mill = machine("three_axis_vertical_drives.yaml")
    result = map_chatter(mill, {"X": [-0.2, 0, 0.2], "Z": [0.0, 0.3]}, speeds=np.linspace(900, 1600, 15),
                         feed_angles=np.radians([0, 90]), method=rough())
    return chatter_map_page(result, mill, result.notes)


@case
def tool_coupling() -> Report:
    from toolpoint.pages import tool_coupling_page
    from toolpoint.studies import bases_from_gauge, study_tool

    gauge = example("couple_a_tool_to_a_spindle")
    bases = bases_from_gauge(gauge.struck_gauge(), gauge.GAUGE, noise=0.001, generator=np.random.default_rng(1))
    return tool_coupling_page(study_tool(bases, gauge.TOOL, stick_out=("shank", np.array([0.04, 0.06]))))


@case
def calibration() -> Report:
    from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
    from toolpoint.cutting.cut.plane import PlaneDynamics
    from toolpoint.cutting.force.laws import rigid_forces
    from toolpoint.pages import calibration_page
    from toolpoint.studies import CuttingTest, calibrate
    from toolpoint.vibration import Dof, Record

    feeds, rng = (0.5e-4, 1e-4, 1.5e-4), np.random.default_rng(1)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    angle, labels, records = 2 * np.pi * 50 * np.arange(2000) / 10000.0, tuple(Dof("tool", f"+{w}") for w in "xyz"), []
    for feed in feeds:
        problem = MillingProblem(Tool(0.016, 4), Engagement.down(0.5), CuttingCoefficients(7e8, 2e8), rigid,
                                 feed_per_tooth=feed)
        force = rigid_forces(problem, 2e-3, angle).force
        records.append((f"{feed} m", Record(force + rng.normal(size=force.shape), 10000.0, labels, ("force",) * 3)))
    test = CuttingTest({"diameter": 0.016, "teeth": 4, "immersion": 0.5}, 3000.0, 2e-3, feeds, runout=False)
    return calibration_page(calibrate(records, test))


@case
def correlation() -> Report:
    from toolpoint.pages import correlation_page
    from toolpoint.studies import compare_with_test, gather_test
    from toolpoint.studies.machines.virtual_test import surface_points, true_modes
    from toolpoint.vibration.geometry import Geometry

    mill, path = machine(), "joints.foundation.stiffness.rx"
    points = surface_points(mill, 40, np.random.default_rng(3))
    test = gather_test(true_modes(mill, points, 0.03), geometry=Geometry(points.coordinates, []), owner=points.components)
    return correlation_page(compare_with_test(mill.with_values({path: 0.8 * mill.value(path)}), test))


@case
def update() -> Report:
    from four_part_mill import four_part_mill

    from toolpoint.machine import assemble
    from toolpoint.pages import update_page
    from toolpoint.studies import Measurement, update_machine
    from toolpoint.vibration import eigen, frequency_response

    mill, path = four_part_mill(), "joints.column_housing.stiffness.x"
    modes = eigen.solve_undamped(assemble(mill), 6)
    frf = frequency_response.direct(assemble(mill, None, modes.dofs[:2], inputs=modes.dofs[:1]), np.arange(5.0, 80.0, 0.5))
    wrong = mill.with_values({path: 0.5 * mill.value(path)})
    return update_page(update_machine(wrong, [Measurement(modes, frf)], [path, "joints.column_housing.stiffness.y"]))


@case
def element_sensitivity() -> Report:
    from toolpoint.machine import build
    from toolpoint.machine.description import BodyDescription, JointDescription, MachineDescription
    from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, PatchDescription
    from toolpoint.pages import element_page
    from toolpoint.studies import study_elements

    foot = PatchDescription((0.1, 0.05, 0), (1, 0, 0), (0, -1, 0), 0.2, 0.1)
    post = ElasticDescription((CastingBox((0, 0, 0), (0.2, 0.1, 0.5)),), {"foot": foot}, band=4000.0, mesh_size=0.06)
    joint = JointDescription("ground", "post", stiffness=dict.fromkeys(("x", "y", "z"), 4e8) | dict.fromkeys(
        ("rx", "ry", "rz"), 1e6), child_interface="foot")
    machine = build(MachineDescription("post", {"post": BodyDescription(elastic=post)}, {"bolts": joint}))
    return element_page(study_elements(machine, modes=4))


@case
def sensitivity() -> Report:
    from toolpoint.pages import sensitivity_page
    from toolpoint.studies.machines.sensitivity_study import study_sensitivity

    mill = machine("three_axis_vertical_drives.yaml")
    return sensitivity_page(study_sensitivity(mill), mill)


@case
def joints() -> Report:
    from toolpoint.machine.components import Components
    from toolpoint.machine.description import BodyDescription, ShapeDescription
    from toolpoint.pages import joints_page
    from toolpoint.studies import study_joints
    from toolpoint.studies.machines.virtual_test import surface_points, true_modes
    from toolpoint.vibration.geometry import Geometry

    known, mill = example("find_joints_of_a_machine"), machine()
    points = surface_points(mill, 60, np.random.default_rng(3))
    owner = {name: [p for p, (body, _) in points.places.items() if body in bodies] for name, bodies in known.PARTS.items()}
    bodies = {name: BodyDescription(mass=mass, centre=centre, shape=ShapeDescription("box", size=size))
              for name, (mass, centre, size) in known.BOXES.items()}
    components = Components("a virtual test", ("ground", *known.PARTS), owner, bodies)
    return joints_page(study_joints(true_modes(mill, points, 0.03), Geometry(points.coordinates, []), components))


@case
def drive_on_a_circle() -> Report:
    from toolpoint.io import read_drives
    from toolpoint.pages import drive_page
    from toolpoint.studies import run_drives

    name = "three_axis_vertical_servo.yaml"
    return drive_page(run_drives(read_drives(FOLDER / name), circle=(0.05, 4.0 / 60)), source_text=text(name))


@case
def circle_beside_its_goal() -> Report:
    from toolpoint.machine.description.project_plan import ContourGoal
    from toolpoint.pages import circle_page
    from toolpoint.studies import study_circle

    return circle_page(study_circle(_described_drives("XY"), ContourGoal(0.03, 0.05, 2e-6)))


def _described_drives(names: str = "X") -> Any:
    """Return axes of two masses with motor and current loop."""
    from toolpoint.drives.description import (
        CurrentDescription,
        DriveAxisDescription,
        DriveDescription,
        MechanicsDescription,
        MotorDescription,
        PositionDescription,
        VelocityDescription,
    )

    mechanics = MechanicsDescription("two-mass", lead=0.01, inertia=0.006, table_mass=300.0, stiffness=1e8, damping=5e3)
    axis = DriveAxisDescription(
        mechanics=mechanics, position=PositionDescription(gain=30.0),
        velocity=VelocityDescription(gain=1.0, integral_time=0.02),
        motor=MotorDescription(4, 0.5, 5e-3, flux=0.15), current=CurrentDescription(bandwidth=500.0))
    return DriveDescription("Slide", dict.fromkeys(names, axis), assumptions=("All values are chosen.",))


@case
def servo_steps() -> Report:
    from toolpoint.pages import step_page
    from toolpoint.studies import StepSetting, step_drives

    steps = [StepSetting("X", "current", 0.03, True), StepSetting("X", "velocity", 0.5 / 60),
             StepSetting("X", "position", 5e-4)]
    return step_page(step_drives(_described_drives(), steps))


@case
def servo_tuning() -> Report:
    from toolpoint.pages import tuning_page
    from toolpoint.studies import tune_drives

    return tuning_page(tune_drives(_described_drives()))


@case
def shaker_on_the_table() -> Report:
    from toolpoint.pages import shaker_stand_page
    from toolpoint.studies import stand_shaker
    from toolpoint.substructuring.shaker import CoilDrive, ElectrodynamicShaker

    shaker = ElectrodynamicShaker(20.0, 0.4, 5e3, suspension_damping=5.0)
    return shaker_stand_page(stand_shaker(machine(), shaker, "tool:+z", stand="table", frequency=np.linspace(10, 200, 381),
                                          coil=CoilDrive(10.0, 2.0, 1e-3)))


@case
def servo_map() -> Report:
    from toolpoint.io import read_drives
    from toolpoint.pages import servo_map_page
    from toolpoint.studies import map_servo

    drives = read_drives(FOLDER / "three_axis_vertical_servo_on_structure.yaml")
    return servo_map_page(map_servo(drives, machine=machine("three_axis_vertical_drives.yaml"),
                                    grid={"X": np.linspace(-0.3, 0.3, 2), "Z": np.linspace(0, 0.3, 2)}))


@case
def servo_data() -> Report:
    from toolpoint.io import read_servo_data
    from toolpoint.pages import servo_data_page
    from toolpoint.studies import judge_servo_data

    time = np.arange(0, 4, 2e-3)
    speed = 50 * np.sign(np.sin(np.pi * time + 1e-9)) * np.where(time < 2, 1.0, 0.5)
    current = 3 + 1.2 * np.sign(speed) + 4e-3 * speed
    rows = "\n".join(f"{t:.3f};{v:.4f};{i:.4f};{v / 25:.6f}" for t, v, i in zip(time, speed, current, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        path.write_text("time [s];v set Z (mm/s);current Z (A);following error Z (mm)\n" + rows + "\n", encoding="utf-8")
        return servo_data_page(judge_servo_data(read_servo_data(path)))


@case
def robot() -> Report:
    from toolpoint.io.yaml import robot_file
    from toolpoint.pages import robot_page
    from toolpoint.studies.robots.datasheet_study import study_datasheet

    path = FOLDER / "milling_robot_datasheet.yaml"
    return robot_page(study_datasheet(robot_file.read(path), robot_file.read_robot_machine(path)), text(path.name), path.name)


@case
def region() -> Report:
    from toolpoint.pages import place_page
    from toolpoint.studies import map_places, place_grid, plane_directions, search_regions

    arm, grid = machine("milling_robot.yaml"), place_grid({"x": np.arange(0.3, 0.61, 0.1), "z": np.arange(-0.2, 0.41, 0.1)})
    search = search_regions(arm, grid.places.reshape(-1, 3), plane_directions([1, 0, 0], [0, 0, 1]), point="wrist")
    return place_page(map_places(arm, grid, point="wrist"), search, "milling_robot")


@case
def accuracy() -> Report:
    from toolpoint.pages import accuracy_page
    from toolpoint.studies import MillingSetup, mill_path, square

    sides = square(0.2, centre=(0.77, 0, 0.26), first=(0, 1, 0), second=(0, 0, 1), feed=0.005, law="jerk-limited")
    result = mill_path(machine("milling_robot.yaml"), sides[:1], MillingSetup(speed=15000, depth=0.5e-3, window=0.2))
    return accuracy_page(result, 2)


@case
def screening() -> Report:
    from toolpoint.io.yaml import plan_file
    from toolpoint.pages import screening_page
    from toolpoint.studies.screening.planned import run_plan

    plan = replace(plan_file.read(FOLDER / "milling_robot_screening.yaml"), metrics=("frequency 1", "frequency 2"), square=None)
    return screening_page(run_plan(plan, machine(plan.machine)), "milling_robot_screening")


@case
def responses() -> Report:
    from toolpoint.machine import build
    from toolpoint.machine.description import IdentifiedDescription
    from toolpoint.pages import responses_page
    from toolpoint.studies import study_responses_of_machine

    mill, paths = machine(), ("joints.foundation.stiffness.rx", "joints.column_foot.stiffness.rx")
    size = np.array([0.01 * mill.value(p) for p in paths])
    rows = np.outer(size, size) * np.array([[1, -0.4], [-0.4, 1]])
    known = IdentifiedDescription(paths, tuple(tuple(map(float, row[:n + 1])) for n, row in enumerate(rows)))
    mill = build(replace(mill.description, identified=known))
    label = f"{mill.description.tool}-{mill.description.table}:+y"
    return responses_page(study_responses_of_machine(mill, outputs=[label], frequency=np.linspace(0.1, 120, 200)))


@case
def measured_responses() -> Report:
    from toolpoint.pages import first_look_page
    from toolpoint.studies import study_machine_and_responses
    from toolpoint.vibration import Modes, frequency_response

    modes = Modes([900.0, 1010.0, 1700.0], 0.02, np.array([[1.0, 0.5, 0.8]]), ("1:+x",))
    frf = frequency_response.modal(modes, np.arange(100.0, 3000.0), inputs=["1:+x"])
    return first_look_page(study_machine_and_responses(frf=frf, band=(150, 2900)), names=["tip.txt"])


def blows(*heights: float, at: str = "1:+x") -> Any:
    from signals.hammer_case import struck
    from toolpoint.signals.record_set import RecordSet

    rng = np.random.default_rng(3)
    records = tuple(struck([height], at=at, rng=rng, noise=1e-3) for height in heights)
    return RecordSet(records, tuple(f"{at[0]}_{k}.csv" for k in range(1, len(records) + 1)))


@case
def hammer_records() -> Report:
    from toolpoint.pages.measured.hammer_records import hammer_page
    from toolpoint.signals.record_set import RecordSet
    from toolpoint.studies import study_hammer_records

    first, second = blows(100, 8, 90, 110), blows(95, 105, 100, at="2:+x")
    return hammer_page(study_hammer_records(RecordSet(first.records + second.records, first.names + second.names)))


@case
def driven_responses() -> Report:
    from toolpoint.io import read_drives, read_machine
    from toolpoint.pages.machines.driven_responses import driven_responses_page
    from toolpoint.studies import study_driven_responses

    folder = ROOT / "src/toolpoint/app/machines"
    machine = read_machine(folder / "three_axis_vertical_drives.yaml")
    drives = read_drives(folder / "three_axis_vertical_servo_on_structure.yaml")
    return driven_responses_page(study_driven_responses(machine, drives, frequency=np.linspace(2, 300, 150)))


@case
def shaker_records() -> Report:
    from toolpoint.pages.measured.shaker_records import records_page
    from toolpoint.signals import ShakerSettings
    from toolpoint.studies import study_shaker_records
    from toolpoint.vibration import Record

    rng = np.random.default_rng(3)
    force, gain = rng.standard_normal((20000, 2)), np.array([[2e-6, 1e-6], [1e-6, 3e-6]])
    motion = force @ gain + 1e-7 * rng.standard_normal((20000, 2))
    labels, kinds = ["1:+x", "2:+x", "1:+x", "2:+x"], ["force", "force", "displacement", "displacement"]
    # By the door of both kinds of records: it calls `shaker_page`.
    return records_page(study_shaker_records([Record(np.hstack([force, motion]), 1000.0, labels, kinds)], ShakerSettings(2.0)))


@case
def tap() -> Report:
    from toolpoint.pages.testing.tap import tap_page
    from toolpoint.studies import study_tap
    from toolpoint.vibration import Modes, frequency_response

    modes = Modes([920.0, 1480.0], [0.03, 0.025], [[2.1, 1.3]], ["tip:+x"])
    frf = frequency_response.modal(modes, np.arange(60.0, 3000.0, 4), inputs=["tip:+x"])
    return tap_page(study_tap(frf, values=CUT, speeds=(6000.0, 18000.0), rng=np.random.default_rng(0)))


@case
def operational() -> Report:
    from scipy.signal import lfilter

    from toolpoint.pages.measured.operational import operational_page
    from toolpoint.studies import study_operational
    from toolpoint.vibration import Record

    rng, rate = np.random.default_rng(2), 80.0
    motion = []
    for frequency in (9.0, 17.0):
        z = np.exp(2 * np.pi * frequency / rate * (-0.02 + 1j))
        motion.append(lfilter([1.0], [1.0, -2 * z.real, abs(z) ** 2], rng.standard_normal(24_000)))
    values = np.array(motion).T @ np.array([[1.0, 0.6, -0.4], [0.5, -0.8, 1.0]])
    values += 2 * values.std() * np.cos(2 * np.pi * 12.5 / rate * np.arange(24_000))[:, None] * np.array([1.0, -0.5, 0.7])
    record = Record(values, rate, ["1:+x", "2:+x", "3:+x"], "acceleration")
    return operational_page(study_operational(record), names=["work.csv"])


@case
def drift() -> Report:
    from toolpoint.pages.measured.drift import drift_page
    from toolpoint.studies import study_drift

    slides = example("tell_which_joint_loosened")
    first = slides.two_slides()
    later = [slides.measured_modes(first.with_values({"joints.upper.stiffness.x": k})) for k in (2e7, 1.7e7)]
    return drift_page(study_drift(slides.measured_modes(first), later, first, names=["spring", "autumn"]), first.name)


@case
def listening() -> Report:
    from toolpoint.pages.cuts.listening import listening_page
    from toolpoint.studies import listen
    from toolpoint.vibration import Record

    rng, rate = np.random.default_rng(0), 16_000
    time = np.arange(2 * rate) / rate
    sound = sum(np.cos(2 * np.pi * 133.4 * k * time + k) * (1.0 if k % 4 == 0 else 0.2) / (1 + k / 4) for k in range(1, 33))
    sound += sum(0.4 ** abs(k) * np.cos(2 * np.pi * (1417.0 + 533.6 * k) * time + k) for k in range(-2, 3))
    sound += 0.3 * sound.std() * rng.standard_normal(time.size)
    return listening_page(listen(Record(sound[:, None], rate, ["1:+x"], "sound", ("full scale",)), 4, 8000.0))


@case
def traverse() -> Report:
    from toolpoint.pages.measured.traverse import traverse_page
    from toolpoint.studies.moving.mode_tracks import ModeTrack
    from toolpoint.studies.moving.moving_joints import JointChange, PredictedTracks
    from toolpoint.studies.moving.pole_course import fit_course
    from toolpoint.studies.moving.traverse_study import TraverseStudy

    values, rng = np.linspace(-0.2, 0.2, 8), np.random.default_rng(0)
    frequency = [21.0 + 0.0 * values, 38.0 - 4.0 * values]
    tracks = tuple(ModeTrack(np.arange(8), f + 0.03 * rng.standard_normal(8), np.full(8, 0.02), np.full((8, 2), [0.03, 0.001]),
                             np.ones((2, 8))) for f in frequency)
    courses = tuple(fit_course(values, track.frequency, track.deviations[:, 0]) for track in tracks)
    damping = tuple(fit_course(values, track.damping_ratio, track.deviations[:, 1]) for track in tracks)
    predicted = PredictedTracks(("joint drive_y",), np.array([frequency[0], frequency[0] + 17.0]), np.zeros((1, 2, 8)))
    joints = (JointChange("joint drive_y", 0.97, 0.83, (0.8, 0.86), 1.1),)
    return traverse_page(TraverseStudy("Y, m", values, tracks, courses, damping, predicted, joints, 0.03, (), ()), "travel.csv")


@case
def driven_axis() -> Report:
    from toolpoint.pages.measured.driven_axis import driven_axis_page
    from toolpoint.signals import DrivenAxisTest
    from toolpoint.studies import study_driven_axis
    from toolpoint.vibration import Frf, Modes, frequency_response

    tests = {}
    for name, ratio in (("standing", 0.02), ("moving", 0.05)):
        modes = Modes([21.0, 42.0], [ratio, 0.02], [[0.05, 0.07]], ["table:+y"])
        exact = frequency_response.modal(modes, np.arange(5.0, 60.0, 0.1), inputs=["table:+y"]).converted_to("mobility")
        noise = 0.01 * np.abs(exact.values).max() * np.random.default_rng(0).standard_normal(exact.values.shape)
        frf = Frf(exact.frequency, exact.values + noise, exact.outputs, exact.inputs, "mobility",
                  variance=np.full(exact.values.shape, noise.std()**2))
        tests[name] = DrivenAxisTest(frf, np.ones(exact.frequency.size), frf.values[:, :, 0])
    return driven_axis_page(study_driven_axis(tests), "standing.csv")


@case
def planned_test() -> Report:
    from toolpoint.pages.testing.test_plan import plan_page
    from toolpoint.studies import plan_test

    return plan_page(plan_test(machine(), 6, rng=np.random.default_rng(1)))


@case
def project() -> Report:
    from toolpoint.pages.project.project import project_page
    from toolpoint.project import KeptState, ProjectResults, StateDifference

    goal = {"cut": "face", "speed_rpm": 1200.0, "depth_m": 2e-3, "limit_m": 2.6e-3, "interval_m": [1.9e-3, None],
            "depth_max_m": 9e-3, "stable_probability": 0.93, "chatter_frequency_hz": 68.2, "shares": {
                "cutting coefficients": 0.7, "joint bed_column": 0.3}}
    doubt = {"step": "responses/structure", "what": "18:+x", "why": "is turned", "remedy": "turn its sensitivity",
             "figure": None, "grave": False}
    change = {"name": "bolt the column", "joint": "bed_column", "stiffness_share": 0.3, "gain": 0.06,
              "gain_interval": [0.05, 0.07], "cost": 2.0}
    steps = [{"step": f"limits/{name}", "state": state, "words": "2 mm at 1200 rev/min is stable with 93 %",
              "doubts": ["18:+x: is turned"], "files": [f"results/limits/{name}/limits.json"],
              "command": "toolpoint report machine.yaml"}
             for name, state in (("rough", "done"), ("side", "stopped"), ("old", "failed"), ("mine", "by hand"))]
    results = ProjectResults({
        "project": "Demo mill", "answers": ["rough: not certain; 2 mm is stable with 93 %.", "side: no answer."],
        "goals": {"rough": goal, "free": {**goal, "limit_m": None, "interval_m": [None, None], "chatter_frequency_hz": None}},
        "contours": {"circle": {"deviation_m": 8e-6, "goal_m": 1e-5, "met": True},  # as an older version wrote it
                     "missed": {"deviation_m": 4e-5, "goal_m": 1e-5, "met": False, "cause": "its largest part is a peak",
                                "remedies": [{"words": "larger gains: radial deviation 9 µm, within the goal", "met": True,
                                              "kind": "gains", "deviation_m": 9e-6}]}},
        "changes": [change], "next": {"answer": "compliance", "today": 0.05, "random": 0.04, "candidates": [
            {"test": "shapes at 34:+x", "after": 0.028}]}, "next_steps": ["try a cut of 2.4 mm"], "steps": steps,
        "doubts": [doubt], "assumptions": ["Coefficients are lognormal."], "methods": "Responses were estimated."})
    older, newer = (KeptState(key, f"2026-05-0{key}T10:30:00", {
        "goals": {"rough": {**goal, "limit_m": limit, "interval_m": [0.8 * limit, end]}}, "sources": {f"{key}.csv": key},
        "modes": {"structure": {"frequency_hz": [frequency], "damping_ratio": [0.02]}}, "springs": {
            "joints.bed_column.stiffness.rx": {"value": spring, "deviation": 0.02 * spring}}, "options": {
                "limits/rough": {"cut": {"values": {"tangential": coefficient}}, "cut_name": "face"}}, "version": "0.2"})
        for key, limit, end, frequency, spring, coefficient in (("4", 2.2e-3, 2.9e-3, 66.0, 1.1e9, 8e8),
                                                                ("5", 2.6e-3, None, 68.2, 1.2e9, 9e8)))
    return project_page(results.beside(StateDifference(older, newer)))


@case
def finite_elements() -> Report:
    from test_finite_element_study import small_mill

    from toolpoint.pages.machines.finite_elements import finite_element_page
    from toolpoint.studies.finite_elements.machine_study import study_finite_elements

    mill = small_mill()
    return finite_element_page(study_finite_elements(mill, {"denser low part": mill.scaled(density={"column.low": 1.1})},
                                                     tested=mill.scaled(joints={"flange": 0.8}), finer_machine=mill,
                                                     damper_mass=3.0))


@case
def video() -> Report:
    import video_scenes as scenes

    from toolpoint.pages.video import video_page
    from toolpoint.studies import study_video
    from toolpoint.vision.clip import Clip, FrameArray

    rng = np.random.default_rng(41)
    scene = scenes.c_frame(rng)
    clip = Clip(FrameArray(np.concatenate(list(scenes.filmed(scene, rng).chunks()))), scenes.RATE)
    return video_page([study_video(clip, points=80, bodies=scenes.regions(scene))])
