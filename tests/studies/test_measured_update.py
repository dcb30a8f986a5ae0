"""What a machine is updated to by responses where nothing is named: stiffnesses, and damping, which nobody knows before."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import io
from toolpoint.machine import assemble, build
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.studies import Measurement, update_machine
from toolpoint.studies.measured.machine_update import problem
from toolpoint.studies.measured.measured_update import SCALE_REMARK, default_paths
from toolpoint.updating import Targets
from toolpoint.vibration import eigen, frequency_response

LINES = np.arange(2.0, 60.0, 0.1)


def slides(loss=(0.03, 0.06), stiffness=(4e5, 3e5)):
    """Two slides in a row, each on a spring with a loss factor."""
    body = BodyDescription(mass=10.0, inertia=InertiaDescription(1, 1, 1))
    joints = {"bed": JointDescription("ground", "saddle", stiffness={"x": stiffness[0]}, loss_factor=loss[0]),
              "top": JointDescription("saddle", "table", stiffness={"x": stiffness[1]}, loss_factor=loss[1])}
    points = {"1": PointDescription("saddle"), "2": PointDescription("table")}
    return build(MachineDescription("slides", {"saddle": body, "table": body}, joints, {}, points))


def measured(machine, rng, noise=0.02):
    """Accelerances of both slides by a force on the first."""
    system = assemble(machine, outputs=["1:+x", "2:+x"], inputs=["1:+x"])
    exact = frequency_response.direct(system, LINES, "accelerance")
    size = noise * np.sqrt((np.abs(exact.values) ** 2).mean() / 2)
    return replace(exact, values=exact.values + size * (rng.normal(size=exact.values.shape)
                                                        + 1j * rng.normal(size=exact.values.shape)))


@pytest.mark.slow
@pytest.mark.parametrize("loss", [pytest.param((0.04, 0.04), marks=pytest.mark.slow),
                                  pytest.param((0.0, 0.0), marks=pytest.mark.slow), (0.1, 0.01)])
def test_damping_is_updated_with_the_stiffness_whatever_was_guessed(loss):
    truth, frf = slides(), measured(slides(), np.random.default_rng(0))
    result = update_machine(slides(loss, (5e5, 2.2e5)), [Measurement(frf=frf)])
    assert result.update.fit.status == "converged" and result.doubts == ()
    for path in ("joints.bed.stiffness.x", "joints.top.stiffness.x", "joints.bed.loss_factor", "joints.top.loss_factor"):
        assert result.machine.value(path) == pytest.approx(truth.value(path), rel=0.02)
    assert result.update.after.frac is not None and result.update.after.frac.min() > 0.995


@pytest.mark.slow  # a model that cannot fit is looked at from many starts
def test_what_the_model_misses_beyond_noise_is_said_first():
    frf = measured(slides(), np.random.default_rng(1))
    right = update_machine(slides((0.04, 0.04), (5e5, 2.2e5)), [Measurement(frf=frf)])
    heavy = build(replace(slides().description, bodies={
        **slides().description.bodies, "table": replace(slides().description.bodies["table"], mass=11.0)}))
    wrong = update_machine(heavy, [Measurement(frf=frf)])
    assert right.doubts == ()
    first = wrong.table().splitlines()[0]
    assert first.startswith("doubt: model: it misses") and "masses" in first and "times their noise" in first


def with_one_ratio(ratio, stiffness=(4e5, 3e5)):
    """The slides, damped by one ratio for all modes."""
    return build(replace(slides((0.0, 0.0), stiffness).description, damping_ratio=ratio))


@pytest.mark.parametrize("guess", [0.06, 0.004, 0.0])
def test_one_damping_ratio_for_all_modes_is_updated_with_the_stiffness(guess):
    truth = with_one_ratio(0.02)
    result = update_machine(with_one_ratio(guess, (5e5, 2.2e5)), [Measurement(frf=measured(truth, np.random.default_rng(0)))])
    assert result.update.fit.status == "converged" and result.doubts == ()
    for path in ("joints.bed.stiffness.x", "joints.top.stiffness.x", "damping_ratio"):
        assert result.machine.value(path) == pytest.approx(truth.value(path), rel=0.02)


def test_one_damping_ratio_that_cannot_stand_for_all_joints_is_named_with_its_remedy():
    frf = measured(slides((0.01, 0.09)), np.random.default_rng(1))
    result = update_machine(with_one_ratio(0.02, (4.1e5, 2.9e5)), [Measurement(frf=frf)])
    assert any(doubt.startswith("damping_ratio: one ratio, ") and "loss_factor" in doubt for doubt in result.doubts)


def test_slopes_along_one_damping_ratio_are_those_of_central_differences():
    machine, paths = with_one_ratio(0.03), ["joints.bed.stiffness.x", "damping_ratio"]
    modes = replace(eigen.solve_undamped(assemble(machine, outputs=["1:+x", "2:+x"])), damping_ratio=np.full(2, 0.03))
    targets = Targets(modes, measured(machine, np.random.default_rng(0)), damping=True)
    model = problem(machine, paths, targets).models[0]
    values, step = {path: machine.value(path) for path in paths}, 1e-5
    exact = model(values, paths)
    ahead, back = (model(values | {"damping_ratio": 0.03 + change}) for change in (step, -step))
    assert exact.frf_slopes is not None and exact.damping_slopes is not None and exact.frequency_slopes is not None
    np.testing.assert_allclose(exact.frf_slopes[1], (ahead.frf.values - back.frf.values) / (2 * step), rtol=1e-5,
                               atol=1e-6 * np.abs(exact.frf_slopes[1]).max())
    np.testing.assert_allclose(exact.damping_slopes[1], 1.0)
    np.testing.assert_allclose(exact.frequency_slopes[1], 0.0)


def test_modes_alone_tell_no_mass_and_it_is_said():
    modes = eigen.solve_undamped(assemble(slides(), outputs=["1:+x", "2:+x"]))
    alone = update_machine(slides(stiffness=(5e5, 2.2e5)), [Measurement(modes)])
    assert SCALE_REMARK in alone.notes
    both = update_machine(slides(stiffness=(5e5, 2.2e5)), [Measurement(modes, measured(slides(), np.random.default_rng(2)))])
    assert SCALE_REMARK not in both.notes


def test_modes_alone_move_stiffnesses_and_responses_the_damping_too():
    machine = io.read_machine("src/toolpoint/app/machines/small_mill.yaml")
    stiff = default_paths(machine, responses=False)
    assert stiff and all(".stiffness." in path for path in stiff)
    more = default_paths(machine, responses=True)[len(stiff):]
    assert "joints.floor_base.damping.rx" in more and "joints.floor_base.loss_factor" in more
    assert all(machine.value(path) > 0 for path in more if ".damping." in path)


def test_the_slope_at_no_loss_is_that_of_some():
    none, some = (matrix_derivatives(slides((loss, loss)), ["joints.top.loss_factor"], None) for loss in (0.0, 0.05))
    np.testing.assert_allclose(none.structural_damping, some.structural_damping, rtol=1e-9, atol=1e-6)
