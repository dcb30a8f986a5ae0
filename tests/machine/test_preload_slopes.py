"""Derivatives of a machine's matrices with gravity and loads: those of the assembled machine, along a tree and around loops."""

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from toolpoint.io import read_machine
from toolpoint.machine import assemble, build
from toolpoint.machine.derivatives import has_derivative, matrix_derivatives
from toolpoint.machine.description.machine import parameters
from toolpoint.studies import solve_modes, study_sensitivity

FILES = {"three_axis_vertical.yaml": {}, "three_rps_head.yaml": {"tilt": 0.2, "azimuth": 0.4}}


def _heavy_machine(name):
    """Return a shipped machine with a gravity large enough to be seen beside its springs."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / name) as path:
        machine = read_machine(path)
    return build(replace(machine.description, gravity=(0.0, 30.0, -9000.0)))


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_every_slope_is_the_difference_of_the_assembled_machine(name):
    machine, pose = _heavy_machine(name), FILES[name]
    description = machine.description
    paths = [path for path in parameters(description)
             if has_derivative(description, path) and machine.value(path) and not path.endswith(("loss_factor", "ratio"))
             and ".inertia" not in path]
    paths = paths[::max(len(paths) // 10, 1)]
    slopes = matrix_derivatives(machine, paths, pose)
    moved_by_preload = 0
    for k, path in enumerate(paths):
        value = machine.value(path)
        step = 1e-3 * abs(value)
        higher, lower = (assemble(machine.with_values({path: value + way * step}), pose) for way in (1, -1))
        difference = (higher.stiffness - lower.stiffness) / (2 * step)
        slope = slopes.term("stiffness")
        slope = np.zeros_like(difference) if np.isscalar(slope) else slope[k]
        rounding = 1e-11 * np.abs(higher.stiffness).max() / step
        assert np.abs(slope - difference).max() < 1e-5 * np.abs(difference).max() + rounding, path
        moved_by_preload += path.startswith("bodies") and np.abs(slope).max() > rounding
    assert moved_by_preload > 2  # masses move the stiffness through what they press with


def test_sensitivity_of_a_machine_with_gravity_is_that_of_its_frequencies():
    machine, path = _heavy_machine("three_axis_vertical.yaml"), "bodies.column.mass"
    study = study_sensitivity(machine, [path], modes=2)
    value = machine.value(path)
    higher, lower = (solve_modes(machine.with_values({path: value * factor}), None, 2).frequency for factor in (1.001, 0.999))
    by_difference = np.log(higher / lower) / np.log(1.001 / 0.999)
    assert study.frequency[0] == pytest.approx(by_difference, rel=1e-4)
