"""Verdicts of simulated cuts agree with the stability chart; a cut that decays to a lasting vibration chatters."""

import numpy as np
import pytest

from cutting.cutting_cases import benchmark, one_mode
from toolpoint.cutting import Engagement, stability
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, run_until_decided, simulate
from toolpoint.cutting.simulation.verdict import judge
from toolpoint.samples.hammer_test import template_machine
from toolpoint.studies import modal_dynamics, simulate_cut
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import machine_dynamics

CUT = {"diameter": 0.02, "teeth": 2, "tangential": 6e8, "normal": 2e8, "immersion": 0.05, "direction": "down"}


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.6, 0.8, 0.95, 0.97, 1.03, 1.2])
@pytest.mark.parametrize("speed", [5000.0, 7000.0, 10000.0])
def test_the_verdict_is_that_of_the_chart(speed, share):
    """Two independent routes, the simulation and the determinant, on both sides of the limit."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    limit = stability.chart(problem, [speed], depth_max=0.02).limit[0]
    result = simulate_cut(modal_dynamics(one_mode(2)), CUT, speed=speed, depth=share * limit)
    assert result.state == ("stable" if share < 1 else "chatter")
    assert result.linear.limit == pytest.approx(limit, rel=1e-4) and result.linear.stable == (share < 1)
    assert (result.linear.multiplier < 1) == (share < 1)
    if share < 1:  # the linear regime: the simulation grows as the multiplier says
        assert result.verdict.growth == pytest.approx(result.linear.multiplier, abs=max(2e-3, result.verdict.error))
    data = result.to_dict()
    assert data["multiplier"] == result.linear.multiplier and data["stability_limit_m"] == pytest.approx(limit, rel=1e-4)
    assert "largest multiplier" in result.table() and "stability limit" in result.table()


def test_decay_to_a_lasting_vibration_is_no_stable_cut():
    """At 1.03 of the limit the start-up decays over 60 revolutions, yet the cut chatters on."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    limit = stability.chart(problem, [10000.0], depth_max=0.02).limit[0]
    start = np.full(2, 2e-4 + 0j)
    short = simulate(problem, 10000.0, 1.03 * limit, revolutions=60, method=ExactSteps(400), start=start)
    assert short.growth(60) < 1 and short.verdict().state != "stable"
    long = simulate(problem, 10000.0, 1.03 * limit, revolutions=800, method=ExactSteps(400), start=start)
    assert long.verdict().state == "chatter"


def test_a_run_of_few_periods_is_undecided():
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    run = simulate(problem, 10000.0, 0.5e-3, revolutions=5)
    assert run.is_chattering() is None and np.isnan(run.verdict().growth)
    result = simulate_cut(modal_dynamics(one_mode(2)), CUT, speed=10000.0, depth=0.5e-3, revolutions=5)
    assert result.to_dict()["chatter"] is None and any("undecided" in note for note in result.notes)


@pytest.mark.parametrize(("decay", "state"), [(0.0, "chatter"), (0.02, "undecided")])
def test_chatter_that_wanders_is_told_from_a_slow_fall(decay, state):
    """Twenty periods a time constant of the slowest mode, over fifty of them; the level scatters by 30 %."""
    period = np.arange(2000)
    changes = 1e-5 * np.exp(0.3 * np.random.default_rng(2).standard_normal(period.size) - decay * period / 20)
    assert judge(changes, status="complete", thickest_chip=5e-5, time_constants=lambda count: count / 20).state == state


def test_a_small_level_that_the_steps_keep_up_is_no_chatter():
    """Slot at 0.94 of the limit: edges that slip out of the thinnest chip a step earlier or later keep up 0.2 % of the chip."""
    slot = {"diameter": 0.01676, "teeth": 2, "tangential": 2.0059e9, "normal": 4.204e8, "direction": "slot"}
    problem = build_problem(machine_dynamics(template_machine()), slot, in_time=True)[0].changed(feed_per_tooth=1e-4)
    run = run_until_decided(RunningCut(problem, 17624.0, 2.419e-3, method=ExactSteps(400), kept=20_000), 960, 2000)
    assert run.verdict().state == "stable" and run.steps_per_period == 1600
