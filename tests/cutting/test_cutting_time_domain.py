"""The simulation: growth at the boundary, agreement with the engine, location error, spectra, loss of contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from cutting.cutting_cases import benchmark, random_problem
from toolpoint import Modes, ToolpointError, ToolpointWarning
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    MillingProblem,
    SpeedVariation,
    Tool,
    stability,
)
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, simulate
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.cutting.surface.location import location_error, static_force_series


def at_exit(run: Simulation, direction: int = 1) -> float:
    """Displacement when a tooth leaves the cut, in the last revolutions (cubic between samples)."""
    engagement, m = run.problem.engagement, run.steps_per_period
    place = engagement.arc / (2 * np.pi / run.problem.tool.teeth) * m
    first = run.displacement.shape[0] - 1 - 3 * m + int(place)
    spline = CubicSpline(np.arange(-4, 6), run.displacement[first - 4:first + 6, direction])
    return float(spline(place - int(place)))


def test_location_error_from_the_response_and_from_the_simulation() -> None:
    """2 DOF, a/D 0.05 down, 0.5 mm, 0.1 mm a tooth: 36.70644, 3.73467, -2.07386 um at 13830, 12500, 5000 rev/min."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    speeds, want = [13830.0, 12500.0, 5000.0], np.array([36.70644, 3.73467, -2.07386])
    assert 1e6 * location_error(problem, speeds, 0.5e-3) == pytest.approx(want, abs=6e-6)  # type: ignore[arg-type]
    simulated = [1e6 * at_exit(simulate(problem, n, 0.5e-3, revolutions=150, method=ExactSteps(2000))) for n in speeds]
    assert simulated == pytest.approx(want, rel=1e-4)


@pytest.mark.parametrize("helix", [0.0, 0.6])
def test_coefficients_of_the_static_force_are_those_of_quadrature(helix: float) -> None:
    """The integral over the arc (and the mean over the height) by midpoints, against the closed form."""
    material = CuttingCoefficients(7e8, 2e8, ka=1e8, edge_t=2e4, edge_n=1e4, edge_a=3e3)
    modes = Modes([800.0], [0.03], [[1.0], [0.5]], ["tool:+x", "tool:+y"])
    problem = MillingProblem(Tool(0.01, 3, helix=helix), Engagement(0.4, 2.1), material, modes, feed_per_tooth=1e-4)
    depth, points = 2e-3, 20_000
    phi = 0.4 + 1.7 * (np.arange(points) + 0.5) / points
    sine, cosine = np.sin(phi), np.cos(phi)
    tangential, normal, axial = (7e8 * 1e-4 * sine + 2e4, 2e8 * 1e-4 * sine + 1e4, 1e8 * 1e-4 * sine + 3e3)
    force = -depth * np.stack([tangential * cosine + normal * sine, -tangential * sine + normal * cosine, -axial])
    lags = 2 * np.tan(helix) / 0.01 * depth * (np.arange(200) + 0.5) / 200
    for k in (0, 1, 5):
        wave = np.exp(-1j * 3 * k * (phi - 0.4)) * 3 / (2 * np.pi) * 1.7 / points
        by_hand = force @ wave * np.exp(-1j * 3 * k * lags).mean()
        assert static_force_series(problem, depth, 5)[5 + k] == pytest.approx(by_hand, rel=1e-4, abs=1e-4)


