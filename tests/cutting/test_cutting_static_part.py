"""The static part of a response (modes above the band): the same limit by every method, and where it ends to be one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad

from cutting.cutting_cases import random_problem
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    Tool,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.cut.arc import gauss
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.simulation.milling import simulate
from toolpoint.cutting.stability import METHODS
from toolpoint.cutting.stability.panels.kernels import steep
from toolpoint.cutting.stability.panels.layout import legendre_table
from toolpoint.cutting.stability.static_part import limit_static_part

STOOD_IN = {"hill": 2e-3, "semi-discretization": 6e-2, "full-discretization": 6e-2}  # no place for a static part
TIGHT = {"floquet": {"tolerance": 1e-9}, "collocation": {"levels": 6, "tolerance": 1e-9}} | {
    f"{kind}-discretization": {"intervals": 300, "levels": 3, "tolerance": 1e-4} for kind in ("semi", "full")}
SLOW = [pytest.param(name, marks=pytest.mark.slow) if name in STOOD_IN else name for name in METHODS]
EXACT = {"floquet": 1e-9, "panel": 1e-6, "auto": 1e-9, "collocation": 1e-6}
AVERAGED = {"zero-order": 0.4, "multi-frequency": 2e-2}


def random_residual(seed: int, helix: float = 0.0) -> MillingProblem:
    """A random cut of three modes, and a static part of a twentieth of the softest one's flexibility, stiff in no direction."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, modes=3)
    soft = float(np.linalg.norm(problem.plane.residues, axis=(1, 2)).max() / np.abs(problem.plane.poles).max())
    way = rng.normal(size=(2, 2))
    static = 0.1 * soft * way @ way.T / np.linalg.norm(way @ way.T)
    tool = Tool(0.016, problem.tool.teeth, helix=helix)
    return problem.changed(tool=tool, dynamics=replace(problem.plane, static=static))


def limit_of(problem: MillingProblem, method=None, speed: float = 9000.0, depth_max: float = 0.05) -> float:
    chart = stability.chart(problem, [speed], method, depth_max=depth_max)
    assert chart.limit[0] < depth_max
    return float(chart.limit[0])


@cache
def exact_limit(seed: int) -> tuple[float, float]:
    """Depth to which limits are searched, and the exact limit, which the static part moves; the same for every method."""
    problem = random_residual(seed)
    without = limit_of(problem.changed(dynamics=replace(problem.plane, static=np.zeros((2, 2)))))
    depth = 1.5 * limit_of(problem)
    exact = limit_of(problem, FloquetDeterminant(tolerance=1e-9), depth_max=depth)
    assert abs(without / exact - 1) > 1e-3
    return depth, exact


