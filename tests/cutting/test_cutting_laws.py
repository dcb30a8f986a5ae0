"""The laws of cutting, asked of every stability method that takes the case."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import benchmark
from toolpoint import Modes, ToolpointError
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    MillingProblem,
    SpeedVariation,
    Tool,
    TurningProblem,
    stability,
)
from toolpoint.cutting.stability import METHODS, StabilityMethod
from toolpoint.vibration import frequency_response

# Settings under which a method's own search or nodes do not hide the law; the others have none to tighten.
TIGHT = {"floquet": {"tolerance": 1e-10}, "collocation": {"levels": 6, "tolerance": 1e-12, "slices": 12},
         "semi-discretization": {"levels": 6, "tolerance": 1e-12}, "full-discretization": {"levels": 6, "tolerance": 1e-12},
         "panel": {"nodes": 6, "tolerance": 1e-8}}
HELICAL = [pytest.param(name, marks=pytest.mark.slow) if name in ("collocation", "floquet") else name for name in METHODS]
SPEED, DEEPEST = 6000.0, 0.01


def three_modes() -> MillingProblem:
    """Three modes in any direction of the plane, three straight teeth."""
    f, k = np.array([600.0, 900, 1400]), np.array([4e6, 6e6, 9e6])
    way = np.array([[0.8, -0.5, 0.3], [0.4, 0.8, -0.6]])
    modes = Modes(f, np.array([0.03, 0.02, 0.04]), 2 * np.pi * f / np.sqrt(k) * way, ("tool:+x", "tool:+y"))
    return MillingProblem(Tool(0.016, 3), Engagement.down(0.4), CuttingCoefficients(9e8, 3e8), modes)


def method_for(name: str, *problems: stability.Problem) -> StabilityMethod:
    """The method with tight settings; the test is skipped where the method refuses one of the problems."""
    method = METHODS[name](**TIGHT.get(name, {}))
    reasons = [reason for problem in problems if (reason := method.refuses(problem))]
    if reasons:
        pytest.skip(f"refused: {reasons[0]}")
    return method


def limit_of(method: StabilityMethod, problem: MillingProblem, speed: float, depth_max: float) -> float:
    """The limit at one speed, m, which must lie within the range."""
    limit = stability.chart(problem, np.array([speed]), method, depth_max=depth_max).limit[0]
    assert 0 < limit < depth_max
    return float(limit)


@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_up_and_down_milling_of_equal_arc(name: str) -> None:
    """A structure alike in x and y: down-milling is up-milling with time reversed, with the same multipliers.

    The step methods hold the delayed vibration from the past on, so time reversed they are another method: second order in
    their 40 intervals, 2 %.
    """
    problem = benchmark(Engagement.down(0.3), 2)
    method = method_for(name, problem)
    down = limit_of(method, problem, 9000.0, 0.002)
    up = limit_of(method, problem.changed(engagement=Engagement.up(0.3)), 9000.0, 0.002)
    assert up == pytest.approx(down, rel=2e-2 if "discretization" in name else 1e-9)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.default_cases(4)
def test_structure_and_feed_turned_together(name: str) -> None:
    """Modes in any direction of the plane, turned, and cut along the turned feed: the same limit by every method."""
    problem = three_modes()
    method = method_for(name, problem)
    modes, angle = problem.dynamics, 0.8
    c, s = np.cos(angle), np.sin(angle)
    turned = Modes(modes.frequency, modes.damping_ratio, np.array([[c, -s], [s, c]]) @ modes.shape, modes.dofs)
    first = limit_of(method, problem, SPEED, DEEPEST)
    again = limit_of(method, problem.changed(dynamics=turned, feed_angle=angle), SPEED, DEEPEST)
    assert again == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.default_cases(4)
def test_the_feed_reversed(name: str) -> None:
    """The cutting plane turned by 180 degrees: response and force change sign together, the limit stays."""
    problem = three_modes()
    method = method_for(name, problem)
    first = limit_of(method, problem, SPEED, DEEPEST)
    assert limit_of(method, problem.at_feed_angle(np.pi), SPEED, DEEPEST) == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.default_cases(4)
def test_twice_the_force_is_half_the_depth(name: str) -> None:
    """Straight edges: force is the product of coefficients and depth, so the limit goes with one over the coefficients."""
    problem = three_modes()
    method = method_for(name, problem)
    material = problem.coefficients
    harder = problem.changed(coefficients=type(material)(2 * material.kt, 2 * material.kn))
    first = limit_of(method, problem, SPEED, DEEPEST)
    assert 2 * limit_of(method, harder, SPEED, DEEPEST) == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize("name", HELICAL)
@pytest.mark.default_cases(4)
def test_helix_of_one_axial_pitch(name: str) -> None:
    """Depth pi D/(N tan helix): the matrix is constant, and the single-frequency limit is a boundary of every method.

    Collocation cuts the edge into slices, here 12: 1e-3; the others integrate along it.
    """
    problem = benchmark(Engagement.down(0.3), 2)
    limit = stability.chart(problem, [9000.0], METHODS["zero-order"](), depth_max=0.002).limit[0]
    tool = Tool(0.02, 2)
    # An angle beyond any real tool's, but the law holds for it.
    object.__setattr__(tool, "helix", np.full(2, np.arctan(np.pi * 0.02 / (2 * limit))))
    helical = problem.changed(tool=tool)
    method = method_for(name, helical)
    depths = stability.chart(helical, [9000.0], method, depth_max=1.5 * limit).depth
    assert np.abs(depths / limit - 1).min() < (1e-3 if name == "collocation" else 1e-8)


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.default_cases(4)
def test_pitch_that_becomes_equal(name: str) -> None:
    """Over a revolution the multipliers of equal pitch are the N-th powers of a tooth period's: the limit is the same."""
    problem = benchmark(Engagement.slot(), 2, tool=Tool(0.02, 4))
    nearly = problem.changed(tool=Tool(0.02, 4, pitch=np.pi / 2 + 1e-10 * np.array([1, -1, 0.5, -0.5])))
    method = method_for(name, problem, nearly)
    regular = limit_of(method, problem, 9000.0, 0.0005)
    assert limit_of(method, nearly, 9000.0, 0.0005) == pytest.approx(regular, rel=1e-8)


