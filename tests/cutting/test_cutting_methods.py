"""The other stability methods: each shows its own known error; collocation is exact and general."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import ToolpointError
from toolpoint.cutting import (
    Collocation,
    Engagement,
    FloquetDeterminant,
    FullDiscretization,
    MultiFrequency,
    SemiDiscretization,
    SpeedVariation,
    Tool,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.cut.coefficients import chip_direction, force_direction
from toolpoint.cutting.stability.floquet.method import Frozen
from toolpoint.vibration import frequency_response

# |mu| of the 1-DOF slot at 5000 rev/min for depths in mm, converged (not the 200-interval values of the literature).
MULTIPLIERS = {0.2: 0.8197427843, 0.5: 1.0739755867, 0.7: 1.2215561357, 1.0: 1.4064735254}


@pytest.mark.parametrize("depth", MULTIPLIERS)
def test_multipliers_of_the_slot(depth: float) -> None:
    """Collocation gives the converged multipliers to 1e-8."""
    got = np.abs(Collocation().multipliers(benchmark(Engagement.slot()), 5000.0, 1e-3 * depth)[0])
    assert got == pytest.approx(MULTIPLIERS[depth], abs=1e-8)


@pytest.mark.parametrize("method", [lambda n: SemiDiscretization(0, n), lambda n: SemiDiscretization(1, n),
                                    lambda n: FullDiscretization(n)])
def test_step_methods_are_second_order(method) -> None:  # type: ignore[no-untyped-def]
    """Halving the interval divides the error of the multiplier by four."""
    problem = benchmark(Engagement.slot())
    error = [abs(np.abs(method(n).multipliers(problem, 5000.0, 0.5e-3)[0]) - MULTIPLIERS[0.5]) for n in (60, 120)]
    assert np.log2(error[0] / error[1]) == pytest.approx(2, abs=0.15)


def test_forty_intervals_overpredict_as_known() -> None:
    """40-interval semi-discretization overpredicts the depth by up to 8 % on the 2-DOF benchmark."""
    problem = benchmark(Engagement.down(0.05), 2)
    limit = stability.chart(problem, [5000.0], SemiDiscretization(levels=4, tolerance=1e-3), depth_max=0.004).limit[0]
    assert 1.06 < limit / 1.843802e-3 < 1.09


def test_multi_frequency_closes_in_on_the_converged_value() -> None:
    """More harmonics come closer; with a constant matrix none are needed."""
    problem = benchmark(Engagement.down(0.05), 2)
    error = [abs(stability.chart(problem, [10000.0], MultiFrequency(h, 60), depth_max=0.004).limit[0] / 1.486950e-3 - 1)
             for h in (1, 6)]
    assert error[1] < 1e-3 and error[1] < 0.3 * error[0]


def test_multi_frequency_finds_islands_and_its_points_are_eigenvalues() -> None:
    """The re-stable interval with enough harmonics; each point is a real eigenvalue of the Hill matrix built here again."""
    problem = benchmark(Engagement.down(0.5))
    bands = 1e3 * stability.chart(problem, [17500.0], MultiFrequency(30)).intervals(0)
    assert bands == pytest.approx(np.array([[0, 1.088426], [2.026046, 2.152617]]), rel=2e-3)
    problem = altintas()
    chart = stability.chart(problem, [9500.0], MultiFrequency(2), depth_max=0.002)
    plane, period = problem.plane, float(problem.tooth_period(9500.0))
    top = int(np.ceil(plane.span[1] * period)) + 2
    x, weight = np.polynomial.legendre.leggauss(200)
    phi = problem.engagement.entry + (1 + x) * problem.engagement.arc / 2
    weight = weight * problem.engagement.arc / 2 / np.pi
    matrix = force_direction(problem.coefficients, phi)[:, :, None] * chip_direction(phi)[:, None, :]
    w, theta = chart.limit[0], chart.theta[chart.limit_points()[0]]
    q = np.arange(-top, top + 1)
    shift = q[:, None] - q[None, :]
    wave = np.exp(-2j * shift[..., None] * (phi - problem.engagement.entry)) * weight
    f = (theta / (2 * np.pi) + q) / period
    g = np.where((f < 0)[:, None, None], plane.response(np.abs(f)).conj(), plane.response(np.abs(f)))
    hill = np.einsum("pqn,nab,qbc->paqc", wave, matrix, g).reshape(2 * q.size, 2 * q.size)
    values = np.linalg.eigvals(-(1 - np.exp(-1j * theta)) * hill)
    assert np.abs(values - 1 / w).min() < 1e-8 / w


def test_collocation_finds_the_boundary() -> None:
    """The general method's chart agrees with the converged depth and type."""
    chart = stability.chart(altintas(), [9500.0], Collocation(levels=6), depth_max=0.0015)
    assert 1e3 * chart.limit[0] == pytest.approx(0.913067, rel=1e-4)
    assert chart.kind[0] == "Hopf"


def test_equal_pitch_given_as_unequal_has_powers_of_the_same_multipliers() -> None:
    """Over a spindle turn the multipliers are the N-th powers of those over a tooth period."""
    for teeth in (2, 4):
        even = benchmark(Engagement.slot(), 2, tool=Tool(0.02, teeth))
        shift = 1e-10 * (-1.0) ** np.arange(teeth)
        uneven = even.changed(tool=Tool(0.02, teeth, pitch=2 * np.pi / teeth + shift))
        a = np.abs(Collocation().multipliers(even, 12500.0, 0.1e-3)[0]) ** teeth
        b = np.abs(Collocation().multipliers(uneven, 12500.0, 0.1e-3)[0])
        assert b == pytest.approx(a, rel=1e-7)