def test_a_joint_that_is_all_but_locked_asks_for_no_further_harmonics(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mode at 3 MHz without compliance has put ten gigabytes of harmonics into a page; the error is that without it."""
    labels = ["tool:+x", "tool:+y"]
    shapes = np.array([[1.0, 0.2, 0.4], [0.3, 1.2, 0.5]])
    every = MillingProblem(Tool(0.01, 3), Engagement.down(0.3), CuttingCoefficients(7e8, 2e8),
                           Modes([300.0, 420.0, 3e6], [0.03] * 3, shapes, labels), feed_per_tooth=1e-4)
    soft = every.changed(dynamics=Modes([300.0, 420.0], [0.03] * 2, shapes[:, :2], labels))
    speeds = np.array([3000.0, 9100.0])
    orders = list[int]()

    def count_orders(problem: MillingProblem, depth: float, harmonics: int) -> np.ndarray:
        orders.append(harmonics)
        return static_force_series(problem, depth, harmonics)

    monkeypatch.setattr("toolpoint.cutting.surface.location.static_force_series", count_orders)
    assert location_error(every, speeds, 1e-3) == pytest.approx(location_error(soft, speeds, 1e-3), rel=1e-4)
    assert orders[:2] == orders[2:] and max(orders) < 1000  # 3 MHz would ask for more than a million


def test_location_error_with_an_axial_force_that_bends_the_tool_sideways() -> None:
    """Modes in oblique directions of space: the law with the 3x3 response and the simulation agree, and z matters."""
    problem = spatial(Tool(0.012, 2), Engagement.down(0.2))
    want = float(location_error(problem, [9000.0], 0.05e-3)[0])
    assert at_exit(simulate(problem, 9000.0, 0.05e-3, revolutions=100, method=ExactSteps(2000))) == pytest.approx(want,
                                                                                                                  rel=2e-3)
    assert abs(float(location_error(problem.changed(z=None), [9000.0], 0.05e-3)[0]) / want - 1) > 0.02
    with pytest.raises(ToolpointError, match="cylindrical"):
        location_error(spatial(Tool(0.012, 2, corner_radius=1e-3), Engagement.down(0.2)), [9000.0], 0.05e-3)


@pytest.mark.slow
def test_growth_at_the_boundary_is_one() -> None:
    """Over 80 tooth periods at the converged depth the growth rate is within 1e-4 of 1."""
    problem = benchmark(Engagement.slot(), feed_per_tooth=1e-4)
    run = simulate(problem, 5000.0, 0.408628e-3, revolutions=100, method=ExactSteps(1500))
    assert run.growth(80) == pytest.approx(1, abs=1e-4)
    assert simulate(problem, 5000.0, 0.5e-3, revolutions=16, method=ExactSteps(1500)).growth(10) == pytest.approx(1.0739755867,
                                                                                                                  rel=5e-3)


@pytest.mark.slow
def test_agreement_with_the_engine_off_the_boundary() -> None:
    """Random cuts 5 % inside and outside the limit decay and grow."""
    rng = np.random.default_rng(4)
    tried = 0
    while tried < 8:
        problem = random_problem(rng, modes=int(rng.integers(1, 5))).changed(feed_per_tooth=5e-4)
        speed = float(rng.uniform(6000, 15000))
        chart = stability.chart(problem, [speed], depth_max=0.012)
        limit = chart.limit[0]
        if limit > 0.011 or not np.isfinite(limit) or chart.intervals(0)[0, 1] < 1e-4:
            continue
        tried += 1
        for factor in (0.95, 1.05):
            if chart.stable([factor * limit])[0, 0] != (factor < 1):
                continue
            run = simulate(problem, speed, factor * limit, revolutions=120, method=ExactSteps(600))
            assert run.is_chattering() in (factor > 1, None)


def test_spectrum_marks_its_lines() -> None:
    """A stable cut shows tooth passing only; with run-out also spindle lines; an unstable one a chatter line."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    stable = simulate(problem, 12500.0, 0.5e-3, revolutions=200)
    kinds = {kind for _, _, kind in stable.spectrum(last_revolutions=40).lines(0.1)}
    assert kinds == {"tooth passing"}
    runout = simulate(problem.changed(tool=Tool(0.02, 2, runout=10e-6)), 12500.0, 0.5e-3, revolutions=200)
    assert "spindle" in {kind for _, _, kind in runout.spectrum("force", 1, 40).lines(0.02)}
    chatter = simulate(problem, 10000.0, 3e-3, revolutions=200)
    lines = [f for f, _, kind in chatter.spectrum(last_revolutions=64).lines(0.3) if kind == "chatter"]
    want = stability.chart(problem, [10000.0]).frequency[0]
    assert chatter.is_chattering() is True and min(abs(f - want) for f in lines) < 60


def test_spectrum_of_a_run_that_ended_within_its_first_revolution_is_of_all_of_it() -> None:
    run = simulate(benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4), 12000.0, 0.5e-3, revolutions=40)
    count = run.steps_per_revolution // 2
    short = replace(run, displacement=run.displacement[:count], time=run.time[:count])
    spectrum = short.spectrum()
    assert np.isfinite(spectrum.frequency).all() and spectrum.frequency[1] == pytest.approx(2 * 12000.0 / 60, rel=1e-9)
    assert all(np.isfinite(f) for f, _, _ in spectrum.lines())


