"""Devices at a machine: exact against the assembled system, the loop's verdict against its roots, gains of depth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.cutting import ZeroOrder, stability
from toolpoint.studies.finite_elements.active_damper import ProofMassActuator, loop_margins, open_loop, tune_gain
from toolpoint.studies.finite_elements.attached import damper_stiffness, fitting_place
from toolpoint.studies.finite_elements.machine_cut import (
    EXAMPLE_FACE_MILL,
    PLANE,
    cut_limit,
    face_problem,
    least_depth,
    mean_factors,
    plane_response,
    response_lines,
)
from toolpoint.studies.finite_elements.tuned_damper import tune_damper, tune_damper_for_cut
from toolpoint.vibration import Dof, Modes, SecondOrderSystem, frequency_response

HEAD = Dof("head", "+x")
# Two modes, a soft one along x and a stiffer one that leans; unit modal mass.
MODES = Modes([40.0, 70.0], [0.02, 0.015], np.array([[0.03, 0.012], [0.004, 0.025], [0.028, 0.010]]), (*PLANE, HEAD))
LINES = np.unique(np.concatenate([np.geomspace(0.05, 20000, 6000), np.linspace(30, 90, 3000)]))
CUT = EXAMPLE_FACE_MILL


def one_mode(frequency=40.0, ratio=0.01, shape=0.03):
    return Modes([frequency], [ratio], np.array([[shape], [0.0], [shape]]), (*PLANE, HEAD))


def test_a_device_is_exactly_the_assembled_system():
    """Two modes and a sprung mass as three coordinates, solved directly."""
    m, own, ratio = 5.0, 2 * np.pi * 38, 0.1
    at = fitting_place(MODES, HEAD, LINES)
    phi = MODES.shape
    base = np.append(phi[2], -1.0)
    mass, k = np.diag([1, 1, m]), np.diag([*MODES.omega**2, 0.0])
    c = np.diag([*(2 * MODES.damping_ratio * MODES.omega), 0.0])
    k = k + m * own**2 * np.outer(base, base)
    c = c + 2 * m * ratio * own * np.outer(base, base)
    out = np.hstack([phi[:2], np.zeros((2, 1))])
    system = SecondOrderSystem(mass, k, c, output_map=out, input_map=out.T, outputs=PLANE, inputs=PLANE)
    direct = frequency_response.direct(system, LINES).values
    assert np.allclose(at.with_device(damper_stiffness(at.omega, m, own, ratio=ratio)), direct, rtol=1e-9, atol=0)


def test_velocity_feedback_damps_like_a_damper_to_the_ground():
    """Own frequency far below, no delay: g adds to the damper of the mode, so the peak is 1 / (w (2 z w / phi^2 + g))."""
    modes = one_mode()
    at = fitting_place(modes, HEAD, LINES)
    ideal = ProofMassActuator(20.0, 0.2, 0.5, delay=0.0, bandwidth=1e6, high_pass=0.0)
    g, w = 3000.0, float(modes.omega[0])
    active = at.with_device(ideal.passive(at.omega) + g * ideal.active(at.omega))[:, 0, 0]
    total = 2 * 0.01 * w / 0.03**2 + g
    near = np.abs(LINES - 40) < 5
    assert np.abs(active[near]).max() == pytest.approx(1 / (w * total), rel=0.01)


def roots(modes, actuator, gain):
    """Characteristic roots of one mode with actuator, low-pass and high-pass, no delay."""
    w, z, phi = float(modes.omega[0]), float(modes.damping_ratio[0]), float(modes.shape[2, 0])
    own, m = 2 * np.pi * actuator.frequency, actuator.mass
    structure = np.poly1d([1, 2 * z * w, w**2]) / phi**2
    spring = m * np.poly1d([2 * actuator.damping_ratio * own, own**2])
    sprung = np.poly1d([m, 0, 0]) + spring
    low, high = np.poly1d([1 / (2 * np.pi * actuator.bandwidth), 1]), np.poly1d([1, 2 * np.pi * actuator.high_pass])
    square = np.poly1d([m, 0, 0])
    return (sprung * structure * low * high + square * spring * low * high
            + gain * square * np.poly1d([1, 0]) * np.poly1d([1, 0])).roots


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.floats(0.1, 3.0), st.floats(4.0, 20.0), st.floats(0.1, 0.8), st.floats(5.0, 40.0))
def test_the_verdict_of_the_loop_is_that_of_its_roots(share, own, ratio, mass):
    modes = one_mode()
    actuator = ProofMassActuator(mass, own, ratio, delay=0.0, bandwidth=800.0, high_pass=0.5)
    at = fitting_place(modes, HEAD, LINES)
    limit = tune_gain(at, actuator, factors=mean_factors(face_problem(plane_response(modes, LINES), CUT))).largest_gain
    if abs(share - 1) < 0.02:
        return
    gain = share * limit
    stable = roots(modes, actuator, gain).real.max() < 0
    assert stable == (share < 1) == loop_margins(gain * open_loop(at, actuator)).is_stable


def test_a_delay_costs_margin():
    at = fitting_place(one_mode(), HEAD, LINES)
    loops = [open_loop(at, ProofMassActuator(20.0, delay=tau)) for tau in (0.0, 2e-3)]
    factors = mean_factors(face_problem(plane_response(one_mode(), LINES), CUT))
    gains = [tune_gain(at, ProofMassActuator(20.0, delay=tau), factors=factors) for tau in (0.0, 2e-3)]
    assert gains[1].largest_gain < gains[0].largest_gain and len(loops[0]) == len(LINES)
    for result in gains:
        assert result.margins.is_stable and result.margins.distance >= 0.5 - 1e-6
        assert result.depths[2] >= result.depths[1] - 1e-12 and result.depths[2] > 1.2 * result.depths[0]
        assert result.peaks[2] < result.peaks[0]


def test_lines_too_far_apart_are_refused():
    with pytest.raises(ToolpointError, match=r"Hz apart at mode 1, whose half-power width is 0.8 Hz"):
        fitting_place(one_mode(), HEAD, np.geomspace(0.05, 20000, 60))
    at = fitting_place(one_mode(), HEAD, np.linspace(0.1, 20000.1, 60000))
    with pytest.raises(ToolpointError, match="turns by"):
        loop_margins(1e6 * open_loop(at, ProofMassActuator(20.0)))
    with pytest.raises(ToolpointError, match="at an end of its lines"):
        loop_margins(np.ones(5, complex))


@pytest.mark.slow
def test_least_depth_is_the_lowest_point_of_all_lobes():
    lines = response_lines(MODES.frequency, CUT)
    response = plane_response(MODES, lines)
    problem = face_problem(response, CUT)
    least, frequency = least_depth(response.values, mean_factors(problem), lines)
    chart = stability.chart(problem, np.linspace(60, 160, 4000), ZeroOrder(), depth_max=3 * least)
    assert least <= chart.limit.min() * (1 + 1e-6) and chart.limit.min() == pytest.approx(least, rel=2e-3)
    assert cut_limit(response, CUT).depth == least and 30 < frequency < 90


def test_damper_for_a_cut_is_no_worse_than_those_for_other_goals():
    lines = response_lines(MODES.frequency, CUT)
    factors = mean_factors(face_problem(plane_response(MODES, lines), CUT))
    at = fitting_place(MODES, HEAD, lines)
    best = tune_damper_for_cut(MODES, HEAD, 20.0, lines=lines, factors=factors)
    assert best.goal == "lobes" and best.depths is not None and best.depth_ratio > 1.1
    for goal in ("peak", "depth"):
        other = tune_damper(MODES, str(PLANE[0]), HEAD, mass=20.0, lines=lines, goal=goal)
        z = damper_stiffness(at.omega, 20.0, 2 * np.pi * other.frequency, ratio=other.damping_ratio)
        assert best.depths[1] >= least_depth(at.with_device(z), factors, lines)[0] * (1 - 1e-9)
    for f, ratio in ((1.02, 1), (0.98, 1), (1, 1.05), (1, 0.95)):
        z = damper_stiffness(at.omega, 20.0, 2 * np.pi * f * best.frequency, ratio=ratio * best.damping_ratio)
        assert least_depth(at.with_device(z), factors, lines)[0] <= best.depths[1] * (1 + 1e-6), "an optimum"
