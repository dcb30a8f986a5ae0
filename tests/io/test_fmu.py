"""Functional mock-up units: the exported exact step against the package's own kernel, the standard's rules, wrong use."""

from __future__ import annotations

import ctypes
import shutil
import zipfile
from dataclasses import fields, replace

import numpy as np
import pytest
from fmu_library import Unit, followed

from drives import servo_cases as cases
from toolpoint import ToolpointError
from toolpoint.drives import (
    Contact,
    Controller,
    Coulomb,
    CurrentLoop,
    DriveAxis,
    Encoders,
    Inverter,
    MaxwellSlip,
    PositionLoop,
    ProgressiveSpring,
    Servo,
    Stribeck,
    TorqueMotor,
    TwoExponential,
    VelocityLoop,
    build_plant,
    four_dof_axis,
    low_pass,
    notch,
    rigid_axis,
    simulate,
    two_mass_axis,
)
from toolpoint.drives.axis.outputs import OUTPUTS
from toolpoint.drives.simulation.exact_step import step_matrices
from toolpoint.io import fmu

needs_compiler = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler installed")


def torque_servo(law=None, play=None, resolution=0.0):
    axis = DriveAxis("x axis", TorqueMotor(), two_mass_axis(0.008, 300.0, cases.RATIO, stiffness=1.2e8, damping=2e4,
                                                            motor_damping=0.01,
                                                       shaft_friction=law, play=play))
    control = Controller(PositionLoop(40.0, 1e-3, inertia_feedforward=0.008, friction_feedforward=0.3),
                         VelocityLoop(1.5, 0.02, 250e-6, filters=(notch(300.0, 0.3, 0.2), low_pass(1500.0)), delay=1,
                                      limit=25.0), cases.RATIO, encoders=Encoders(motor=resolution, scale=resolution * 1e-3))
    return Servo(build_plant([axis]), (control,))


def screw_servo():
    mechanics = four_dof_axis(0.004, 0.001, 8.0, table_mass=300.0, lead_ratio=cases.RATIO, coupling=(5000.0, 1.0),
                              bearing=(4e8, 2e4), nut=(5e8, 2e4), guide_damping=2e4, bearing_friction_arm=2e-4)
    return Servo(build_plant([DriveAxis("X", TorqueMotor(), mechanics)]),
                 (Controller(PositionLoop(30.0), VelocityLoop(1.5, 0.02), cases.RATIO),))


def damped_servo(sensor):
    """Active damping through a coarse scale, or by the tool."""
    base = torque_servo(Coulomb(0.3))
    loop = replace(base.controllers[0].velocity, damping_gain=0.4, damping_sensor=sensor)
    return Servo(base.plant, (replace(base.controllers[0], velocity=loop, encoders=Encoders(scale=1e-7)),))


def switched_servo():
    base = cases.benchmark_servo()
    return Servo(base.plant, tuple(replace(c, inverter=Inverter(320.0, "six-pulse", 2)) for c in base.controllers))


CASES = {
    "benchmark": (cases.benchmark_servo, 2), "six-pulse": (switched_servo, 4),
    "Coulomb": (lambda: torque_servo(Coulomb(0.5, 0.01)), 1), "Stribeck": (lambda: torque_servo(Stribeck(0.5, 0.7, 0.5)), 1),
    "two exponentials": (lambda: torque_servo(TwoExponential(0.5, 0.7, 0.5, 0.6, 0.01)), 2),
    "Maxwell slip": (lambda: torque_servo(MaxwellSlip((4e2, 1e2), (0.7, 0.3), Stribeck(0.5, 0.6, 0.5), 1e3)), 2),
    "backlash": (lambda: torque_servo(Coulomb(0.3), Contact.with_backlash(1.2e8, 1e-5)), 4),
    "progressive": (lambda: torque_servo(Coulomb(0.3), ProgressiveSpring(1.2e8, 5e-6)), 2),
    "preload": (lambda: torque_servo(Coulomb(0.3), Contact.preloaded(1.2e8, 500.0)), 2),
    "bearing under load": (screw_servo, 2),
    "active damping": (lambda: damped_servo("scale"), 1), "active damping at the tool": (lambda: damped_servo("tool"), 2),
    "encoders": (lambda: torque_servo(Stribeck(0.5, 0.7, 0.5), resolution=1e-4), 1),
}
# One of each kind of part is compiled by default; the others take a compiler's second each.
DEFAULT_CASES = ("benchmark", "Stribeck", "backlash", "active damping at the tool")