def test_loss_of_contact_limits_the_vibration() -> None:
    """Beyond the limit the amplitude stays bounded because teeth leave the cut."""
    problem = benchmark(Engagement.down(0.05), 2, feed_per_tooth=1e-4)
    run = simulate(problem, 10000.0, 3e-3, revolutions=300)
    early, late = (np.ptp(run.displacement[part]) for part in (slice(-40000, -20000), slice(-20000, None)))
    assert late == pytest.approx(early, rel=0.1) and 1e-5 < late < 5e-3


def test_rigid_forces_follow_the_closed_form() -> None:
    """A stiff structure: mean force is the closed form N/2pi w f int k sin, torque's mean is K_t w f a R/(2 pi R) N."""
    problem = benchmark(Engagement.down(0.5), 2, feed_per_tooth=1e-4)
    stiff = problem.dynamics
    problem = problem.changed(dynamics=type(stiff)(stiff.frequency, stiff.damping_ratio, stiff.shape * 1e-4,
                                                   stiff.dofs))  # type: ignore
    run = simulate(problem, 6000.0, 1e-3, revolutions=20, method=ExactSteps(2000))
    tail = slice(-10 * run.steps_per_revolution, None)
    series = -1e-3 * 1e-4 * problem.mean_matrix @ np.array([1.0, 0.0])
    assert run.force[tail, :2].mean(0) == pytest.approx(series, rel=1e-5)
    width = 0.5 * problem.tool.diameter
    power = 6e8 * 1e-3 * width * (1e-4 * 2 * 6000 / 60)  # specific energy K_t times material removal rate
    assert run.power[tail].mean() == pytest.approx(power, rel=1e-5)


def test_slices_of_a_helix_converge_and_delay_the_entry() -> None:
    """A helical cut's force equals the mean of straight ones shifted along the edge."""
    problem = benchmark(Engagement.down(0.5), 2, feed_per_tooth=1e-4)
    helical = problem.changed(tool=Tool(0.02, 2, helix=np.radians(30)))
    a, b = (simulate(helical, 6000.0, 2e-4, revolutions=20, method=ExactSteps(400, slices=n)) for n in (8, 16))
    assert np.abs(a.force[-800:] - b.force[-800:]).max() < 0.02 * np.abs(b.force[-800:]).max()


def test_bad_input() -> None:
    """No feed, no speed, no depth."""
    problem = benchmark(Engagement.slot())
    with pytest.raises(ToolpointError, match="feed_per_tooth"):
        simulate(problem, 5000.0, 1e-3)
    with pytest.raises(ToolpointError, match="speeds"):
        simulate(problem.changed(feed_per_tooth=1e-4), 0.0, 1e-3)
    with pytest.raises(ToolpointError, match="depth"):
        simulate(problem.changed(feed_per_tooth=1e-4), 5000.0, 0.0)
    assert issubclass(ToolpointWarning, UserWarning)


@pytest.mark.slow
def test_a_spindle_that_hardly_varies_is_a_constant_one() -> None:
    problem = benchmark(Engagement.down(0.2), 2, tool=Tool(0.02, 2), feed_per_tooth=1e-4)
    constant = simulate(problem, 9000.0, 0.3e-3, revolutions=20, method=ExactSteps(400))
    varied = simulate(problem.changed(speed_variation=SpeedVariation(1e-9, 3)), 9000.0, 0.3e-3, revolutions=20,
                      method=ExactSteps(400))
    size = np.abs(constant.displacement).max()
    np.testing.assert_allclose(varied.displacement, constant.displacement, atol=1e-6 * size)
    np.testing.assert_allclose(varied.time, constant.time, rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "depth"), [(9000.0, 0.3e-3), (9000.0, 0.5e-3), (11500.0, 0.4e-3)])
def test_growth_under_speed_variation_is_the_multiplier_of_the_collocation(speed: float, depth: float) -> None:
    """Two independent routes: marching in time, and the monodromy of one period of the variation."""
    problem = benchmark(Engagement.slot(), tool=Tool(0.02, 2), feed_per_tooth=1e-4)
    problem = problem.changed(speed_variation=SpeedVariation(0.15, 2))
    largest = float(np.abs(Collocation(nodes=10).multipliers(problem, speed, depth)[0]))
    periods = 12 if largest > 1 else 8
    run = simulate(problem, speed, depth, revolutions=2 * (periods + 6), method=ExactSteps(800))
    assert run.status == "complete"
    assert run.growth(periods) == pytest.approx(largest, rel=0.03)


