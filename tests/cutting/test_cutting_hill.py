"""HillDeterminant: measured FRFs with every tool, against the other engines, converged collocation and the laws."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from cutting.cutting_cases import altintas, benchmark, random_problem
from toolpoint import Modes, ToolpointError, ToolpointWarning
from toolpoint.cutting import (
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    SpeedVariation,
    Tool,
    TurningProblem,
    ZeroOrder,
    stability,
)
from toolpoint.cutting.cut.coefficients import edge_matrix
from toolpoint.cutting.cut.problem import coverage
from toolpoint.cutting.stability.hill.fourier import hill_cut
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.hill.system import _null_vectors
from toolpoint.vibration import frequency_response

KINDS = ("pitch", "helix", "unequal helix", "both", "damping", "corner", "ball", "helical ball")


def measured(problem: MillingProblem, f: np.ndarray) -> MillingProblem:
    """The same cut with the receptance of its modes at these lines."""
    parts = problem.dynamics if isinstance(problem.dynamics, tuple) else (problem.dynamics,)
    frfs = tuple(frequency_response.modal(part, f) for part in parts)  # type: ignore[arg-type]
    return problem.changed(dynamics=frfs if len(frfs) == 2 else frfs[0])


def general(kind: str, problem: MillingProblem | None = None) -> MillingProblem:
    """A cut that FloquetDeterminant does not solve."""
    problem = altintas() if problem is None else problem
    uneven = np.radians([110.0, 127, 123])
    tool = {"pitch": Tool(0.0254, 3, pitch=uneven), "helix": Tool(0.0254, 3, helix=0.6),
            "unequal helix": Tool(0.0254, 3, helix=[0.5, 0.6, 0.68]), "both": Tool(0.0254, 3, pitch=uneven, helix=0.5),
            "damping": Tool(0.0254, 3), "corner": Tool(0.0254, 3, corner_radius=0.003),
            "ball": Tool(0.0254, 3, corner_radius=0.0127),
            "helical ball": Tool(0.0254, 3, corner_radius=0.0127, helix=[0.4, 0.5, 0.6])}[kind]
    return problem.changed(tool=tool, process_damping=2e4 if kind == "damping" else 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_measured_frf_has_the_limits_of_its_modes(kind: str) -> None:
    """Receptance to 6 kHz of a structure below 1.5 kHz: PanelArnoldi's limits on the modes, within the stated error."""
    problem = general(kind)
    speeds = [9500.0]
    truth = stability.chart(problem, speeds, PanelArnoldi(), depth_max=0.004)
    chart = stability.chart(measured(problem, np.arange(0.5, 6000, 0.5)), speeds, HillDeterminant(), depth_max=0.004)
    at = chart.limit_points()
    assert np.isfinite(truth.limit).all() and chart.status == "complete"
    assert (np.abs(chart.limit - truth.limit) <= chart.error[at]).all()
    assert chart.limit == pytest.approx(truth.limit, rel=2e-3 if kind == "damping" else 1e-4)
    assert chart.frequency[at] == pytest.approx(truth.frequency[truth.limit_points()], rel=1e-3)


def test_equal_pitch_reproduces_the_exact_engine_on_the_same_frf() -> None:
    """Straight teeth of equal pitch: FloquetDeterminant's limits on the same lines."""
    problem, speeds = measured(altintas(), np.arange(0.25, 8000, 0.25)), [9500.0, 14000]
    exact = stability.chart(problem, speeds, FloquetDeterminant(), depth_max=0.006).limit
    assert stability.chart(problem, speeds, HillDeterminant(), depth_max=0.006).limit == pytest.approx(exact, rel=1e-5)


@pytest.mark.slow
def test_the_two_tooth_cutter_and_the_restable_band() -> None:
    """Modes: converged depths of the literature's cutter, and the stable interval above an unstable one."""
    chart = stability.chart(altintas(), [3000.0, 6000, 9500, 14000, 16000], HillDeterminant(reach=5))
    assert 1e3 * chart.limit == pytest.approx([0.959639, 1.842816, 0.913067, 4.954111, 0.992489], rel=1e-5)
    chart = stability.chart(benchmark(Engagement.down(0.5)), [17500.0], HillDeterminant(reach=20))
    assert 1e3 * chart.intervals(0) == pytest.approx(np.array([[0, 1.088426], [2.026046, 2.152617]]), rel=1e-5)
    assert chart.kind[0] == "flip"


