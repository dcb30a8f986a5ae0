"""Drives described in Python: the same servo as from a file, every fault at once, limits stated once."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import get_type_hints

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint._quantity import Quantity
from toolpoint.drives import DriveDescription, build_servo
from toolpoint.drives import description as d
from toolpoint.io.yaml import drive_file
from toolpoint.studies import run_drives

AXIS = d.DriveAxisDescription(
    mechanics=d.MechanicsDescription("two-mass", lead=0.01, inertia=0.008, table_mass=300.0, stiffness=1.2e8, damping=2e4),
    guide_friction=d.GuideFrictionDescription("coulomb", coulomb=100.0),
    position=d.PositionDescription(40.0, velocity_feedforward=1.0),
    velocity=d.VelocityDescription(1.5, integral_time=0.02, filters=(d.TorqueFilterDescription("notch", frequency=300.0),)))
DRIVES = DriveDescription("two axes", {"X": AXIS, "Y": AXIS}, limits=d.LimitsDescription(0.5, 3.0, 100.0))
TEXT = """toolpoint: 1
name: two axes
axes:
  X: &axis
    mechanics: {kind: two-mass, lead: 10 mm, inertia: 80 kg*cm^2, table_mass: 0.3 t, stiffness: 120 N/um, damping: 20 kN*s/m}
    guide_friction: {law: coulomb, coulomb: 0.1 kN}
    position: {gain: 40 1/s, velocity_feedforward: 1}
    velocity: {gain: 1.5 N*m*s/rad, integral_time: 20 ms, filters: [{kind: notch, frequency: 0.3 kHz}]}
  Y: *axis
limits: {speed: 0.5, acceleration: 3, jerk: 100}
"""


def test_a_file_is_one_to_one_with_its_description(tmp_path):
    (tmp_path / "drives.yaml").write_text(TEXT)
    described = drive_file.read(tmp_path / "drives.yaml")
    mechanics, expected = described.axes["X"].mechanics, AXIS.mechanics
    for part in fields(expected):
        value = getattr(expected, part.name)
        assert getattr(mechanics, part.name) == (pytest.approx(value) if isinstance(value, float) else value)
    np.testing.assert_allclose(build_servo(described).plant.a, build_servo(DRIVES).plant.a, rtol=1e-12)


@pytest.mark.slow
def test_python_alone_runs_an_experiment():
    """Full velocity feed-forward: the following error of 40 mm/s does not stay at v/K_v = 1 mm."""
    result = run_drives(DRIVES, circle=(0.02, 0.04))
    assert result.status == "all steps converged"
    assert 0 < result.to_dict()["contour_error_m"]["tool"] < 1e-3
    assert "circular test" in result.table()


def test_all_faults_come_at_once():
    broken = replace(AXIS, velocity=replace(AXIS.velocity, delay=9), motor=d.MotorDescription(4, 0.5, 5e-3))
    with pytest.raises(ToolpointError) as caught:
        build_servo(replace(DRIVES, axes={"X": broken}, substeps=0))
    message = str(caught.value)
    for words in ("substeps: 0; must be at least 1", "axes.X.velocity.delay: 9 samples", "'current' is missing",
                  "axes.X.motor: give either flux or torque_constant"):
        assert words in message


def test_numbers_outside_their_limits_and_unknown_words_are_named():
    """The limits are those of the file, without a file."""
    filters = (d.TorqueFilterDescription("comb", frequency=300.0),)
    broken = replace(AXIS, mechanics=replace(AXIS.mechanics, stiffness=-1.0), velocity=replace(AXIS.velocity, filters=filters))
    with pytest.raises(ToolpointError) as caught:
        build_servo(replace(DRIVES, axes={"X": broken}, corner_tolerance=-1e-6))
    message = str(caught.value)
    for words in ("axes.X.mechanics.stiffness: -1 N/m; must be above 0 N/m", "corner_tolerance: -1e-06 m; must be at least 0 m",
                  "axes.X.velocity.filters.0.kind: 'comb'; must be one of notch, low-pass, low-pass-1"):
        assert words in message


def test_every_number_states_its_unit_and_limits():
    """All numbers but counts are quantities: what a file may hold stands beside the field."""
    parts = [part for part in vars(d).values() if isinstance(part, type) and is_dataclass(part) and part is not Quantity]
    assert len(parts) == 13
    for part in parts:
        for name, hint in get_type_hints(part, include_extras=True).items():
            if "float" in str(hint):
                assert "Quantity(name=" in str(hint), f"{part.__name__}.{name}"