@pytest.mark.parametrize("name", SLOW)
@pytest.mark.parametrize("seed", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_every_method_has_the_same_limit_with_a_static_part(name: str, seed: int) -> None:
    """Those with a place for it: the exact one. The others say what stands in for it, and have that one's limit."""
    problem = random_residual(seed)
    depth, exact = exact_limit(seed)
    method = METHODS[name](**TIGHT.get(name, {}))
    if name in STOOD_IN:
        chart = stability.chart(problem, [9000.0], method, depth_max=depth)
        assert any("upper residual given by a mode" in note and "lags by 26 degrees" in note for note in chart.notes)
        exact = limit_of(problem.changed(dynamics=problem.plane.with_modal_residual()), PanelArnoldi(), depth_max=depth)
    tolerance = {**STOOD_IN, **EXACT, **AVERAGED}[name]
    assert limit_of(problem, method, depth_max=depth) == pytest.approx(exact, rel=tolerance)


def test_a_constant_matrix_with_a_static_part_is_solved_by_one_frequency() -> None:
    """Four teeth in a slot: the directional matrix is constant, the single-frequency solution exact."""
    problem = random_residual(3).changed(tool=Tool(0.016, 4), engagement=Engagement.slot())
    exact = limit_of(problem, ZeroOrder())
    for method in (FloquetDeterminant(), PanelArnoldi()):
        assert limit_of(problem, method) == pytest.approx(exact, rel=1e-6)


@pytest.mark.slow
def test_a_helical_limit_with_a_static_part_has_a_multiplier_on_the_circle() -> None:
    problem = random_residual(5, helix=0.6)
    limit = limit_of(problem, PanelArnoldi(), depth_max=0.02)
    mu = np.abs(Collocation(nodes=6, slices=6).multipliers(problem, 9000.0, limit))
    assert mu[0] == pytest.approx(1, abs=1e-5)


@pytest.mark.slow
def test_the_simulated_cut_decays_below_the_limit_and_grows_above() -> None:
    """The march in time, with the mode that stands in; its limit lies within what that changes."""
    problem = random_residual(1)
    limit = limit_of(problem)
    ends = []
    for share in (0.9, 1.1):
        run = simulate(problem.changed(feed_per_tooth=1e-4), 9000.0, share * limit, revolutions=60)
        swing = np.linalg.norm(run.displacement - np.roll(run.displacement, run.steps_per_period, axis=0), axis=1)
        size = swing.size
        ends.append(float(swing[size // 2:].max() / swing[size // 4:size // 2].max()))
    assert ends[0] < 1 < ends[1]


@pytest.mark.parametrize("sigma", [-0.8 + 3j, -6.0, -9 + 12j, -40.0, -700 + 200j, -1e6])
@pytest.mark.parametrize("nodes", [4, 7])
def test_steep_weights_are_the_integral(sigma: complex, nodes: int) -> None:
    """Of a polynomial times the exponential, from the panel's start to every node and over the whole."""
    x, weights, _ = gauss(nodes)
    out = np.zeros((nodes + 1, nodes), complex)
    steep(complex(sigma), legendre_table((nodes,))[0], weights, nodes, out)
    polynomial = np.polynomial.Polynomial(np.random.default_rng(0).normal(size=nodes))
    for at, row in zip([*x, 1.0], out, strict=True):
        edge = [max(-1.0, at - 40 / abs(sigma.real)), at]
        expected = sum(quad(lambda y: getattr(np.exp(sigma * (at - y)) * polynomial(y), part), *edge, limit=400,  # noqa: B023
                            epsabs=1e-15)[0] * factor for part, factor in (("real", 1), ("imag", 1j)))
        assert row @ polynomial(x) == pytest.approx(expected, rel=1e-8, abs=1e-12 / abs(sigma))


def uneven(soft: float, helix: float = 0.0) -> MillingProblem:
    """A stiff mode along y, and a static part along x alone: some directions of cut push the tool against its own chip."""
    poles = np.array([2 * np.pi * 300 * (-0.05 + 1j)])
    plane = PlaneDynamics(poles, np.array([[[0, 0], [0, -2e-9j]]], complex), np.diag([soft, 0.0]))
    return MillingProblem(Tool(0.016, 2, helix=helix), Engagement.slot(), CuttingCoefficients(9e8, 3e8), plane)


def test_depths_at_which_the_static_part_chatters_by_itself_are_unstable() -> None:
    """n G k = g sin (K_t cos + K_n sin), least g/2 (K_n - sqrt(K_t^2 + K_n^2)); a multiplier is -1 where w times it is -1/2."""
    problem = uneven(1e-7)
    expected = 1 / (1e-7 * (np.hypot(9e8, 3e8) - 3e8))
    assert limit_static_part(problem) == pytest.approx(expected, rel=1e-5)
    method = PanelArnoldi(nodes=10)
    inside, beyond = (np.abs(method.multipliers(problem, 6000.0, share * expected)).max() for share in (0.97, 1.1))
    assert inside < 1 < beyond
    for method in (FloquetDeterminant(), PanelArnoldi(), ZeroOrder()):
        chart = stability.chart(problem, [6000.0], method, depth_max=2 * expected)
        assert chart.limit[0] == pytest.approx(expected, rel=1e-5) and "would chatter by itself" in chart.status
    assert 0.3 * expected < limit_static_part(uneven(1e-7, helix=0.5)) <= expected * (1 + 1e-9)


def test_what_is_soft_alike_in_all_directions_never_chatters_at_once() -> None:
    """n G k = g K_n: above zero."""
    problem = uneven(1e-7)
    alike = problem.changed(dynamics=replace(problem.plane, static=1e-7 * np.eye(2)))
    assert limit_static_part(alike) == float("inf")


def test_the_first_loss_alone_is_that_of_the_whole_chart() -> None:
    speeds = np.linspace(3000, 15000, 7)
    for problem in (random_residual(2), random_residual(6, helix=0.5)):
        whole = stability.chart(problem, speeds, PanelArnoldi(), depth_max=0.02)
        first = stability.chart(problem, speeds, PanelArnoldi(first_only=True), depth_max=0.02)
        np.testing.assert_allclose(first.limit, whole.limit, rtol=2e-5)
        assert first.status.startswith("complete up to the first loss") and np.bincount(first.index).max() == 1
