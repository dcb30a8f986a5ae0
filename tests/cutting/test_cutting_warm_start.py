"""WarmStart: charts that begin with what their neighbour left are those of a cold start, also where instability is new."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cutting.cutting_cases import altintas, benchmark
from toolpoint import Modes
from toolpoint.cutting import (
    Collocation,
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    SemiDiscretization,
    StabilityChart,
    Tool,
    WarmStart,
    stability,
)
from toolpoint.cutting.stability.automatic import Automatic
from toolpoint.cutting.stability.chain import chart_poses, limits_of
from toolpoint.cutting.stability.floquet.records import POLE_STATE

SPEEDS = np.linspace(5000, 15000, 5)
DEPTHS = np.linspace(5e-5, 0.01, 200)
METHODS = (FloquetDeterminant(), PanelArnoldi(), Automatic(patience=4e-4))


def pose(at: float, modes: int = 6) -> Modes:
    """Modes whose frequencies, dampings and directions move along a path."""
    rng = np.random.default_rng(7)
    f, zeta, k = np.sort(rng.uniform(300, 2500, modes)), rng.uniform(0.01, 0.05, modes), 5e6 * rng.uniform(1, 20, modes)
    angle = rng.uniform(0, np.pi, modes) + 0.5 * at * rng.standard_normal(modes)
    f, zeta = f * (1 + 0.1 * at * rng.standard_normal(modes)), zeta * (1 + 0.3 * at * rng.uniform(-1, 1, modes))
    return Modes(f, zeta, 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)]), ("tool:+x", "tool:+y"))


def cut(tool: Tool | None = None) -> MillingProblem:
    """The cut of the path."""
    return MillingProblem(tool or Tool(0.016, 4), Engagement.down(0.3), CuttingCoefficients(8e8, 3e8), pose(0.0))


def same(a: StabilityChart, b: StabilityChart) -> bool:
    """Whether two charts say the same of every depth outside their stated errors."""
    return not ((a.stable(DEPTHS) != b.stable(DEPTHS)) & ~a.uncertain(DEPTHS) & ~b.uncertain(DEPTHS)).any()


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("step", [*(pytest.param(step, marks=pytest.mark.slow) for step in (0.0, 0.02)), 0.4])
@pytest.mark.default_cases(1)
def test_warm_charts_are_the_cold_ones(method: object, step: float) -> None:
    """Along a path in small and in large steps: the same points within the stated errors, their types and counts."""
    memory = WarmStart()
    for i in range(4):
        problem = cut().changed(dynamics=pose(step * i))
        cold = stability.chart(problem, SPEEDS, method)  # type: ignore[arg-type]
        warm = stability.chart(problem, SPEEDS, method, warm=memory)  # type: ignore[arg-type]
        assert same(cold, warm)
        assert warm.kind == cold.kind and (warm.change == cold.change).all()
        assert (np.abs(warm.depth - cold.depth) <= warm.error + cold.error).all()


@pytest.mark.slow
@pytest.mark.parametrize("tool", [Tool(0.016, 3, pitch=[1.9, 2.2, 2 * np.pi - 4.1]), Tool(0.016, 3, helix=0.5)])
def test_general_tools(tool: Tool) -> None:
    """Unequal pitch and helix: panels are shared, roots followed; the charts are the cold ones."""
    memory = WarmStart()
    for i in range(3):
        problem = cut(tool).changed(dynamics=pose(0.05 * i))
        cold, warm = (stability.chart(problem, SPEEDS[:3], warm=w) for w in (None, memory))
        assert warm.depth == pytest.approx(cold.depth, rel=1e-6) and warm.depth.size
    assert memory.store.kept and memory.roots


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.93, 1.07), min_size=4, max_size=4), st.floats(0.4, 1.1), st.floats(0.9, 1.1))
def test_a_new_instability_is_not_missed(frequency: list[float], damping: float, stiffness: float) -> None:
    """From a cut of two modes on: whatever the neighbour had, new boundary points of the changed modes are found."""
    first = benchmark(Engagement.down(0.05), 2)
    modes = first.dynamics
    speeds = np.array([6909.5, 7500.0, 9000, 17500])
    memory = WarmStart()
    stability.chart(first, speeds, depth_max=0.004, warm=memory)
    f, shape = np.asarray(modes.frequency) * frequency[:2], np.asarray(modes.shape) * np.sqrt(stiffness)  # type: ignore
    zeta = np.asarray(modes.damping_ratio) * damping * np.array(frequency[2:])  # type: ignore[union-attr]
    problem = first.changed(dynamics=Modes(f, zeta, shape, modes.dofs))  # type: ignore[union-attr]
    cold, warm = (stability.chart(problem, speeds, depth_max=0.004, warm=w) for w in (None, memory))
    assert warm.depth.size == cold.depth.size and warm.depth == pytest.approx(cold.depth, rel=1e-7)


@pytest.mark.slow
def test_a_sharp_mode_that_wakes_up() -> None:
    """A mode that barely moves the tool leaves no boundary; as it comes to move it, its narrow lobe is found."""
    def problem(share: float) -> MillingProblem:
        shape = np.array([[1.0, 0.0, share * 0.6], [0.0, 1.0, share * 0.8]]) * 2 * np.pi * np.array([600, 750, 1500])
        modes = Modes([600.0, 750.0, 1500.0], [0.04, 0.04, 0.002], shape / np.sqrt(2e7), ("tool:+x", "tool:+y"))
        return MillingProblem(Tool(0.016, 2), Engagement.down(0.2), CuttingCoefficients(6e8, 2e8), modes)

    speeds = np.linspace(8000, 22000, 29)
    for method in (FloquetDeterminant(), PanelArnoldi()):
        memory = WarmStart()
        for share in (0.01, 0.03, 0.1, 0.3, 0.2):
            cold, warm = (stability.chart(problem(share), speeds, method, warm=w) for w in (None, memory))
            assert same(cold, warm) and warm.depth.size == cold.depth.size


def test_every_point_is_known_afterwards() -> None:
    """What is left for the next chart holds every boundary point, and nodes from 0 to pi."""
    memory = WarmStart()
    found = stability.chart(cut(), SPEEDS, FloquetDeterminant(), warm=memory)
    for i, speed in enumerate(SPEEDS.tolist()):
        nodes, numbers, _, known = memory.scans[speed, cut().plane.poles.size]
        assert np.sort(known["s"][:numbers["points"]]) * 0.01 == pytest.approx(found.depth[found.points(i)], rel=1e-6)
        nodes = nodes[:numbers["nodes"]]
        assert nodes[0] == 0 and nodes[-1] == np.pi and (np.diff(nodes) > 0).all()


def test_nodes_to_begin_with() -> None:
    """Poles as they were: the nodes kept. One that moved, widened or grew: nodes about it, the even base if it is wide."""
    from toolpoint.cutting.stability.floquet.nodes import first_nodes

    period, before = 1e-3, np.array([0.0, 1.0, 2.0, np.pi])
    w, s, loop = np.array([1500.0, 2500.0]), np.array([50.0, 100.0]), np.array([1.0 + 0j, 2.0])
    seen = np.zeros(2, POLE_STATE)
    cold = first_nodes(16, w, s, loop, period, np.zeros(0), seen)
    assert cold.size == 17 + 10 and seen[1].tolist() == pytest.approx((2.5, 0.1, 2.0))
    assert first_nodes(16, w, s, loop, period, before, seen.copy()) == pytest.approx(before)
    for changed in ((w + np.array([0, 60]), s, loop), (w, s * [1, 1.3], loop), (w, s, loop * [1, 1.5])):
        again = first_nodes(16, *changed, period, before, seen.copy())
        assert again.size == 4 + 5 and np.abs(again - changed[0][1] * period).min() < 1e-12
    assert first_nodes(16, w, s * [1, 4], loop, period, before, seen.copy()).size >= 17


def test_nodes_to_keep() -> None:
    """Of values along a line few nodes stay, none with a gap above two base intervals; a bend keeps its node."""
    from toolpoint.cutting.stability.floquet.nodes import keep_nodes

    theta = np.linspace(0, np.pi, 65)
    values = np.ones((65, 3), complex) + 0.2j * theta[:, None]
    out, order = np.zeros(250), np.arange(65)
    plain = keep_nodes(theta, order, 65, values, 3, 16, out)
    assert plain == 9 and np.diff(out[:9]).max() < 2.01 * np.pi / 16
    values[30, 1] *= 1.5
    bent = keep_nodes(theta, order, 65, values, 3, 16, out)
    assert bent > plain and np.abs(out[:bent] - theta[30]).min() == 0


@pytest.mark.slow
def test_another_cut_begins_anew() -> None:
    """The memory of one cut is of no use to another, and does no harm: tool, engagement, depth, coefficients, speeds."""
    memory = WarmStart()
    first = cut(Tool(0.016, 3, helix=0.5))
    stability.chart(first, SPEEDS[:2], warm=memory)
    others = (first.changed(coefficients=CuttingCoefficients(4e8, 3e8)), first.changed(engagement=Engagement.up(0.5)),
              first.changed(tool=Tool(0.016, 2, helix=0.4)), cut(), first)
    for problem in others:
        for depth in (0.01, 0.004):
            cold, warm = (stability.chart(problem, SPEEDS[1:3], depth_max=depth, warm=w) for w in (None, memory))
            assert warm.depth == pytest.approx(cold.depth, rel=1e-7)


def test_fixed_memory_and_methods_without() -> None:
    """A fixed memory stays as it is; a method that cannot begin warm begins cold."""
    memory = WarmStart(fixed=True)
    stability.chart(cut(), SPEEDS[:1], FloquetDeterminant(), warm=memory)
    assert not memory.scans and not memory.roots and not memory.attempts
    semi = SemiDiscretization(0, 20)
    plain, given_ = (stability.chart(cut(), SPEEDS[4:], semi, depth_max=0.002, warm=w) for w in (None, memory))
    assert (plain.depth == given_.depth).all()


def test_a_chain_of_poses_warm_and_cold() -> None:
    """Seventeen poses and two feed directions, each warm from the one before: the cold charts."""
    poses = [pose(0.03 * i) for i in range(17)]
    warm, cold = (limits_of(chart_poses(cut(), poses, SPEEDS[2:4], feed_angles=[0.0, 0.3], warm=w), 2) for w in (True, False))
    assert warm.shape == (17, 2, 2) and warm == pytest.approx(cold, rel=1e-6)


def test_a_flip_lobe_that_closes_before_a_hopf_lobe() -> None:
    """Unequal pitch, a flip lobe between two search levels and the Hopf lobe above it: the limit is the flip's."""
    f, k = np.array([456.8, 1448.9, 516.5, 1408.4]), np.array([7.933e6, 1.469e7, 9.375e6, 1.241e7])
    way = np.array([[1.0, 1, 0, 0], [0, 0, 1, 1]])
    modes = Modes(f * [1.04, 0.98, 1.028, 1.012], [0.1117, 0.01704, 0.02458, 0.03136], 2 * np.pi * f / np.sqrt(k) * way,
                  ("tool:+x", "tool:+y"))
    problem = altintas().changed(dynamics=modes, tool=Tool(0.0254, 4, pitch=np.radians([80, 100, 75, 105])),
                                 engagement=Engagement.down(0.5))
    speed = 7789.473684210527
    found = stability.chart(problem, [speed], PanelArnoldi())
    general = Collocation(nodes=8)
    for depth in np.linspace(1.5e-3, 2.2e-3, 15):
        if not found.uncertain([depth])[0, 0]:
            assert found.stable([depth])[0, 0] == (np.abs(general.multipliers(problem, speed, depth)[0]) < 1)
    assert found.intervals(0).shape[0] >= 2 and found.kind[0] == "flip"


def test_memories_beside_each_other_share_panels() -> None:
    """Feed directions of one helical cut: the panels of the first serve the second, whose roots are its own."""
    problem = cut(Tool(0.016, 3, helix=0.5))
    first = WarmStart()
    second = first.share_panels()
    stability.chart(problem, SPEEDS[:1], warm=first)
    kept = len(first.store.kept)
    turned = problem.at_feed_angle(0.4)
    warm = stability.chart(turned, SPEEDS[:1], warm=second)
    assert kept and second.store is first.store and first.store.kept
    assert warm.depth == pytest.approx(stability.chart(turned, SPEEDS[:1]).depth, rel=1e-7)
    assert first.roots.keys() == second.roots.keys() and not np.array_equal(*(m.roots[SPEEDS[0]] for m in (first, second)))
