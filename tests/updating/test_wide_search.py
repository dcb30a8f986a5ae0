"""The wide search: joints far softer than their file."""

from pathlib import Path

import numpy as np
import pytest

import toolpoint
from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.studies.measured.machine_update import update
from toolpoint.updating import Targets
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.fits.wide_search import DAMPING_PRIOR_SD, STIFFNESS_PRIOR_SD, name_undetermined, search_widely
from toolpoint.vibration import Modes, eigen

MILL = Path(toolpoint.__file__).parent / "app/machines/small_mill.yaml"
TRUTH = {"joints.floor_base.stiffness.rx": 1.5e6, "joints.base_column.stiffness.rx": 5e5}
NAMES = ("joints.floor_base.stiffness.rx", "joints.base_column.stiffness.rx", "joints.column_housing.stiffness.rx")
LABELS = ("spindle_nose:+y", "spindle_nose:+z", "housing_top:+y", "column_top:+y", "column_top:+z", "base_left:+z",
          "base_right:+z", "table_left:+y")


def measured(machine, rng):
    """The lowest modes of a machine at its points, with noise of 0.1 % in frequency and 1 % in shape."""
    modes = eigen.solve_undamped(assemble(machine, None, LABELS))
    moving = [i for i in range(modes.count) if np.linalg.norm(modes.shape[:, i]) > 1e-6][:3]
    part = modes.selected(moving)
    level = np.sqrt((part.shape**2).mean(axis=0))
    shape = part.shape + 0.01 * level * rng.standard_normal(part.shape.shape)
    frequency = part.frequency * (1 + 1e-3 * rng.standard_normal(part.count))
    covariance = np.array([np.diag([(1e-3 * f) ** 2, 1e-8]) for f in frequency])
    return Modes(frequency, np.full(part.count, 0.005), shape, part.dofs, "unscaled", covariance=covariance,
                 shape_variance=np.tile((0.01 * level) ** 2, (len(shape), 1)))


@pytest.mark.slow
def test_a_joint_forty_times_softer_than_its_file_is_found_within_its_interval():
    machine = read_machine(MILL)
    for seed in range(3):
        targets = Targets(measured(machine.with_values(TRUTH), np.random.default_rng(seed)), shape=True)
        near = update(machine, NAMES, targets=targets, restarts=0)
        result = search_widely(near.problem, near.fit)
        # The prior of a number forty times off costs (ln 40 / 3)^2.
        assert result.chi_square <= near.fit.chi_square + 2 * (np.log(40) / STIFFNESS_PRIOR_SD) ** 2 and result.converged
        for name in NAMES:
            low, high = result.interval(name, 3.3)
            assert low < TRUTH.get(name, machine.value(name)) < high


@pytest.mark.parametrize("factor", [5.0, 0.2])
def test_a_damper_that_the_data_do_not_determine_widens_the_one_that_makes_up_for_it(factor):
    """One mode has one damping: the data determine the sum of two dampers, and one of them is five times off its file."""
    names = ("joints.floor_base.damping.ry", "joints.base_column.damping.ry")
    machine = read_machine(MILL)
    soft = machine.with_values({"joints.floor_base.stiffness.ry": 1.2e6, "joints.base_column.stiffness.ry": 1.2e6,
                                names[0]: 500.0})
    truth = soft.with_values({names[1]: factor * machine.value(names[1])})
    modes = eigen.solve_damped(assemble(truth, None, ("spindle_nose:+x", "spindle_nose:+z", "column_top:+x", "column_top:+z")))
    sees = np.flatnonzero(np.linalg.norm(modes.shape, axis=0) > 1e-6)[:1]
    first = modes.selected(sees.tolist())
    covariance = np.array([np.diag([(1e-3 * first.frequency[0]) ** 2, (0.01 * first.damping_ratio[0]) ** 2])])
    targets = Targets(Modes(first.frequency, first.damping_ratio, first.shape.real, first.dofs, "unscaled",
                            covariance=covariance), damping=True, shape=False)
    near = update(soft, names, targets=targets, restarts=0)
    low, high = near.fit.interval(near.fit.free[0])
    assert len(near.fit.free) == 1 and not (low < truth.value(near.fit.free[0]) < high)
    result = search_widely(near.problem, near.fit)
    for name in names:
        low, high = result.interval(name)
        assert low < truth.value(name) < high


def test_a_number_that_no_data_move_keeps_its_prior_and_is_named():
    machine = read_machine(MILL)
    names = ("joints.floor_base.stiffness.rx", "joints.base_column.stiffness.rx", "joints.base_cross_slide.damping.x")
    targets = Targets(measured(machine.with_values(TRUTH), np.random.default_rng(5)), shape=True)
    near = update(machine, names, targets=targets, restarts=0)
    result = search_widely(near.problem, near.fit, starts=4)
    assert name_undetermined(result) == ("joints.base_cross_slide.damping.x",)
    low, high = result.interval(names[2])
    assert high / machine.value(names[2]) == pytest.approx(np.exp(1.959964 * DAMPING_PRIOR_SD), rel=0.05)
    assert low < machine.value(names[2])


def test_beyond_the_interval_of_a_number_that_others_make_up_for_the_evidence_is_against_it():
    """Three springs in a row and one mode: the softest is determined, the others may be as stiff as they like."""
    names = tuple(f"joints.{joint}.stiffness.ry" for joint in ("floor_base", "base_column", "column_housing"))
    machine = read_machine(MILL)
    labels = ("spindle_nose:+x", "spindle_nose:+z", "column_top:+x", "column_top:+z", "base_left:+z", "base_right:+z")
    modes = eigen.solve_undamped(assemble(machine.with_values({names[0]: 1.2e6}), None, labels))
    first = modes.selected(np.flatnonzero(np.linalg.norm(modes.shape, axis=0) > 1e-6)[:1].tolist())
    variance = np.tile((0.03 * np.sqrt((first.shape**2).mean(axis=0))) ** 2, (len(labels), 1))
    covariance = np.array([np.diag([(1e-4 * first.frequency[0]) ** 2, 1e-8])])
    targets = Targets(Modes(first.frequency, [0.005], first.shape, first.dofs, "unscaled", covariance=covariance,
                            shape_variance=variance), shape=True)
    near = update(machine, names, targets=targets, restarts=0)
    result = search_widely(near.problem, near.fit, starts=2)
    assert "column_housing" in name_undetermined(result)[-1]
    assert names[0] not in name_undetermined(result)
    for sign in (-1, 1):
        start = result.x + sign * 2 * np.sqrt(result.covariance[0, 0]) * (np.arange(3) == 0)
        moved = fit(near.problem, LeastSquares(), start=start, free=names[1:])
        assert moved.chi_square - result.chi_square > 3.84