@needs_compiler
@pytest.mark.parametrize("name", [name if name in DEFAULT_CASES else pytest.param(name, marks=pytest.mark.slow)
                                  for name in CASES])
@pytest.mark.default_cases(2)
def test_unit_equals_the_kernel(tmp_path, name):
    """Two compilations of one algorithm: they differ by what rounding moves, and rounding is measured here.

    Drives of high gain carry one unit of the last place to 1e-9 of a current, others to 1e-12: matrices that differ by
    their rounding, through one compilation, show how far.
    """
    made, substeps = CASES[name]
    servo = made()
    axes = [a.name for a in servo.plant.axes]
    command = cases.benchmark_command(0.15, -0.3)
    if len(axes) == 1:
        command = replace(command, position=command.position[:, :1], velocity=command.velocity[:, :1],
                          acceleration=command.acceleration[:, :1])
    fmu.write(servo, tmp_path / "servo.fmu", name, substeps=substeps)
    followed_outputs = followed(Unit(tmp_path / "servo.fmu", tmp_path / "unit"), command, axes, OUTPUTS)
    matrices = step_matrices(servo.plant, servo.controllers[0].sample_times.current / substeps)
    options = {"substeps": substeps, "record_interval": servo.counts[2] * substeps}
    expected = simulate(servo, command, matrices=matrices, **options).outputs
    size = np.abs(expected).max(axis=(0, 1))
    assert size[0] > 0.1
    rounding = np.max([np.abs(simulate(servo, command, matrices=_rounded(matrices, seed), **options).outputs - expected)
                       .max(axis=(0, 1)) for seed in range(3)], axis=0)
    assert (rounding <= 1e-8 * size).all()
    assert (np.abs(followed_outputs - expected).max(axis=(0, 1)) <= 10 * rounding + 1e-12 * size).all()


def _rounded(matrices, seed):
    random = np.random.default_rng(seed)
    last_place = np.finfo(float).eps
    return replace(matrices, **{f.name: getattr(matrices, f.name) * (1 + last_place * random.standard_normal(
        getattr(matrices, f.name).shape)) for f in fields(matrices) if f.name != "step"})


@needs_compiler
def test_load_parameters_and_states(tmp_path):
    servo = torque_servo(Stribeck(0.5, 0.7, 0.5))
    fmu.write(servo, tmp_path / "servo.fmu")
    unit = Unit(tmp_path / "servo.fmu", tmp_path / "unit")
    state = ctypes.c_void_p()
    assert unit.call("fmi2GetFMUstate", ctypes.byref(state)) == 0
    ends = []
    for gain in (40.0, 80.0, 40.0):
        unit.put({"x axis.position_gain": gain, "x axis.load": 2000.0})
        for k in range(300):
            assert unit.step(k * 1e-3, 1e-3) == 0
        ends.append(unit.get(["x axis.scale", "x axis.table"]))
        assert unit.call("fmi2SetFMUstate", state) == 0
    np.testing.assert_array_equal(ends[0], ends[2])
    load = simulate(servo, _rest(0.3), load=np.array([[2000.0]]), record_interval=4)
    np.testing.assert_allclose(ends[0], [load.output(n, "x axis")[-1] for n in ("scale", "table")], rtol=1e-9)
    assert ends[1][0] != ends[0][0]


def _rest(duration):
    from toolpoint.drives.program.command import rest

    return rest(1, 1e-3, duration)