@pytest.mark.slow
def test_pitch_that_becomes_equal() -> None:
    """Over a revolution the determinant of equal pitch is the product of those over the tooth periods: the same limits, the
    angle of the multiplier four times that of the tooth period's."""
    problem = measured(altintas().changed(tool=Tool(0.0254, 4)), np.arange(2.0, 4000, 2))
    nearly = problem.changed(tool=Tool(0.0254, 4, pitch=np.pi / 2 + 1e-11 * np.array([1, -1, 0.5, -0.5])))
    for speed in (5000.0, 12000.0):
        regular, whole = (stability.chart(p, [speed], HillDeterminant(), depth_max=0.004) for p in (problem, nearly))
        assert whole.limit == pytest.approx(regular.limit, rel=1e-8)
        assert whole.error[0] == pytest.approx(regular.error[0], rel=1e-2)
        assert np.cos(whole.theta[0]) == pytest.approx(np.cos(4 * regular.theta[0]), abs=1e-7)


@pytest.mark.slow
def test_structure_and_feed_turned_together_change_nothing() -> None:
    """A measured 2x2 FRF of modes in any direction, turned, and cut along the turned feed."""
    problem = random_problem(np.random.default_rng(3), modes=3).changed(tool=Tool(0.016, 3, pitch=[2.0, 2.2, 2 * np.pi - 4.2]))
    angle = 0.8
    c, s = np.cos(angle), np.sin(angle)
    modes = problem.dynamics
    turned = Modes(modes.frequency, modes.damping_ratio, np.array([[c, -s], [s, c]]) @ modes.shape, modes.dofs)  # type: ignore
    f = np.arange(2.0, 7000, 2)
    first = measured(problem, f)
    again = measured(problem.changed(dynamics=turned), f).changed(feed_angle=angle)
    limits = [stability.chart(p, [6000.0, 11000], HillDeterminant(), depth_max=0.02).limit for p in (first, again)]
    assert np.isfinite(limits[0]).any()
    assert limits[1] == pytest.approx(limits[0], rel=1e-9)


@pytest.mark.slow
def test_helix_of_one_axial_pitch_makes_the_single_frequency_solution_exact() -> None:
    """With depth = pi D/(N tan helix) the coefficient is constant: the zero-order limit is a boundary, from modes and lines."""
    problem = benchmark(Engagement.down(0.3), 2)
    limit = stability.chart(problem, [9000.0], ZeroOrder(), depth_max=0.002).limit[0]
    tool = Tool(0.02, 2)
    # An angle beyond any real tool's, but the law holds for it.
    object.__setattr__(tool, "helix", np.full(2, np.arctan(np.pi * 0.02 / (2 * limit))))
    helical = problem.changed(tool=tool)
    for cut, within in ((helical, 1e-8), (measured(helical, np.arange(0.5, 5000, 0.5)), 1e-6)):
        chart = stability.chart(cut, [9000.0], HillDeterminant(), depth_max=1.5 * limit)
        assert np.abs(chart.depth / limit - 1).min() < within


@pytest.mark.slow
def test_three_directions() -> None:
    """A full 3x3 FRF with cross terms: a ball with an axial coefficient against PanelArnoldi, and z matters."""
    rng = np.random.default_rng(5)
    f, shape = np.array([450.0, 700, 1100]), rng.normal(size=(3, 3))
    modes = Modes(f, np.array([0.03, 0.02, 0.025]), shape, ("t:+x", "t:+y", "t:+z"))
    coefficients = altintas().coefficients
    ball = MillingProblem(Tool(0.016, 3, pitch=np.radians([112.0, 125, 123]), corner_radius=0.008), Engagement.slot(),
                          type(coefficients)(1.3e9, 6e8, 3e8), modes, x="t:+x", y="t:+y", z="t:+z")
    lines = measured(ball, np.arange(1.0, 5000, 1))
    speeds = [8000.0]
    truth = stability.chart(ball, speeds, PanelArnoldi(), depth_max=0.004).limit[0]
    chart = stability.chart(lines, speeds, HillDeterminant(), depth_max=0.004)
    assert chart.limit[0] == pytest.approx(truth, rel=1e-4)
    assert abs(chart.limit[0] - truth) <= chart.error[0]
    flat = stability.chart(lines.changed(z=None), speeds, HillDeterminant(), depth_max=0.004).limit[0]
    assert abs(flat / truth - 1) > 0.01
    cylinder = ball.changed(tool=Tool(0.016, 3, pitch=np.radians([112.0, 125, 123])))  # no chip along z, but a force
    truth = stability.chart(cylinder, speeds, PanelArnoldi(), depth_max=0.004).limit[0]
    straight = stability.chart(measured(cylinder, np.arange(1.0, 5000, 1)), speeds, HillDeterminant(), depth_max=0.004)
    assert straight.limit[0] == pytest.approx(truth, rel=1e-4)


