"""ZeroOrder: published single-frequency values, the constant-coefficient case, and a count of encirclements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import Frf, Modes
from toolpoint.cutting import Engagement, MillingProblem, Tool, TurningProblem, ZeroOrder, stability
from toolpoint.vibration import frequency_response

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "tool_holder_frf" / "Point_1_Channel_1_CH1.txt"


def test_single_frequency_values_of_the_two_tooth_cutter() -> None:
    """The single-frequency critical depths of the Altintas cutter, 5 digits as given in the reference values."""
    chart = stability.chart(altintas(), [3000, 6000, 9500, 14000, 16000], ZeroOrder())
    assert 1e3 * chart.limit == pytest.approx([1.0303, 1.6154, 0.9644, 4.6197, 1.0396], abs=6e-5)
    assert any("known" in note or "usual error" in note for note in chart.notes)


def test_a_measured_frf_gives_the_same_as_its_modes() -> None:
    """A fine FRF of the modes gives the modes' depths."""
    f = np.arange(50.0, 4000.0, 0.25)
    problem = altintas()
    x, y = (frequency_response.modal(m, f) for m in problem.dynamics)  # type: ignore[union-attr]
    measured = problem.changed(dynamics=(x, y))
    speeds = np.array([3000.0, 9500, 16000])
    got = stability.chart(measured, speeds, ZeroOrder()).limit
    assert got == pytest.approx(stability.chart(problem, speeds, ZeroOrder()).limit, rel=2e-4)


@pytest.mark.parametrize("spacing", [1.0, 6.0, 13.0])
def test_limits_on_lines_state_what_their_spacing_leaves_open(spacing: float) -> None:
    """Milling and turning on the lines of known modes, resonances 12 Hz wide at the half width: within the stated error."""
    modes = Modes([600.0, 850.0], [0.02, 0.025], 1.4 * np.eye(2), ("tool:+x", "tool:+y"))
    frf = frequency_response.modal(modes, np.arange(100.0, 2000.0, spacing))
    speeds = np.linspace(2500.0, 14000.0, 40)
    for make in (lambda dynamics: benchmark(Engagement.down(0.5), 2).changed(dynamics=dynamics),
                 lambda dynamics: TurningProblem(1e9, dynamics)):
        true = stability.chart(make(modes), speeds, ZeroOrder(), depth_max=0.02)
        chart = stability.chart(make(frf), speeds, ZeroOrder(), depth_max=0.02)
        limited = np.isfinite(true.limit) & np.isfinite(chart.limit)
        assert limited.sum() > 10
        off = np.abs(chart.limit[limited] / true.limit[limited] - 1)
        stated = chart.limit_error[limited] / true.limit[limited]
        assert (off <= stated + 1e-6).mean() > 0.97 and np.median(stated) < 0.2, (off, stated)
        assert spacing < 5 or off.max() > 1e-4  # where nothing is stated, the test fails


@pytest.mark.slow
def test_turning_lobes_follow_tlusty() -> None:
    """Orthogonal cut: the least limit over all speeds is 2 k z (1 + z)/K_f; process damping raises z to z_e.

    Tlusty; process damping b_min = 2 k z_e (1 + z_e)/K_f, z_e = z + C b/(2 v sqrt(k m)), speed constant.
    """
    m, k, z = 1.0, 1e7, 0.03
    modes = Modes([np.sqrt(k / m) / (2 * np.pi)], [z], np.array([[1 / np.sqrt(m)]]), ("tool:+x",))
    speeds = np.linspace(2000, 3300, 4001)
    limit = stability.chart(TurningProblem(1e9, modes), speeds, depth_max=0.01).limit
    assert limit.min() == pytest.approx(2 * k * z * (1 + z) / 1e9, rel=1e-5)
    c, v = 2e4, 1.0
    damped = TurningProblem(1e9, modes, process_damping=c, cutting_speed=v)
    b = 2 * k * z * (1 + z) / 1e9
    for _ in range(200):
        ze = z + c * b / (2 * v * np.sqrt(k * m))
        b = 2 * k * ze * (1 + ze) / 1e9
    got = stability.chart(damped, np.linspace(2000, 3300, 401), depth_max=0.05).limit.min()
    assert got == pytest.approx(b, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_interval_count_agrees_with_encirclements(seed: int) -> None:
    """The signed crossings give the same number of unstable roots as the winding of det(I + w(1 - e^{-iwT}) A G)."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, modes=3)
    speed = rng.uniform(4000, 15000)
    depths = np.linspace(0, 0.01, 7)[1:]
    chart = stability.chart(problem, [speed], ZeroOrder(), depth_max=0.01)
    f = np.concatenate([[0.0], np.arange(0.02, 9000, 0.02)])
    t = float(problem.tooth_period(speed))
    for w, counted in zip(depths, chart.unstable_count(depths)[0], strict=True):
        delay = (1 - np.exp(-2j * np.pi * f * t))[:, None, None]
        matrix = w * delay * (problem.mean_matrix @ problem.plane.response(f))
        total = np.unwrap(np.angle(np.linalg.det(np.eye(2) + matrix)))
        assert -round((total[-1] - total[0]) / np.pi) == counted


def test_a_tool_point_measurement_gives_lobes() -> None:
    """Lobes straight from a measured tool-point receptance, one direction taken for both."""
    if not DATA.exists():
        pytest.skip("measured data ../shared/data/tool_holder_frf is not beside the project")
    rows = np.loadtxt(DATA)
    rows = rows[rows[:, 0] >= 200]
    frf = Frf(rows[:, 0], (rows[:, 1] + 1j * rows[:, 2])[:, None, None], ("tool:+x",), ("tool:+x",))
    problem = MillingProblem(Tool(0.016, 4), Engagement.slot(), altintas().coefficients, frf, y="same")
    chart = stability.chart(problem, np.linspace(3000, 20000, 300), ZeroOrder(), depth_max=0.02)
    assert np.isfinite(chart.limit).mean() > 0.9
    assert (chart.frequency > 200).all() and (chart.error >= 0).all()


def test_rotating_structure_and_cut_changes_nothing_for_a_full_cut_of_an_isotropic_tool() -> None:
    """An isotropic structure has the same limit for every feed direction."""
    problem = benchmark(Engagement.down(0.3), 2)
    speeds = np.linspace(5000, 20000, 9)
    first = stability.chart(problem, speeds, ZeroOrder()).limit
    again = stability.chart(problem.at_feed_angle(0.7), speeds, ZeroOrder()).limit
    assert again == pytest.approx(first, rel=1e-9)