@needs_compiler
def test_wrong_steps_and_names_are_refused_with_words(tmp_path):
    fmu.write(torque_servo(), tmp_path / "servo.fmu")
    unit = Unit(tmp_path / "servo.fmu", tmp_path / "unit")
    assert unit.step(0.0, 1.1e-4) == 3 and "whole multiple" in unit.messages[-1]
    assert unit.step(0.5, 1e-3) == 3 and "end of the step before" in unit.messages[-1]
    assert unit.put({"x axis.scale": 1.0}) == 3 and "not an input" in unit.messages[-1]
    assert unit.put({"x axis.position": np.nan}) == 3


def test_description_follows_the_standard(tmp_path):
    """Sources only: every name once, outputs listed by their index, units declared, step named."""
    fmu.write(torque_servo(), tmp_path / "servo.fmu", "a servo <1>", binary=False)
    with zipfile.ZipFile(tmp_path / "servo.fmu") as file:
        names = file.namelist()
        from xml.etree import ElementTree

        root = ElementTree.fromstring(file.read("modelDescription.xml"))
    assert names == ["modelDescription.xml", "documentation/licenses/LICENSE.txt", "sources/servo.c", "sources/servo_step.h",
                     "sources/servo_records.h", "sources/servo_data.h"]
    variables = list(root.iter("ScalarVariable"))
    assert root.get("modelName") == "a servo <1>" and root.get("fmiVersion") == "2.0"
    assert len({v.get("name") for v in variables}) == len({v.get("valueReference") for v in variables}) == len(variables)
    outputs = [i + 1 for i, v in enumerate(variables) if v.get("causality") == "output"]
    for part in ("Outputs", "InitialUnknowns"):
        assert [int(u.get("index")) for u in root.find("ModelStructure").find(part)] == outputs
    known = {u.get("name") for u in root.iter("Unit")}
    assert {v.find("Real").get("unit") for v in variables} <= known
    assert float(root.find("DefaultExperiment").get("stepSize")) == 1e-3


@needs_compiler
def test_unit_passes_validation_and_simulates_in_fmpy(tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install fmpy)")
    from fmpy.validation import validate_fmu

    servo, command = cases.benchmark_servo(), cases.benchmark_command(0.1)
    path = str(tmp_path / "servo.fmu")
    fmu.write(servo, path, "benchmark")
    assert validate_fmu(path) == []
    names = [(a, q) for a in "xy" for q in ("position", "velocity", "acceleration")]
    signals = np.zeros(len(command.time), dtype=[("time", float), *((f"{a}.{q}", float) for a, q in names)])
    signals["time"] = command.time
    for a, q in names:
        signals[f"{a}.{q}"] = getattr(command, q)[:, "xy".index(a)]
    outputs = [f"{a}.{o}" for a in "xy" for o in OUTPUTS]
    found = fmpy.simulate_fmu(path, stop_time=0.1, step_size=1e-3, output_interval=1e-3, input=signals, output=outputs)
    expected = simulate(servo, command, record_interval=8).outputs.reshape(-1, 14)
    values = np.array([found[o] for o in outputs]).T
    size = np.abs(expected).max(axis=0) + 1e-12
    np.testing.assert_allclose(values / size, expected[:len(values)] / size, rtol=0, atol=1e-9)


def test_unstable_servo_is_refused(tmp_path):
    current = CurrentLoop.from_bandwidth(cases.MOTOR, 500.0)
    control = Controller(PositionLoop(5000.0, 1e-3), VelocityLoop(1.0, 0.02), 1e-3, current)
    servo = Servo(build_plant([DriveAxis("x", cases.MOTOR, rigid_axis(0.01, 1e-3))]), (control,))
    with pytest.raises(ToolpointError, match="position loop: unstable"):
        fmu.write(servo, tmp_path / "servo.fmu")
    assert not (tmp_path / "servo.fmu").exists()


def test_missing_compiler_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(ToolpointError, match="binary=False"):
        fmu.write(torque_servo(), tmp_path / "servo.fmu")