def random_cut(rng: np.random.Generator) -> MillingProblem:
    """A random cut of any kind."""
    problem = random_problem(rng, modes=int(rng.integers(1, 5)), mu=8e5)
    kind = KINDS[int(rng.integers(0, len(KINDS)))]
    if kind in ("corner", "ball", "helical ball"):  # elsewhere the arc changes along the edge, which the panels resolve slowly
        alike = (Engagement.slot(), Engagement.up(0.5), Engagement.down(0.5))
        problem = problem.changed(engagement=alike[int(rng.integers(3))])
    return general(kind, problem)


@pytest.mark.slow
@pytest.mark.parametrize("lines", [False, True])
def test_stated_errors_bound_the_true_ones(lines: bool) -> None:
    """Random cuts on modes, and on measured bands that end early, begin late or have coarse lines: the difference from
    PanelArnoldi's limit lies within the stated error."""
    rng = np.random.default_rng(17)
    held, total = 0, 0
    for _ in range(14):
        problem, speed = random_cut(rng), float(rng.uniform(7000, 15000))
        top = float(problem.plane.span[1])
        f = np.arange(rng.choice([1.0, 5.0, 20.0]), top * rng.uniform(1.4, 3.0) + 500, rng.choice([0.5, 1.0, 2.0]))
        truth = stability.chart(problem, [speed], PanelArnoldi(), depth_max=0.008)
        chart = HillDeterminant().solve(measured(problem, f) if lines else problem, np.array([speed]), 0.008)
        p, q = chart.limit_points()[0], truth.limit_points()[0]
        if p >= 0 and q >= 0:
            total += 1
            held += abs(chart.depth[p] - truth.depth[q]) <= chart.error[p] + truth.error[q]
    assert total >= 9 and held == total


@pytest.mark.slow
def test_coarse_lines_say_so() -> None:
    """Lines as far apart as a resonance is wide: the stated error is ten times larger at least and bounds the change.

    Among coarse spacings it need not grow: there the curve cannot be told from noise, and is counted as noise too."""
    problem = general("pitch")
    truth = stability.chart(problem, [6000.0], PanelArnoldi(), depth_max=0.004).limit[0]
    errors = []
    for step in (1.0, 8.0, 20.0):
        chart = stability.chart(measured(problem, np.arange(step, 6000, step)), [6000.0], HillDeterminant(), depth_max=0.004)
        errors.append(float(chart.error[chart.limit_points()[0]]))
        assert abs(chart.limit[0] - truth) <= errors[-1]
    assert min(errors[1:]) > 10 * errors[0]


def test_a_band_that_ends_at_a_resonance_is_doubted() -> None:
    """The remark on what is missing is in the chart, and the stated error covers the difference."""
    problem = general("helix")
    truth = stability.chart(problem, [9500.0], PanelArnoldi(), depth_max=0.004).limit[0]
    with pytest.warns(ToolpointWarning, match="missing is the band"):
        chart = stability.chart(measured(problem, np.arange(1.0, 1500, 1)), [9500.0], HillDeterminant(), depth_max=0.004)
    assert any("missing is the band" in note for note in chart.notes)
    assert abs(chart.limit[0] - truth) <= chart.error[chart.limit_points()[0]]


@pytest.mark.parametrize("kind", ["helix", "helical ball"])
def test_fourier_coefficients_are_those_of_the_edges(kind: str) -> None:
    """Own force of all edges by quadrature over slices and their arcs, with the wall's arc at each radius."""
    problem = general(kind).changed(engagement=Engagement(0.8, 1.9))
    depth, slices = 0.004, 800
    tool = problem.tool
    height, kappa, radius = tool.along_edge((np.arange(slices) + 0.5) / slices * tool.edge_length(depth))
    entry, leave = problem.engagement.at_radius(tool.radius / radius)
    x, w = np.polynomial.legendre.leggauss(40)
    cut = hill_cut(problem, depth, 6)
    period = tool.teeth if tool.is_regular else 1
    for h in (0, 1, 5):
        total = np.zeros((3, 3), complex)
        for k, a, b, lag in zip(kappa, entry, leave, tool.angles(height)):
            phi = a + (b - a) * (1 + x) / 2
            wave = np.exp(-1j * period * h * (phi + lag[:, None])).sum(0) * w * (b - a) / 2
            total += np.einsum("i,iab->ab", wave, edge_matrix(problem.coefficients, phi, k)) / (2 * np.pi)
        total *= tool.edge_length(depth) / slices
        assert cut.now[6 + h] == pytest.approx(total[:2, :2], abs=3e-4 * np.abs(total).max())
    assert cut.late.sum(1) == pytest.approx(cut.now, abs=1e-9 * np.abs(cut.now).max())