@pytest.mark.slow
def test_the_feed_of_a_tooth_follows_the_spindle_at_a_constant_table_speed() -> None:
    problem = benchmark(Engagement.slot(), tool=Tool(0.02, 1), feed_per_tooth=1e-4)
    run = simulate(problem.changed(speed_variation=SpeedVariation(0.3, 4)), 3000.0, 1e-7, revolutions=12,
                   method=ExactSteps(400))
    middle = run.chip[100::400][4:8]  # the tooth stands at 90 degrees: the chip is the feed of its revolution
    revolution = np.diff(run.time[100::400])[3:7]
    rate = 1e-4 / (60 / 3000) * 12 * 60 / 3000 / run.time[-1]
    assert middle == pytest.approx(rate * revolution, rel=2e-3)
    assert np.ptp(middle) > 0.1 * middle.mean()


def test_a_stable_cut_with_run_out_does_not_chatter() -> None:
    """Its tooth periods differ, its revolutions do not."""
    problem = benchmark(Engagement.down(0.2), 2, tool=Tool(0.02, 4, runout=2e-5), feed_per_tooth=1e-4)
    run = simulate(problem, 9000.0, 0.05e-3, revolutions=60, method=ExactSteps(400))
    assert np.abs(run.displacement[-1] - run.displacement[-1 - run.steps_per_period]).max() > 1e-8
    assert run.is_chattering() is False


def test_edges_kept_in_contact_grow_and_decay_as_the_multiplier_says_from_any_start() -> None:
    problem = benchmark(Engagement.down(0.2), 2, tool=Tool(0.02, 2), feed_per_tooth=1e-6)
    limit = stability.chart(problem, [12000.0], depth_max=0.02).limit[0]
    rng = np.random.default_rng(0)
    start = 1e-4 * (rng.standard_normal(2) + 1j * rng.standard_normal(2))
    for factor in (0.95, 1.05):
        largest = float(np.abs(Collocation(nodes=10).multipliers(problem, 12000.0, factor * limit)[0]))
        kept = simulate(problem, 12000.0, factor * limit, revolutions=120, method=ExactSteps(600, keeps_contact=True),
                        start=start)
        assert kept.growth(80) == pytest.approx(largest, abs=2e-3)
        assert (largest < 1) == (factor < 1)


def spatial(tool: Tool, engagement: Engagement, flexible: float = 1.0) -> MillingProblem:
    """Three modes in oblique directions of space."""
    rng = np.random.default_rng(5)
    shape = flexible * np.linalg.qr(rng.standard_normal((3, 3)))[0] / np.sqrt(0.04)
    modes = Modes([850.0, 922.0, 1300.0], [0.02, 0.011, 0.03], shape, ("t:+x", "t:+y", "t:+z"))
    material = CuttingCoefficients(6e8, 2e8, 1.5e8, 5e3, 4e3, 2e3)
    return MillingProblem(tool, engagement, material, modes, x="t:+x", y="t:+y", z="t:+z", feed_per_tooth=1e-4)


@pytest.mark.parametrize("tool", [Tool(0.012, 2, helix=0.5), Tool(0.012, 2, helix=0.5, corner_radius=2e-3),
                                  Tool(0.012, 2, corner_radius=6e-3)], ids=["cylinder", "corner", "ball"])
def test_a_rigid_structure_sees_the_forces_of_the_rigid_cutter(tool: Tool) -> None:
    problem, depth = spatial(tool, Engagement.up(0.4), 1e-5), 1.5e-3
    run = simulate(problem, 6000.0, depth, revolutions=4, method=ExactSteps(720, slices=20))
    angle = problem.engagement.entry + 2 * np.pi * np.arange(1440) / 1440
    want = rigid_forces(problem, depth, angle, slices=20)
    turn = slice(2 * 1440, 3 * 1440)
    size = np.abs(want.force).max()
    off = np.abs(run.force[turn] - want.force)
    assert off.mean() < 5e-3 * size and off.max() < 0.1 * size  # entries and exits of slices are weighed within a step
    np.testing.assert_allclose(run.force[turn].mean(axis=0), want.force.mean(axis=0), rtol=2e-3, atol=1e-3 * size)
    np.testing.assert_allclose(run.torque[turn].mean(), want.torque.mean(), rtol=2e-3)


