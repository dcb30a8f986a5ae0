"""Compiled kernels of cutting against NumPy forms that read like the equations of their docstrings."""

import numba as nb
import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.coefficients import edge_matrix
from toolpoint.cutting.simulation.milling import ExactSteps, edge_elements, modal_steps, simulate
from toolpoint.cutting.stability.floquet.records import ArcSet, Green, HillLines, Turning
from toolpoint.vibration import Dof, Modes

RNG = np.random.default_rng(5)


def complex_array(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


def test_hill_blocks_are_response_times_force():
    from toolpoint.cutting.stability.hill.kernels import fill_blocks

    n, delays, a, c, b, order = 3, 2, 2, 3, 2, 4
    now, drag, late = complex_array(2 * order + 1, c, b), complex_array(2 * order + 1, c, b), complex_array(2 * order + 1,
                                                                                                        delays, c, b)
    turned, rate, response = complex_array(n, delays), complex_array(n), complex_array(n, a, c)
    out = np.empty((n * a, n * b), complex)
    fill_blocks(now, drag, late, turned, rate, response, 0, 0, out)
    for k in range(n):
        for l in range(n):
            h = k - l + order
            force = now[h] + rate[l] * drag[h] - np.einsum("q,qcb->cb", turned[l], late[h])
            np.testing.assert_allclose(out[k * a:(k + 1) * a, l * b:(l + 1) * b], response[k] @ force, rtol=1e-12)


def green_problem():
    """Return two poles on three nodes of an arc, and the records of the kernels."""
    q, omega = 3, 2 * np.pi * 50.0
    poles = np.array([-40 + 900j, -70 + 1500j])
    pairs, angle = complex_array(2, q, q), np.array([0.2, 0.5, 0.9])
    weight, partial = RNG.uniform(0.1, 0.3, q), np.tril(RNG.uniform(0.1, 0.3, (q, q)))
    none = HillLines(np.zeros(0), np.zeros((0, 2, 2), complex), np.zeros((0, 2, 2), complex))
    nodes = ArcSet(pairs, weight, partial, angle, np.zeros((q, q)), none, 0)
    period = 2 * np.pi / 2 / omega
    return nodes, Turning(period, omega, 2e-3, poles, np.exp(poles * period))


def test_green_matrix_is_the_sum_over_earlier_periods():
    from toolpoint.cutting.stability.floquet.kernels import fill, green_at

    nodes, turning = green_problem()
    theta = 0.7
    nu, out = np.exp(-1j * theta), np.empty((3, 3), complex)
    fill(nu, turning, green_at(turning, nodes), out)
    t = nodes.angle / turning.omega
    expected = np.zeros((3, 3), complex)
    for s, pair in ((turning.poles[r], nodes.pairs[r]) for r in range(2)):
        for pole, part in ((s, pair), (s.conj(), pair.conj())):
            e = part * np.exp(pole * (t[:, None] - t[None, :])) / turning.omega
            earlier = nu * np.exp(pole * turning.period) / (1 - nu * np.exp(pole * turning.period))  # periods 1, 2, ...
            expected += e * (nodes.partial + earlier * nodes.weight[None, :])
    np.testing.assert_allclose(out, turning.w_max * (1 - nu) * expected, rtol=1e-11)


def test_hill_matrix_of_modes_is_force_times_response():
    from toolpoint.cutting.stability.floquet.kernels import fill_hill

    ways, top, theta = 2, 1, 0.4
    poles, residues, fourier = np.array([-40 + 900j]), complex_array(1, ways, ways), complex_array(4 * top + 1, ways, ways)
    lines = HillLines(np.array([poles[0].real, poles[0].imag]), residues, fourier)
    _, turning = green_problem()
    nu, out = np.exp(-1j * theta), np.empty((3 * ways, 3 * ways), complex)
    fill_hill(nu, theta, turning, Green(np.zeros((0, 2, 0)), np.zeros((ways, ways)), lines, 0), out)
    for k in range(-top, top + 1):
        for l in range(-top, top + 1):
            s = 1j * (theta + 2 * np.pi * l) / turning.period
            g = residues[0] / (s - poles[0]) + residues[0].conj() / (s - poles[0].conj())
            block = out[(k + top) * ways:(k + top + 1) * ways, (l + top) * ways:(l + top + 1) * ways]
            np.testing.assert_allclose(block, turning.w_max * (1 - nu) * fourier[2 * top + k - l] @ g, rtol=1e-11)


def test_the_polynomial_is_the_determinant():
    from toolpoint.cutting.stability.floquet.kernels import hessenberg, horner, polynomial

    m = complex_array(6, 6)
    h, minors, coefficient = m.copy(), np.zeros((7, 7), complex), np.zeros(7, complex)
    hessenberg(h)
    degree = polynomial(h, minors, coefficient)
    for s in (0.0, 0.3, 1.0):
        assert horner(coefficient, degree, s)[0] == pytest.approx(np.linalg.det(np.eye(6) + s * m), rel=1e-10)


def test_a_kernel_called_by_its_address_is_the_kernel():
    from toolpoint.cutting.stability.far_call import address_of, caller_of

    kinds = (nb.float64, nb.typeof(np.zeros(0)))
    call = caller_of(kinds)

    @nb.njit
    def through(address, factor, out):
        return call(address, (factor, out))

    out = np.array([1.0, 2.0, 0.0])
    assert through(address_of(scale_numbers, kinds), 3.0, out) == 3
    np.testing.assert_array_equal(out, [3.0, 6.0, 0.0])
    with pytest.raises(nb.TypingError):
        through(0, 3.0, out.astype(np.float32))


def scale_numbers(factor, out):
    """A kernel to be called by its address: multiplies in place, returns how many numbers."""
    for i in range(out.size):
        out[i] *= factor
    return out.size


def test_eigenvalues_of_a_hessenberg_matrix():
    from toolpoint.cutting.stability.panels.eigenvalues import eigenvalues

    h = np.triu(RNG.normal(size=(9, 9)), -1)
    np.testing.assert_allclose(np.sort_complex(eigenvalues(h)), np.sort_complex(np.linalg.eigvals(h).astype(complex)),
                               atol=1e-10)


def test_sorting():
    from toolpoint.cutting.stability.sorting import sort, sort_by_size

    real, compl = RNG.normal(size=40), complex_array(40)
    expected, sizes = np.sort(real), np.sort(np.abs(compl))[::-1]
    sort(real)
    sort_by_size(compl)
    np.testing.assert_array_equal(real, expected)
    np.testing.assert_array_equal(np.abs(compl), sizes)


def test_numbers_below_a_limit():
    from toolpoint.cutting.stability.sorting import number_below

    values = np.array([-1.0, 0.5, 0.5, 2.0])
    for limit in (-2.0, -1.0, 0.5, 0.7, 2.0, 3.0):
        assert number_below.py_func(values, limit, True) == np.searchsorted(values, limit, side="right")
        assert number_below.py_func(values, limit, False) == np.searchsorted(values, limit)
    assert number_below.py_func(values[:0], 1.0, True) == 0


@pytest.mark.parametrize("length", [0.001, 0.006])
def test_an_edge_element_is_that_of_the_tool(length):
    from toolpoint.cutting.stability.panels.edge_walls import limits, place
    from toolpoint.cutting.stability.panels.kernels import directions
    from toolpoint.cutting.stability.panels.records import EdgeLaw

    tool, arc, k = Tool(0.012, 3, corner_radius=0.002), Engagement.down(0.3), CuttingCoefficients(6e8, 2e8, 1e8)
    height, kappa, radius = (float(value) for value in tool.along_edge(np.array(length)))
    assert place(length, 0.002, 0.006) == pytest.approx((height, kappa, radius), rel=1e-12)
    ratio = tool.radius / radius
    assert limits(arc.entry, arc.exit, ratio) == pytest.approx([float(v) for v in arc.at_radius(np.array(ratio))], rel=1e-12)
    cut, drag = np.empty((3, 3)), np.empty((3, 3))
    directions(2.0, kappa, EdgeLaw(k.cutting, 0.3), cut, drag)
    np.testing.assert_allclose(cut, edge_matrix(k, np.array(2.0), np.array(kappa)), atol=1e-6)
    s, c, sk, ck = np.sin(2.0), np.cos(2.0), np.sin(kappa), np.cos(kappa)
    n, t = np.array([s * sk, c * sk, -ck]), np.array([c, -s, 0])
    np.testing.assert_allclose(drag, np.outer(n + 0.3 * t, n), atol=1e-12)


def test_the_engaged_share_is_the_hat_function_within_the_arc():
    from toolpoint.cutting.simulation.kernel import engagement_share

    step, entry, leave = 0.1, 1.0, 2.0
    x = np.linspace(entry, leave, 200001)
    for angle in (0.95, 1.03, 1.5, 1.98, 2.2):
        hat = np.maximum(1 - np.abs(x - angle) / step, 0) / step
        assert engagement_share(angle, step, entry, leave) == pytest.approx(np.trapezoid(hat, x), abs=1e-8)


def test_a_simulated_cut_marches_by_its_exact_steps():
    modes = Modes([300.0, 420.0], [0.03, 0.04], np.diag([1.0, 1.2]), [Dof("tool", "+x"), Dof("tool", "+y")])
    problem = MillingProblem(Tool(0.01, 2), Engagement.up(0.5), CuttingCoefficients(6e8, 2e8), modes, "tool:+x", "tool:+y",
                             feed_per_tooth=1e-4)
    speed, depth, n = 3000.0, 2e-4, 40
    method = ExactSteps(steps=n, memory=1)
    run = simulate(problem, speed, depth, revolutions=2, method=method)
    from toolpoint.cutting.cut.modal_state import ModalState
    from toolpoint.cutting.simulation.kernel import engagement_share

    m = modal_steps(ModalState(problem.plane), np.array([60 / speed / (2 * n)]))
    e, arc = edge_elements(problem, depth, n, method=method), problem.engagement
    z, force, r = np.zeros(m.left.shape[1], complex), np.zeros(2), np.zeros((4 * n + 1, 2))
    dphi = np.pi / n
    for k in range(1, 4 * n + 1):
        z = m.decay[0] * z + force @ m.first[0]
        free = 2 * (m.left @ z).real
        position = free
        for _ in range(2):
            force = np.zeros(2)
            for j in range(2):
                phi = arc.entry + k % (2 * n) * dphi - e.lag[j]
                g = engagement_share(phi % (2 * np.pi), dphi, arc.entry, arc.exit)
                s, c = np.sin(phi), np.cos(phi)
                back = k - round(e.delay[j, 0])
                h = problem.feed_per_tooth * s + np.array([s, c]) @ (position - (r[back] if back >= 0 else 0))
                if g > 0 and h > 0:
                    force -= e.share[j] * g * h * (6e8 * np.array([c, -s]) + 2e8 * np.array([s, c]))
            position = free + m.compliance[0] @ force
        r[k], z = position, z + force @ m.last[0]
    np.testing.assert_allclose(run.displacement, r, atol=1e-9 * np.abs(r).max())


@pytest.fixture
def plain_kernels(interpreted):
    """Kernels below as plain Python: each would be compiled for a small case of one test."""
    interpreted(*(f"cutting.stability.{name}" for name in (
        "floquet.counts", "floquet.nodes", "floquet.track", "floquet.scan", "panels.arnoldi", "panels.laying")))


@pytest.mark.usefixtures("plain_kernels")
def test_the_count_is_minus_the_phase_over_pi():
    """D = (1 - 2 s nu)(1 - 0.8 s nu), nu = exp(-i theta): multipliers 2 s and 0.8 s, of which those above 1 are counted."""
    from toolpoint.cutting.stability.floquet import counts, scan
    from toolpoint.cutting.stability.floquet.records import ThetaTable

    theta = np.linspace(0, np.pi, 60)
    nu = np.exp(-1j * theta)
    coefficient = np.column_stack([np.ones(60), -2.8 * nu, 1.6 * nu**2])
    table = ThetaTable(theta, np.arange(60), coefficient, np.full(60, 2))
    levels = np.array([0.3, 0.8, 1.2, 1.6])
    at_levels = np.empty((60, 4), complex)
    for k in range(60):
        scan.values_at(coefficient[k], 2, levels, at_levels[k])
    np.testing.assert_allclose(at_levels, (1 - 2 * levels * nu[:, None]) * (1 - 0.8 * levels * nu[:, None]), rtol=1e-12)
    phase = np.unwrap(np.angle(at_levels), axis=0)
    expected = np.rint((phase[0] - phase[-1]) / np.pi).astype(int)
    assert expected.tolist() == [0, 1, 1, 2]
    assert [counts.count_at(table, 60, s)[0] for s in levels] == expected.tolist()
    assert counts.counts_of(table.order, 60, at_levels, 4).tolist() == expected.tolist()


@pytest.mark.usefixtures("plain_kernels")
def test_points_explain_a_count_by_the_sum_of_their_changes():
    from toolpoint.cutting.stability.floquet.counts import explains
    from toolpoint.cutting.stability.floquet.records import POINT

    points = np.zeros(3, POINT).view(np.recarray)
    points.s, points.change, points.error = [0.2, 0.5, 0.9], [1.0, 2.0, -1.0], 1e-9
    for s in (0.1, 0.3, 0.7, 1.0):
        total = int(points.change[points.s < s].sum())
        assert explains(points, s, total) and not explains(points, s, total + 1)
    assert explains(points, 0.5, 7)  # within its error of a point a count may be either


@pytest.mark.usefixtures("plain_kernels")
def test_a_plain_step_turns_by_less_than_its_angle():
    from toolpoint.cutting.stability.floquet.nodes import LARGEST_STEP_COSINE, plain_step

    for angle in np.linspace(-3, 3, 41):
        assert plain_step(1 + 1j, (1 + 1j) * 3 * np.exp(1j * angle)) == (np.cos(angle) >= LARGEST_STEP_COSINE)


@pytest.mark.usefixtures("plain_kernels")
def test_panels_are_distinct_angles_split_evenly():
    from toolpoint.cutting.stability.panels.laying import split, tell_apart

    angles = RNG.uniform(0, 1, 8)
    np.testing.assert_allclose(tell_apart(np.concatenate([angles, angles + 1e-14]), 1.0), np.sort(angles), atol=1e-11)
    ends = np.array([0.0, 0.3, 0.35, 1.0])
    parts = np.ceil(np.diff(ends) / 0.2).astype(int)
    expected = np.concatenate([[0.0], *(np.linspace(a, b, n + 1)[1:] for a, b, n in zip(ends, ends[1:], parts, strict=False))])
    np.testing.assert_allclose(split(ends, 0.2), expected, atol=1e-15)


@pytest.mark.usefixtures("plain_kernels")
def test_a_ritz_vector_is_that_of_the_hessenberg_matrix():
    from toolpoint.cutting.stability.panels.arnoldi import ritz, sweep

    n, size = 6, 9
    h = np.triu(RNG.normal(size=(n + 1, n)), -1)
    basis = np.linalg.qr(RNG.normal(size=(size, n + 1)))[0].T.copy()
    values, vectors = np.linalg.eig(h[:n])
    k = int(np.argmax(np.abs(values)))
    out = np.empty(size)
    residual = ritz(h, n, complex(values[k]), basis, out)
    assert abs(residual) == pytest.approx(abs(h[n, n - 1] * vectors[n - 1, k]), rel=1e-9)
    y = vectors[:, k] / vectors[n - 1, k]  # the last component is one
    np.testing.assert_allclose(out, (y.real + y.imag) / np.linalg.norm(y) @ basis[:n], atol=1e-12)
    x, dots = RNG.normal(size=size), np.empty(n + 1)
    remainder = x - basis.T @ (basis @ x)
    assert sweep(basis, n + 1, x, dots) == pytest.approx(np.linalg.norm(remainder))
    np.testing.assert_allclose(x, remainder, atol=1e-12)


@pytest.mark.parametrize("corner", [0.0, 0.001, 0.003])
def test_a_wall_is_met_between_neighbouring_numbers(corner: float) -> None:
    """On both sides of the length that is found an edge is before and behind the wall, and no number lies between them."""
    from toolpoint.cutting.stability.panels.edge_walls import beyond_walls, wall_length
    from toolpoint.cutting.stability.panels.records import Walls

    rng, room, count = np.random.default_rng(3), np.empty(2), 0
    for _ in range(3000):
        entry = rng.uniform(0, 2)
        walls = Walls(corner, 0.003, entry, min(entry + rng.uniform(0.1, 2), np.pi))
        slope, angle = 2 * np.tan(rng.uniform(0, 0.8)) / 0.006, rng.uniform(0, 4)
        a, b = np.sort(rng.uniform(1e-5, 0.006, 2))
        values = np.empty((2, 2))
        for row, u in zip(values, (a, b), strict=True):
            beyond_walls(angle, slope, u, walls, row)
        for wall in range(2):
            if (values[0, wall] > 0) == (values[1, wall] > 0):
                continue
            x, y = wall_length(angle, slope, (a, b), (values[0, wall], values[1, wall]), wall, walls, room)
            sides = []
            for u in (x, y):
                beyond_walls(angle, slope, u, walls, room)
                sides.append(float(room[wall]))
            assert abs(x - y) <= 1e-15 * max(x, y)
            assert [side > 0 for side in sides] == [value > 0 for value in values[:, wall].tolist()] or sides[0] == 0
            count += 1
    assert count > 300