@pytest.mark.parametrize("name", METHODS)
def test_what_a_method_says_is_what_it_does(name: str) -> None:
    """A reason is given where, and only where, the chart is refused; a measured FRF where the method needs modes."""
    method = METHODS[name]()
    plain = benchmark(Engagement.down(0.3), 2)
    frf = frequency_response.modal(plain.dynamics, np.arange(2.0, 4000, 2))
    uneven = Tool(0.02, 2, pitch=[3.0, 2 * np.pi - 3])
    cases = (plain, plain.changed(tool=uneven), plain.changed(process_damping=1e4), TurningProblem(1e9, plain.dynamics),
             plain.changed(speed_variation=SpeedVariation(0.1)), plain.changed(dynamics=frf),
             plain.changed(tool=Tool(0.02, 2, corner_radius=0.003)))
    assert METHODS[name].name == name
    assert not method.needs_modes or method.refuses(plain.changed(dynamics=frf))
    for problem in cases:
        reason = method.refuses(problem)
        if reason is None:
            continue
        with pytest.raises(ToolpointError) as error:
            stability.chart(problem, [9000.0], method, depth_max=0.001)
        assert str(error.value) == f"problem: {reason}"


def test_a_method_that_is_not_there() -> None:
    """The error lists all methods and suggests the nearest."""
    with pytest.raises(ToolpointError, match=r"auto, floquet, panel.*did you mean 'collocation'"):
        stability.method_named("colocation")
