"""Turning in closed form, mode coupling, tool against work."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, modes_of
from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, TurningProblem, stability
from toolpoint.cutting.cut.plane_pairs import against
from toolpoint.cutting.cut.problem import plane_dynamics
from toolpoint.cutting.stability.methods.mode_coupling import mode_coupling
from toolpoint.cutting.stability.methods.turning import least_width, lobe_tips
from toolpoint.studies.cuts.turning.direction import orient

M, K, Z, KF = 1.0, 1e7, 0.03, 1e9


@pytest.mark.slow
def test_turning_in_closed_form_is_the_chart() -> None:
    """Least width and its speeds agree with the chart, with and without process damping."""
    modes = Modes([np.sqrt(K / M) / (2 * np.pi)], [Z], np.array([[1.0]]), ("tool:+x",))
    tips = lobe_tips(modes.frequency[0], Z, 5)
    chart = stability.chart(TurningProblem(KF, modes), tips[::-1], depth_max=0.01)
    assert chart.limit == pytest.approx(least_width(K, Z, KF), rel=1e-9)
    assert chart.frequency[chart.limit_points()] == pytest.approx(modes.frequency[0] * np.sqrt(1 + 2 * Z), rel=1e-6)
    damped = TurningProblem(KF, modes, process_damping=2e4, cutting_speed=1.0)
    b = least_width(K, Z, KF, process_damping=2e4, cutting_speed=1.0, modal_mass=M)
    found = stability.chart(damped, np.linspace(300, 330, 301), depth_max=0.05).limit.min()
    assert found == pytest.approx(b, rel=1e-3) and b > least_width(K, Z, KF)


def test_mode_coupling_of_two_modes() -> None:
    """Two modes cut at 45 degrees: unstable by coupling when close, by no depth when one direction is rigid."""
    angle = np.radians(40)
    way = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    modes = Modes([20.0, 22.0], [0.01, 0.01], way / np.sqrt(50.0), ("tool:+x", "tool:+y"))
    problem = MillingProblem(Tool(0.02, 4), Engagement.slot(), CuttingCoefficients(8e8, 2e8), modes)
    found = mode_coupling(problem)
    assert np.isfinite(found.depth) and 18 < found.frequency < 26
    k = np.diag((2 * np.pi * modes.frequency) ** 2)
    turn = modes.shape.T @ (found.depth * problem.mean_matrix) @ modes.shape
    c = np.diag(2 * 0.01 * 2 * np.pi * modes.frequency)
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-k - turn, -c]])
    assert np.linalg.eigvals(state).real.max() == pytest.approx(0, abs=1e-6)
    assert np.isinf(mode_coupling(benchmark(Engagement.slot())).depth)


def test_mode_coupling_of_a_given_force_direction_is_flutter() -> None:
    """Two modes of equal decay rate, force 60 degrees off the chip: the roots of the undamped pair meet where
    S^2 = 4 P, S = w1^2 + w2^2 + w K_f (a1 + a2), P = w1^2 w2^2 + w K_f (a1 w2^2 + a2 w1^2), a_i = (n.u_i)(u_i.f)."""
    turn = np.radians(35)
    ways = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    modes = Modes([20.0, 22.0], [1e-6, 1e-6 * 20 / 22], ways / np.sqrt(50.0), ("tool:+x", "tool:+y"))
    normal, force = np.array([1.0, 0, 0]), np.array([np.cos(np.pi / 3), np.sin(np.pi / 3), 0])
    found = [mode_coupling(TurningProblem(KF, orient(modes, {"x": "tool:+x", "y": "tool:+y"}, normal, force=way)), 0.01)
             for way in (force, normal)]
    w2 = (2 * np.pi * modes.frequency) ** 2
    a = (normal[:2] @ modes.shape) * (force[:2] @ modes.shape)
    total, cross = a.sum(), a @ w2[::-1]
    roots = np.roots([total**2, 2 * w2.sum() * total - 4 * cross, w2.sum() ** 2 - 4 * w2.prod()])
    least = min(root.real for root in roots if abs(root.imag) < 1e-9 * abs(root) and root.real > 0) / KF
    assert found[0].depth == pytest.approx(least, rel=1e-4)
    assert np.isinf(found[1].depth)  # a force along the chip's normal draws no energy from two modes


def test_tool_against_work() -> None:
    """Modes of tool and work together give what a problem with all of them gives."""
    problem = altintas()
    x, y = problem.dynamics  # type: ignore[misc]
    tool = plane_dynamics((x, modes_of([9e4], [0.5], [1e14], "tool:+y")))
    work = plane_dynamics((modes_of([9e4], [0.5], [1e14], "work:+x"), y))
    both = against(tool, work)
    f = np.linspace(100, 2000, 7)
    assert both.response(f) == pytest.approx(problem.plane.response(f), abs=1e-13)
    assert stability.chart(problem.changed(dynamics=(x, y)), [9500.0], depth_max=0.002).limit[0] == pytest.approx(
        0.913067e-3, rel=1e-6)
