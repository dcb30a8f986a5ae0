"""Coefficients from every sample of force records: the intervals hold what the forces were made with, edges straight too."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.force.calibration import Calibration, average_force, invert_information
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.cutting.force.turned_fit import fit_turns
from toolpoint.cutting.force.turned_forces import turn_forces
from toolpoint.studies.cuts.forces.calibration import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

FEEDS = (0.05e-3, 0.1e-3)
DOFS = tuple(Dof("tool", f"+{way}") for way in "xyz")
TRUTH = {"kt": 800e6, "kn": 250e6, "ka": 0.0, "edge_t": 20e3, "edge_n": 12e3, "edge_a": 0.0}
SLOT = {"diameter": 0.01, "teeth": 2, "immersion": 1, "direction": "slot"}


def slot(feed: float, rng: np.random.Generator, *, rate: float, begin: float, turns: int = 10) -> Record:
    """Forces of a slot with two straight teeth at 3000 rev/min, 2 mm deep, written out by hand; noise of 0.3 N."""
    turn = begin + 2 * np.pi * 50 * np.arange(int(turns * rate / 50)) / rate
    force = 0.3 * rng.standard_normal((turn.size, 3))
    for tooth in range(2):
        phi = (turn + np.pi * tooth) % (2 * np.pi)
        tangential, normal = (2e-3 * (TRUTH[k] * feed * np.sin(phi) + TRUTH[edge]) * (phi < np.pi)
                              for k, edge in (("kt", "edge_t"), ("kn", "edge_n")))
        force[:, 0] -= tangential * np.cos(phi) + normal * np.sin(phi)
        force[:, 1] += tangential * np.sin(phi) - normal * np.cos(phi)
    return Record(force, rate, DOFS, ("force",) * 3)


@pytest.mark.parametrize(("rate", "begin"), [(10000.0, 0.0), (10000.0, 0.4), (9871.3, 0.0), (7321.7, 2.2)])
@pytest.mark.default_cases(2)
def test_straight_teeth_that_enter_in_jumps(rate: float, begin: float) -> None:
    """Samples on the very edge, on whole fractions of a revolution or not: K_n was 5 off with an interval of 0.7 N/mm^2."""
    rng, inside = np.random.default_rng(4), []
    for _ in range(3):
        records = [(str(feed), slot(feed, rng, rate=rate, begin=begin)) for feed in FEEDS]
        result = calibrate(records, CuttingTest(SLOT, 3000.0, 2e-3, FEEDS, runout=False))
        assert result.fit.status == "converged" and result.average is not None
        for fit in (result.fit, result.average):
            half = (fit.interval[:, 1] - fit.interval[:, 0]) / 2
            assert 0 < half[0] < 0.015 * TRUTH["kt"]
            every = zip(fit.names, fit.values, half, strict=True)
            inside += [abs(value - TRUTH[name]) <= width for name, value, width in every if name in TRUTH]
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
def test_a_sample_right_on_an_edge_is_beside_a_jump_too(seed: int) -> None:
    """200 samples a revolution, the first on the edge: the fit went to and fro about it and was called a misfit."""
    rng = np.random.default_rng(seed)
    records = [(str(feed), slot(feed, rng, rate=10000.0, begin=0.0)) for feed in FEEDS]
    result = calibrate(records, CuttingTest(SLOT, 3000.0, 2e-3, FEEDS))
    assert not any("residual" in doubt for doubt in result.doubts)


def test_teeth_named_wrongly_at_the_start_are_named_anew() -> None:
    """Teeth of a regular tool differ by run-out alone; a record that starts a pitch off ends there no more."""
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    tool = Tool(0.016, 3, runout=8e-6, runout_angle=1.0)
    problem = MillingProblem(tool, Engagement.up(0.6), CuttingCoefficients(**TRUTH), rigid)
    rng, records = np.random.default_rng(2), []
    for k, feed in enumerate(FEEDS):
        turn = 0.3 + k + 2 * np.pi * 50 / 7321.7 * np.arange(1500)
        force = rigid_forces(problem.changed(feed_per_tooth=feed), 2e-3, turn, slices=40).force
        records.append(turn_forces(Record(force + rng.standard_normal(force.shape), 7321.7, DOFS, ("force",) * 3), 3000.0))
    names = (*TRUTH, "runout", "runout_angle", "phase_1", "phase_2")
    start = np.array([*TRUTH.values(), 8e-6, 1.0, 0.3, 1.3 + 2 * np.pi / 3])
    fit, misfit = fit_turns(problem, np.array(FEEDS), records, depth=2e-3,
                            start=Calibration(names, start, np.eye(start.size), 1, 0.0), slices=40)
    turned = np.diff(fit.values[-2:])[0] - 1.0
    assert misfit < 1.1 and turned == pytest.approx(2 * np.pi * round(turned / (2 * np.pi)), abs=0.01)


def test_run_out_across_two_teeth_is_not_known() -> None:
    rng = np.random.default_rng(1)
    records = [(str(feed), slot(feed, rng, rate=9871.3, begin=0.3)) for feed in FEEDS]
    fit = calibrate(records, CuttingTest(SLOT, 3000.0, 2e-3, FEEDS)).fit
    low, high = fit.interval[fit.names.index("runout")]
    assert "run-out" in fit.status and low == 0 and high > 50e-6  # an offset is not below zero
    assert "not known" in calibrate(records, CuttingTest(SLOT, 3000.0, 2e-3, FEEDS)).table()


def test_as_many_mean_forces_as_coefficients_give_no_interval() -> None:
    """Two feeds leave no residual: an interval of zero was said."""
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    problem = MillingProblem(Tool(0.01, 2), Engagement.slot(), CuttingCoefficients(1e9, 3e8), rigid)
    means = np.array([[-10.0, 60, 4], [-18, 100, 6]])
    fit = average_force(problem, np.array(FEEDS), means, depth=2e-3)
    assert np.isinf(fit.interval).all() and "no interval" in fit.status
    known = average_force(problem, np.array(FEEDS), means, depth=2e-3, errors=np.full((2, 3), 0.1), freedom=18)
    assert known.values == pytest.approx(fit.values) and known.status == "converged"
    # The forces are linear in the feed: the slope of K_t in a slot is 1 N / (c 25 um), c = a N / 4.
    deviation = np.sqrt(2) * 0.1 / (5e-5 * 2e-3 * 2 / 4)
    assert np.sqrt(known.covariance[0, 0]) == pytest.approx(deviation, rel=1e-9)


def test_a_direction_that_nothing_tells_keeps_its_variance() -> None:
    weak = invert_information(np.array([[1.0, 1.0], [1.0, 1.0 + 1e-14]]))
    assert weak[0, 0] > 1e12 and invert_information(np.diag([4.0, 25.0])) == pytest.approx(np.diag([0.25, 0.04]))


def test_every_sample_keeps_its_angle() -> None:
    """Means over the bins of what is linear in the angle are that at the mean angle; mean turns know parts of samples."""
    rate, per = 9871.3, 9871.3 / 50
    turn = np.arange(2000) / per
    samples = np.stack([turn % 1, np.full(turn.size, 3.0)], axis=1)
    turned = turn_forces(Record(samples, rate, DOFS[:2], ("force",) * 2), 3000.0)
    assert turned.force[:, 0] == pytest.approx(turned.angle / (2 * np.pi), abs=1e-9)
    assert turned.turns == 10 and turned.count.sum() == turned.samples.shape[0]
    mean, error = turned.mean_turn()
    assert mean == pytest.approx([0.5, 3.0], abs=5e-3) and error[1] < 1e-12


@pytest.mark.slow
def test_intervals_of_random_records_hold() -> None:
    from benchmarks.cutting import calibration_records as random_records

    rng, inside = np.random.default_rng(3), []
    for k in range(6):
        records, test, truth = random_records.random_cut(rng, bool(k % 2))
        result = calibrate(records, test)
        assert result.average is not None
        inside += [*random_records.held(result.fit, truth), *random_records.held(result.average, truth)]
    assert np.mean(inside) > 0.9