@pytest.mark.slow
def test_speed_dependent_response() -> None:
    """An FRF that is a function of the speed gives at each speed what the fixed FRF gives."""
    problem = measured(general("pitch"), np.arange(2.0, 4000, 2))
    x, y = problem.dynamics  # type: ignore[misc]
    soft = stability.chart(problem, [7000.0, 9000], HillDeterminant(), depth_max=0.005).limit
    mixed = problem.changed(dynamics=lambda speed: problem.plane if speed < 8000 else problem.plane.rotated(np.pi / 2))
    limit = stability.chart(mixed, [7000.0, 9000], HillDeterminant(), depth_max=0.005).limit
    turned = stability.chart(problem.changed(dynamics=problem.plane.rotated(np.pi / 2)), [9000.0], HillDeterminant(),
                             depth_max=0.005).limit
    assert limit == pytest.approx([soft[0], turned[0]], rel=1e-12) and limit[1] != pytest.approx(soft[1], rel=1e-3)
    assert x.frequency.size == y.frequency.size


def test_what_it_cannot_do_is_refused() -> None:
    """Turning, speed variation, matrices beyond reason, nonsense settings: the remedy is named."""
    turning = TurningProblem(1e9, benchmark(Engagement.slot()).dynamics)  # type: ignore[arg-type]
    with pytest.raises(ToolpointError, match="ZeroOrder"):
        stability.chart(turning, [5000.0], HillDeterminant())
    lines = measured(general("pitch"), np.arange(2.0, 4000, 2))
    with pytest.raises(ToolpointError, match="identify modes"):
        stability.chart(lines.changed(speed_variation=SpeedVariation(0.1)), [5000.0], HillDeterminant())
    with pytest.raises(ToolpointError, match="leave out the modes or FRF lines"):
        stability.chart(lines, [300.0], HillDeterminant())
    with pytest.raises(ToolpointError, match="reach"):
        HillDeterminant(reach=0.5)
    with pytest.raises(ToolpointError, match="levels"):
        HillDeterminant(levels=1)


@pytest.mark.parametrize("size", [2, 9])
def test_null_vectors_of_a_root_hit_to_the_last_digit(size: int) -> None:
    """An exactly singular matrix has a zero pivot: its null vectors are the best of all, not a division by zero."""
    m = np.eye(size) + np.triu(np.arange(1.0, size**2 + 1).reshape(size, size), 1) * (0.3 + 0.2j)
    m[-1, -1] = 0  # triangular: the last pivot is zero to the last digit
    left, right = _null_vectors(m, None)
    assert np.linalg.norm(m @ right) < 1e-12 * np.abs(m).max() and np.linalg.norm(left.conj() @ m) < 1e-12 * np.abs(m).max()


def test_a_resonance_far_narrower_than_the_nodes_is_not_overlooked() -> None:
    """A machine on its feet, 0.03 Hz wide, at tooth passings of 170 Hz: the phase turns within a thousandth of a radian."""
    modes = Modes([10.6166, 11.7, 81.9], [0.00128, 0.0017, 0.06], [[0.02, 0.001, 0.02], [0.001, 0.02, 0.02]],
                  ("tool:+x", "tool:+y"))
    problem = benchmark(Engagement.up(0.2), 2, tool=Tool(0.063, 5)).changed(dynamics=modes)
    speeds = np.array([2018.8, 2910.2])
    exact = stability.chart(problem, speeds, FloquetDeterminant(), depth_max=0.0079).limit
    assert np.isfinite(exact).all()
    assert np.allclose(stability.chart(problem, speeds, HillDeterminant(), depth_max=0.0079).limit, exact, rtol=1e-5)


@pytest.mark.parametrize(("spacing", "is_hidden"), [(0.1, True), (0.01, False)])
def test_a_peak_that_lies_between_the_lines_is_told(spacing: float, is_hidden: bool) -> None:
    """The same machine on lines, one per cent of noise: two lines beside a resonance tell how narrow it is."""
    modes = Modes([10.6166, 81.9], [0.00128, 0.06], [[0.02, 0.02], [0.001, 0.02]], ("tool:+x", "tool:+y"))
    frf = frequency_response.modal(modes, np.arange(4.03, 400.0, spacing))
    noise = np.random.default_rng(1).standard_normal((2, *frf.values.shape))
    noisy = replace(frf, values=frf.values * (1 + 0.01 * (noise[0] + 1j * noise[1])))
    problem = benchmark(Engagement.up(0.2), 2).changed(dynamics=noisy)
    with pytest.warns(ToolpointWarning, match="its peak lies between them") if is_hidden else nullcontext():
        assert bool(coverage(problem, np.array([1000.0]))) == is_hidden
