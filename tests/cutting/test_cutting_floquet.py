"""FloquetDeterminant: converged reference values, laws, islands, honesty of the stated error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import Modes, ToolpointError
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    Tool,
    TurningProblem,
    ZeroOrder,
    stability,
)
from toolpoint.vibration import frequency_response

RPM = np.array([5000, 7500, 10000, 12500, 15000, 17500, 20000, 22500, 25000.0])
NONE = np.inf
# Converged lowest critical depths, mm, and the speeds with flip; three independent routes agree to 1e-9 or better.
CONVERGED = {
    (1.0, 1): ([0.408628, 0.320566, 0.322379, 2.707020, 0.386589, 0.507607, 1.417506, 3.541361, 3.939930],
               [12500, 20000, 22500]),
    (0.5, 1): ([0.847204, 1.611976, 2.104690, 0.657042, 2.596238, 1.088426, 0.719643, 0.618137, 1.037704],
               [10000, 15000, 17500]),
    (1.0, 2): ([0.047507, 0.054803, 0.071411, 0.148346, 0.114448, 0.048046, 0.063222, 0.148591, 0.530130], []),
    (0.05, 2): ([1.843802, 1.483203, 1.486950, NONE, 1.651214, 2.651280, 3.250386, NONE, NONE], [20000]),
}


def cut(immersion: float) -> Engagement:
    """Slot or down-milling."""
    return Engagement.slot() if immersion == 1 else Engagement.down(immersion)


@pytest.mark.parametrize(("immersion", "directions"), CONVERGED)
def test_converged_depths(immersion: float, directions: int) -> None:
    """All 36 converged values within 1e-4 (here: the digits given), with their type."""
    chart = stability.chart(benchmark(cut(immersion), directions), RPM, depth_max=0.01)
    depths, flips = CONVERGED[immersion, directions]
    finite = np.isfinite(depths)
    assert np.array_equal(np.isfinite(chart.limit), finite)
    assert 1e3 * chart.limit[finite] == pytest.approx(np.array(depths)[finite], rel=2e-5, abs=6e-7)
    kinds = [None if p < 0 else chart.kind[p] for p in chart.limit_points()]
    assert [int(n) for n, kind in zip(RPM, kinds) if kind == "flip"] == flips
    assert chart.method == "FloquetDeterminant"


def test_restable_interval() -> None:
    """At 17500 rev/min, a/D 0.5, stable again from 2.026046 to 2.152617 mm."""
    found = 1e3 * stability.chart(benchmark(cut(0.5)), [17500.0]).intervals(0)
    assert found[:, 0] == pytest.approx([0, 2.026046], abs=6e-7)
    assert found[:, 1] == pytest.approx([1.088426, 2.152617], abs=6e-7)


def test_two_tooth_cutter() -> None:
    """Altintas' cutter: converged depths, 6 digits."""
    chart = stability.chart(altintas(), [3000, 6000, 9500, 14000, 16000])
    assert 1e3 * chart.limit == pytest.approx([0.959639, 1.842816, 0.913067, 4.954111, 0.992489], abs=6e-7)


def test_up_and_down_milling_of_equal_arc_are_alike() -> None:
    """Isotropic 2 DOF: up- and down-milling of equal arc have the same multipliers, so the same limits."""
    speeds = np.linspace(8000, 20000, 7)
    method = FloquetDeterminant(tolerance=1e-10)
    down = stability.chart(benchmark(Engagement.down(0.2), 2), speeds, method, depth_max=0.005)
    up = stability.chart(benchmark(Engagement.up(0.2), 2), speeds, method, depth_max=0.005)
    assert np.isfinite(down.limit).sum() >= 4
    assert up.limit == pytest.approx(down.limit, rel=1e-9)


def test_turning_structure_and_cut_together_changes_nothing() -> None:
    """A structure turned by an angle and cut along that direction has the limits it had before."""
    rng = np.random.default_rng(3)
    problem = random_problem(rng, modes=3)
    angle = 0.8
    c, s = np.cos(angle), np.sin(angle)
    modes = problem.dynamics
    turned = Modes(modes.frequency, modes.damping_ratio, np.array([[c, -s], [s, c]]) @ modes.shape, modes.dofs)  # type: ignore
    speeds = np.array([5000.0, 7000, 11000])
    method = FloquetDeterminant(tolerance=1e-10)
    first = stability.chart(problem, speeds, method, depth_max=0.01).limit
    again = stability.chart(problem.changed(dynamics=turned, feed_angle=angle), speeds, method, depth_max=0.01).limit
    finite = np.isfinite(first)
    assert finite.any()
    assert again[finite] == pytest.approx(first[finite], rel=1e-9)