def test_helix_of_one_axial_pitch_makes_the_single_frequency_solution_exact() -> None:
    """With depth = pi D/(N tan helix) the coefficient is constant: ZeroOrder's limit is the default engine's to 1e-9."""
    problem = benchmark(Engagement.down(0.3), 2)
    limit = stability.chart(problem, [9000.0], ZeroOrder(), depth_max=0.002).limit[0]
    tool = Tool(0.02, 2)
    # An angle beyond any real tool's, but the law holds for it.
    object.__setattr__(tool, "helix", np.full(2, np.arctan(np.pi * 0.02 / (2 * limit))))
    frozen = Frozen(FloquetDeterminant(tolerance=1e-9), problem.changed(tool=tool), 9000.0)
    assert frozen(limit, 9000.0, 1.3 * limit)[0, 0] == pytest.approx(limit, rel=1e-9)


def test_helical_boundary_is_one_of_the_general_method() -> None:
    """Both engines' limit of a helical tool has a multiplier on the unit circle by sliced collocation."""
    problem = benchmark(Engagement.down(0.3), 2, tool=Tool(0.01, 3, helix=np.radians(35)))
    chart = stability.chart(problem, [15000.0], FloquetDeterminant(), depth_max=0.001)
    assert chart.method == "FloquetDeterminant" and np.isfinite(chart.limit[0])
    default = stability.chart(problem, [15000.0], depth_max=0.001)
    assert default.method == "PanelArnoldi" and default.limit == pytest.approx(chart.limit, rel=1e-7)
    mu = np.abs(Collocation(nodes=6, slices=6).multipliers(problem, 15000.0, chart.limit[0]))
    assert mu[0] == pytest.approx(1, abs=1e-5)
    straight = stability.chart(problem.changed(tool=Tool(0.01, 3)), [15000.0], depth_max=0.001).limit[0]
    assert abs(chart.limit[0] / straight - 1) > 1e-3


def test_determinant_of_the_monodromy_without_delay() -> None:
    """Depth zero: the multipliers are those of the structure, their product exp(-2 sum zeta w T)."""
    problem = random_problem(np.random.default_rng(5), modes=2)
    mu = Collocation().multipliers(problem, 8000.0, 1e-30)
    t = float(problem.tooth_period(8000.0))
    poles = np.concatenate([problem.plane.poles, problem.plane.poles.conj()])
    assert np.sort(np.abs(mu[:4])) == pytest.approx(np.sort(np.abs(np.exp(poles * t))), rel=1e-9)


def test_process_damping_raises_the_limit_at_low_speed() -> None:
    """Process damping stabilises; without it the general method equals the default."""
    problem = benchmark(Engagement.slot())
    plain = stability.chart(problem, [5000.0], depth_max=0.001).limit[0]
    same = stability.chart(problem, [5000.0], Collocation(levels=4), depth_max=0.001).limit[0]
    damped = stability.chart(problem.changed(process_damping=2e5), [5000.0], Collocation(levels=4), depth_max=0.001).limit[0]
    assert same == pytest.approx(plain, rel=1e-5)
    assert damped > 1.02 * plain


def test_speed_variation_of_no_amplitude_and_its_phase() -> None:
    """Without amplitude: powers of the constant speed's multipliers; the variation's phase changes no multiplier."""
    problem = benchmark(Engagement.slot(), tool=Tool(0.02, 2))
    method = Collocation(nodes=8)
    constant = np.abs(method.multipliers(problem, 9000.0, 0.3e-3)[0]) ** 4
    same = np.abs(method.multipliers(problem.changed(speed_variation=SpeedVariation(1e-12, 2)), 9000.0, 0.3e-3)[0])
    assert same == pytest.approx(constant, rel=1e-7)
    varied = [np.abs(method.multipliers(problem.changed(speed_variation=SpeedVariation(0.2, 2, g)), 9000.0, 0.3e-3)[:2])
              for g in (0.0, np.pi)]
    assert varied[1] == pytest.approx(varied[0], rel=1e-6) and abs(varied[0][0] / constant - 1) > 1e-2
    angle = np.linspace(0, 30, 3001)
    clock = SpeedVariation(0.5, 3, 0.4).clock(angle, 100.0)
    rate = 1 / (100 * SpeedVariation(0.5, 3, 0.4).factor((angle[1:] + angle[:-1]) / 2))
    assert np.diff(clock) / np.diff(angle) == pytest.approx(rate, rel=1e-5)
    with pytest.raises(ToolpointError, match="Collocation"):
        stability.chart(problem.changed(speed_variation=SpeedVariation(0.2)), [9000.0], FloquetDeterminant())


def test_methods_refuse_what_they_cannot_do() -> None:
    """A measured FRF has no multipliers; unequal pitch has no single tooth period."""
    problem = benchmark(Engagement.slot())
    frf = frequency_response.modal(problem.dynamics, np.arange(1.0, 8000))  # type: ignore[arg-type]
    with pytest.raises(ToolpointError, match="identify modes"):
        stability.chart(problem.changed(dynamics=frf), [5000.0], SemiDiscretization())
    with pytest.raises(ToolpointError, match="Collocation"):
        stability.chart(problem.changed(tool=Tool(0.02, 2, pitch=[3.0, 2 * np.pi - 3])), [5000.0], SemiDiscretization())
