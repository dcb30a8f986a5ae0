"""Updates by modes follow shapes point by point: a worn joint is found, a mode that the machine does not have doubted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_machines import random_machine

from toolpoint.machine import assemble
from toolpoint.machine.description import parameters
from toolpoint.studies import Measurement, update_machine
from toolpoint.vibration import eigen

SHAPE_NOISE = 0.02  # of the root mean square of each shape


@pytest.mark.parametrize("seed", [  # by one MAC a mode these ended 1.8 to 6.7 times off
    pytest.param(0, marks=pytest.mark.slow), 2, 3])
@pytest.mark.default_cases(1)
def test_a_worn_joint_is_found_by_modes_alone(seed):
    rng = np.random.default_rng(seed)
    truth = random_machine(rng)
    paths = [path for path in parameters(truth.description) if ".stiffness." in path]
    joint = str(rng.choice(list(truth.description.joints)))
    model = {path: truth.value(path) * np.exp(0.3 * rng.normal()) * (10 if path.startswith(f"joints.{joint}.") else 1)
             for path in paths}
    modes = eigen.solve_undamped(assemble(truth))
    modes = modes.selected(np.flatnonzero(modes.frequency > 1e-3)[:len(paths)].tolist()).with_damping(0.01)
    deviation = SHAPE_NOISE * np.sqrt((np.abs(modes.shape) ** 2).mean(axis=0)) * np.ones(modes.shape.shape)
    measured = replace(modes, shape=modes.shape + deviation * rng.normal(size=deviation.shape), shape_variance=deviation**2)
    fit = update_machine(truth.with_values(model), [Measurement(measured)], ()).update.fit
    assert max(abs(np.log(fit.values[path] / truth.value(path))) for path in paths) < 0.03


@pytest.mark.parametrize("kind", ["foreign", "noisy", pytest.param("exact", marks=pytest.mark.slow)])
def test_a_mode_that_the_updated_machine_does_not_have_is_doubted_and_one_in_noise_is_not(kind):
    rng = np.random.default_rng(0)
    truth = random_machine(rng)
    modes = eigen.solve_undamped(assemble(truth))
    modes = modes.selected(np.flatnonzero(modes.frequency > 1e-3)[:4].tolist()).with_damping(0.01)
    size = np.sqrt((np.abs(modes.shape) ** 2).mean(axis=0)) * np.ones(modes.shape.shape)
    foreign, noise = modes.shape.copy(), np.full(size.shape, 0.01) * size
    foreign[:, 1] = size[:, 1] * rng.normal(size=len(size))
    shape, deviation, count = {"foreign": (foreign, noise, 1), "exact": (modes.shape, noise, 0),
                               "noisy": (modes.shape + 0.4 * size * rng.normal(size=size.shape), 0.4 * size, 0)}[kind]
    doubts = update_machine(truth, [Measurement(replace(modes, shape=shape, shape_variance=deviation**2))], ()).doubts
    assert sum(f"mode at {modes.frequency[1]:.4g} Hz: its shape is not" in doubt for doubt in doubts) == count