def test_a_measured_frf_goes_straight_in() -> None:
    """A receptance of the benchmark structure to 12 kHz gives the converged depths without a modal fit."""
    problem = benchmark(Engagement.down(0.05), 2)
    frf = frequency_response.modal(problem.dynamics, np.arange(0.5, 12000, 0.5))  # type: ignore[arg-type]
    measured = problem.changed(dynamics=frf)
    chart = stability.chart(measured, [10000.0, 15000], FloquetDeterminant(), depth_max=0.004)
    assert 1e3 * chart.limit == pytest.approx([1.486950, 1.651214], rel=1e-3)
    assert (chart.error > 1e-6 * chart.depth).all()  # the band's end is part of the stated error


def test_a_slot_with_four_teeth_has_a_constant_matrix() -> None:
    """N = 4, full immersion: the single-frequency solution is exact, for modes and for a measured FRF."""
    problem = benchmark(Engagement.slot(), 2, tool=Tool(0.02, 4))
    frf = frequency_response.modal(problem.dynamics, np.arange(1.0, 6000, 1.0))  # type: ignore[arg-type]
    speeds = np.array([9000.0, 14000])
    single = stability.chart(problem, speeds, ZeroOrder(), depth_max=0.0005).limit
    exact = stability.chart(problem, speeds, FloquetDeterminant(tolerance=1e-9), depth_max=0.0005).limit
    assert exact == pytest.approx(single, rel=1e-6)
    measured = stability.chart(problem.changed(dynamics=frf), speeds, depth_max=0.0005)
    assert (np.abs(measured.limit - single) <= measured.error[measured.limit_points()]).all()
    assert measured.limit == pytest.approx(single, rel=1e-3)


def test_static_residual_equals_a_stiff_mode() -> None:
    """An upper residual is the limit of a mode far above the band."""
    problem = altintas()
    x, y = problem.dynamics  # type: ignore[misc]
    soft = 1e-7
    w = 2 * np.pi * 15e3
    shape = np.append(x.shape, [[w * np.sqrt(soft)]], axis=1)
    extra = Modes([*x.frequency, 15e3], [*x.damping_ratio, 0.1], shape, x.dofs)
    residual = Modes(x.frequency, x.damping_ratio, x.shape, x.dofs, upper_residual=[[soft]])
    speeds = [9500.0]
    method = FloquetDeterminant(tolerance=1e-4)
    a = stability.chart(problem.changed(dynamics=(extra, y)), speeds, method, depth_max=0.002).limit
    b = stability.chart(problem.changed(dynamics=(residual, y)), speeds, method, depth_max=0.002).limit
    assert b == pytest.approx(a, rel=2e-3)
    assert abs(b[0] / 0.913067e-3 - 1) > 5e-3
    marched = stability.chart(problem.changed(dynamics=(residual, y)), speeds, PanelArnoldi(), depth_max=0.002)
    assert marched.limit == pytest.approx(b, rel=1e-4)


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**6))
def test_count_equals_the_multipliers_of_collocation(seed: int) -> None:
    """The whole-number count equals the number of multipliers outside the unit circle, computed another way."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, modes=int(rng.integers(1, 4)))
    speed = rng.uniform(4000, 15000)
    depths = np.linspace(0.001, 0.006, 3)
    chart = stability.chart(problem, [speed], FloquetDeterminant(), depth_max=0.006)
    for w, counted in zip(depths, chart.unstable_count(depths)[0]):
        mu = np.abs(Collocation().multipliers(problem, speed, float(w)))
        if np.abs(mu - 1).min() > 1e-4 and chart.status == "complete":
            assert (mu > 1).sum() == counted


@pytest.mark.slow
def test_stated_errors_bound_the_true_ones() -> None:
    """A loose run's stated error bounds its distance from a tight run, over random problems."""
    rng = np.random.default_rng(11)
    bounded, total = 0, 0
    for _ in range(50):
        problem = random_problem(rng)
        speeds = rng.uniform(4000, 15000, 2)
        loose = stability.chart(problem, speeds, FloquetDeterminant(tolerance=1e-3, nodes=4), depth_max=0.01)
        tight = stability.chart(problem, speeds, FloquetDeterminant(tolerance=1e-9, nodes=14), depth_max=0.01)
        for i in range(2):
            p = loose.limit_points()[i]
            if p >= 0 and np.isfinite(tight.limit[i]):
                total += 1
                bounded += abs(loose.depth[p] - tight.limit[i]) <= loose.error[p] + 1e-12
    assert total > 25 and bounded >= 0.97 * total