@pytest.mark.parametrize("tool", [Tool(0.012, 2), Tool(0.012, 2, corner_radius=6e-3)], ids=["cylinder", "ball"])
def test_growth_in_space_is_the_multiplier_of_the_collocation(tool: Tool) -> None:
    problem = spatial(tool, Engagement.down(0.5))
    depth = 0.1e-3
    largest = float(np.abs(Collocation(nodes=10, slices=16).multipliers(problem, 9000.0, depth)[0]))
    run = simulate(problem, 9000.0, depth, revolutions=60, method=ExactSteps(800, slices=24, keeps_contact=True),
                   start=np.full(3, 1e-5 + 0j))
    assert run.growth(30) == pytest.approx(largest, abs=1e-3)
    flat = spatial(tool, Engagement.down(0.5)).changed(z=None)
    assert abs(simulate(flat, 9000.0, depth, revolutions=60, method=ExactSteps(800, slices=24, keeps_contact=True),
                        start=np.full(3, 1e-5 + 0j)).growth(30) - largest) > 3e-3


def test_growth_with_process_damping_is_the_multiplier_of_the_collocation() -> None:
    problem = benchmark(Engagement.slot(), 2, tool=Tool(0.02, 2), feed_per_tooth=1e-4).changed(process_damping=3e5)
    largest = float(np.abs(Collocation(nodes=10).multipliers(problem, 3000.0, 0.2e-3)[0]))
    free = float(np.abs(Collocation(nodes=10).multipliers(problem.changed(process_damping=0.0), 3000.0, 0.2e-3)[0]))
    run = simulate(problem, 3000.0, 0.2e-3, revolutions=60, method=ExactSteps(1500, keeps_contact=True),
                   start=np.full(2, 1e-5 + 0j))
    assert run.growth(30) == pytest.approx(largest, abs=5e-3)
    assert abs(free - largest) > 0.02


@pytest.mark.slow
@pytest.mark.parametrize("tool", [
    Tool(0.02, 3), Tool(0.02, 4), Tool(0.02, 2, pitch=[2.9, 2 * np.pi - 2.9]), Tool(0.02, 3, pitch=[1.8, 2.3, 2 * np.pi - 4.1]),
    Tool(0.02, 3, helix=0.5), Tool(0.02, 4, pitch=np.radians([80, 100, 75, 105]), helix=0.4)], ids=repr)
def test_growth_of_any_pitch_is_the_multiplier_of_the_collocation(tool: Tool) -> None:
    """Three and four teeth, equal and unequal pitch, helix: the linear cut grows as the multiplier of another method says;
    every tooth meets what the tooth before it left."""
    problem = benchmark(Engagement.down(0.5), 2, tool=tool).changed(feed_per_tooth=1e-4)
    period = 1 if tool.is_regular else tool.teeth
    for speed in (7000.0, 9100.0):
        depth = 0.15e-3 if tool.teeth < 4 else 0.1e-3
        largest = np.abs(Collocation(slices=8).multipliers(problem, speed, depth)[0]) ** (1 / period)
        run = simulate(problem, speed, depth, revolutions=30, method=ExactSteps(400, slices=24, keeps_contact=True))
        growth = run.growth(40 // period) ** (1 / period)
        assert growth == pytest.approx(largest, abs=4e-3)


@pytest.mark.parametrize("variation", [None, SpeedVariation(0.1, 3)])
def test_a_cut_that_marches_on_is_the_cut_at_once(variation):
    """In blocks, with only the last revolutions kept: the same samples and the same changes between periods."""
    problem = benchmark(Engagement.down(0.3), 2, feed_per_tooth=1e-4, speed_variation=variation)
    whole = simulate(problem, 9000.0, 0.3e-3, revolutions=90)
    cut = RunningCut(problem, 9000.0, 0.3e-3, kept=20_000)
    for revolutions in (30, 45, 15):
        cut.advance(revolutions)
    tail = cut.result()
    assert tail.revolutions == whole.revolutions == 90 and tail.dropped > 0
    kept = tail.time.size
    np.testing.assert_allclose(tail.displacement, whole.displacement[-kept:], rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(tail.time, whole.time[-kept:], rtol=1e-12)
    # Changes are differences of displacements: what rounding leaves of those.
    rounding = 1e-13 * np.abs(whole.displacement).max()
    np.testing.assert_allclose(tail.changes, whole.changes, rtol=1e-9, atol=rounding)
    m = whole.steps_per_repeat
    direct = np.sqrt(np.mean((whole.displacement[m + 1:2 * m + 1] - whole.displacement[1:m + 1]) ** 2))
    assert whole.changes[0] == pytest.approx(direct, rel=1e-12)