def test_speed_dependent_response() -> None:
    """A response that is a function of the speed gives at each speed what the fixed response gives."""
    stiff = benchmark(Engagement.down(0.05), 2)

    def at(speed: float) -> Modes:
        return stiff.dynamics if speed < 8000 else stiff.dynamics.with_damping(0.02)  # type: ignore

    mixed = stability.chart(stiff.changed(dynamics=at), [5000.0, 10000.0]).limit
    damped = stability.chart(stiff.changed(dynamics=at(1e4)), [10000.0]).limit
    assert 1e3 * mixed[0] == pytest.approx(1.843802, abs=6e-7) and mixed[1] == pytest.approx(damped[0], rel=1e-9)


@pytest.mark.slow
def test_unresolved_depths_are_taken_as_unstable_and_too_low_speeds_refused() -> None:
    """Depths beyond double precision are never called stable; a speed that needs a huge matrix is refused."""
    default = stability.chart(benchmark(Engagement.slot(), 2), [3000.0], depth_max=0.05)
    assert default.limit[0] < 0.001 and not default.stable([0.05])[0, 0]
    deep = stability.chart(benchmark(Engagement.slot(), 2), [3000.0], FloquetDeterminant(), depth_max=0.05)
    assert deep.limit[0] < 0.001 and not deep.stable([0.05])[0, 0]
    with pytest.raises(ToolpointError, match="leave out the modes"):
        stability.chart(benchmark(Engagement.slot(), 2), [100.0], FloquetDeterminant())


def test_what_it_cannot_do_is_refused() -> None:
    """Turning and unequal pitch name the method to use."""
    turning = TurningProblem(1e9, benchmark(cut(1)).dynamics)  # type: ignore[arg-type]
    with pytest.raises(ToolpointError, match="ZeroOrder"):
        stability.chart(turning, [5000.0], FloquetDeterminant())
    uneven = MillingProblem(Tool(0.02, 2, pitch=[3.0, 2 * np.pi - 3]), Engagement.slot(), CuttingCoefficients(6e8, 2e8),
                            benchmark(cut(1)).dynamics)
    with pytest.raises(ToolpointError, match="Collocation"):
        stability.chart(uneven, [5000.0], FloquetDeterminant())


def test_depths_of_a_flip_lobe_between_levels_are_added() -> None:
    """D(pi) = (1 - s/0.3)(1 - s/0.35) is negative between two levels only; without such a lobe nothing is added."""
    from toolpoint.cutting.stability.floquet.counts import add_flips
    from toolpoint.cutting.stability.floquet.records import ThetaTable

    levels, counts = np.array([0.25, 0.5, 1.0]), np.zeros(3, int)

    def added(*coefficients: float) -> list[float]:
        c = np.array([coefficients] * 2, complex)
        table = ThetaTable(np.array([0.0, np.pi]), np.arange(2), c, np.full(2, len(coefficients) - 1))
        found, _ = add_flips(table, 2, levels, counts)
        assert (np.diff(found) > 0).all() and set(levels) <= set(found)
        return [s for s in found if s not in levels]

    lobe = added(1, -1 / 0.3 - 1 / 0.35, 1 / 0.3 / 0.35)
    assert lobe and all(0.3 < s < 0.35 for s in lobe)
    assert added(1, 0.5, 0.2) == [] and added(1, -1 / 0.4) == []  # one flip alone is seen at the levels
