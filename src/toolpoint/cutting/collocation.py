r"""Collocation: multipliers of general milling (unequal pitch and helix, process damping) by spectral collocation."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, count, fail, positive
from toolpoint.cutting.arc import gauss
from toolpoint.cutting.chart import StabilityChart
from toolpoint.cutting.coefficients import chip_direction, force_direction
from toolpoint.cutting.plane import PlaneDynamics
from toolpoint.cutting.problem import MillingProblem, TurningProblem
from toolpoint.cutting.search import searched


@dataclass(frozen=True)
class Collocation:
    r"""Monodromy operator of the delay equation on Gauss panels; every entry, exit and their delayed images a break.

    Each edge element (tooth and axial slice) has its own delay; the vibration on a panel is a polynomial through Gauss
    nodes, its equation the exact (closed-form) convolution with the modal impulse response. The operator maps the
    state and the vibration of one period on those of the next; its eigenvalues are the multipliers.

    Parameters
    ----------
    nodes : int
        Least Gauss nodes on a panel; more are taken where the modes oscillate within it.
    slices : int
        Axial Gauss slices of a helical tool.
    levels : int
        Depths at which the chart is searched before bisection.
    tolerance : float
        Relative error of depth at which bisection stops.

    Source: pseudospectral collocation of the monodromy operator; Butcher, Bobrenkov, J. Vib. Control 17 (2011) 1873.
    """

    nodes: int = 10
    slices: int = 8
    levels: int = 24
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        for name, low in (("nodes", 4), ("slices", 1), ("levels", 2)):
            count(f"Collocation.{name}", getattr(self, name), low)
        positive("Collocation.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return "Collocation"

    def solve(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart; see `stability.chart`."""
        if isinstance(problem, TurningProblem):
            fail("problem", "a TurningProblem", "ZeroOrder is exact for it", "use method=ZeroOrder()")
        modal(problem.plane)
        return searched(problem, speeds, depth_max, self.multipliers, str(self), self.levels, self.tolerance)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the multipliers over one period (tooth period for a regular tool, else spindle period), largest first."""
        plane = modal(problem.plane_at(speed))
        cut = Cut(problem, speed, depth, self.slices if problem.tool.has_helix else 1)
        values = np.linalg.eigvals(_monodromy(plane, cut, self.nodes))
        return values[np.argsort(-np.abs(values))]


def modal(plane: PlaneDynamics) -> PlaneDynamics:
    """Refuse what time-domain methods cannot use."""
    if not plane.is_modal:
        fail("dynamics", "a measured FRF", "this method needs modes", "identify modes, or use FloquetDeterminant")
    if np.abs(plane.static).max() > 0:
        fail("dynamics", "an upper residual", "has no place in this method", "use FloquetDeterminant")
    return plane


class Cut:
    """Times and matrices of one cut at a speed and depth: edge elements, their engagement and delays."""

    def __init__(self, problem: MillingProblem, speed: float, depth: float, slices: int) -> None:
        tool, arc = problem.tool, problem.engagement
        self.omega = 2 * np.pi * speed / 60
        self.period = float(problem.tooth_period(speed)) if tool.is_regular else 60 / speed
        x, w, _ = gauss(slices)
        height, share = depth * (1 + x) / 2, w / 2
        lag = tool.angles(height)  # (slices, teeth): angle behind tooth 0's tip
        ahead = (np.roll(lag, 1, axis=1) - lag) % (2 * np.pi)
        delay = np.where(ahead == 0, 2 * np.pi, 2 * np.pi - ahead) / self.omega
        if tool.is_regular:
            delay[:] = self.period
            lag = lag[:, :1]
            delay = delay[:, :1]
        self.lag, self.delay = lag.ravel(), delay.ravel()
        self.share = np.repeat(depth * share, lag.shape[1])
        self.entry, self.exit = arc.entry, arc.exit
        self.pitch = 2 * np.pi / tool.teeth if tool.is_regular else 2 * np.pi
        self.problem = problem
        speed_of_cut = self.omega * tool.radius
        self.drag = problem.process_damping / speed_of_cut

    def breaks(self) -> FloatArray:
        """Break points of one period, s: entries, exits, and the same one delay later."""
        first = np.concatenate([(self.entry + self.lag) / self.omega, (self.exit + self.lag) / self.omega])
        times = first % self.period
        later = [(times[:, None] + np.unique(np.round(self.delay, 12))[None, :]).ravel() % self.period]
        every = np.concatenate([[0.0, self.period], times, *(later if self.delay.size <= 16 else [])])
        every = np.unique(np.round(every / self.period, 11)) * self.period
        return every

    def elements(self, a: float, b: float) -> tuple[Array, FloatArray]:
        """Elements (tooth and slice) in cut between a and b, and their angle at time zero."""
        middle = (a + b) / 2
        turns = np.arange(int(np.ceil(2 * np.pi / self.pitch)))
        angle = -self.lag[:, None] + self.pitch * turns + 2 * np.pi * np.array([0])
        phi = (angle + self.omega * middle) % (2 * np.pi)
        at, turn = np.nonzero((phi > self.entry) & (phi < self.exit))
        return at, (phi[at, turn] - self.omega * middle)

    def matrices(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """k n^T and the process damping's matrix at the angles, shape (..., 2, 2), per metre of depth."""
        chip = chip_direction(phi)
        k = force_direction(self.problem.coefficients, phi)
        tangent = np.stack([np.cos(phi), -np.sin(phi)], axis=-1)
        push = chip + self.problem.damping_friction * tangent
        return k[..., :, None] * chip[..., None, :], self.drag * push[..., :, None] * chip[..., None, :]


class _Modal:
    """Complex modal state: r = 2 Re(sum_m L_m z_m), z' = s z + R_m^T F, from residues of rank one or two."""

    def __init__(self, plane: PlaneDynamics) -> None:
        left, right, poles = [], [], []
        for s, residue in zip(plane.poles, plane.residues):
            u, size, v = np.linalg.svd(residue)
            for i in range(2):
                if size[i] > 1e-13 * size[0]:
                    left.append(u[:, i] * size[i])
                    right.append(v[i])
                    poles.append(s)
        self.left, self.right, self.poles = np.array(left).T, np.array(right), np.array(poles)

    def kernel(self, dt: FloatArray, order: int = 0) -> FloatArray:
        """Impulse response (or its rate) at these times, shape (..., 2, 2)."""
        factor = np.exp(dt[..., None] * self.poles) * self.poles**order
        return 2 * np.einsum("am,...m,mb->...ab", self.left, factor, self.right).real

    def rows(self, dt: FloatArray, order: int = 0) -> FloatArray:
        """Displacement (or velocity) after dt from the real state (Re z, Im z), shape (n, 2, 2m)."""
        part = 2 * self.left[None] * (np.exp(dt[:, None] * self.poles) * self.poles**order)[:, None, :]
        return np.concatenate([part.real, -part.imag], axis=-1)

    def drive(self, dt: FloatArray) -> FloatArray:
        """State after dt from a unit impulse, shape (n, 2m, 2)."""
        part = np.exp(dt[:, None] * self.poles)[..., None] * self.right[None]
        return np.concatenate([part.real, part.imag], axis=1)

    def step(self, dt: float) -> FloatArray:
        """State transition over dt, shape (2m, 2m)."""
        e = np.exp(self.poles * dt)
        return np.block([[np.diag(e.real), -np.diag(e.imag)], [np.diag(e.imag), np.diag(e.real)]])


def _monodromy(plane: PlaneDynamics, cut: Cut, least: int) -> FloatArray:
    """Matrix that maps (state, vibration at the nodes in cut) of one period on those of the next."""
    system = _Modal(plane)
    ends = cut.breaks()
    panels, at = [], 0
    top = np.abs(plane.poles).max()
    for a, b in pairwise(ends):
        live, start = cut.elements(a, b)
        n = 0 if live.size == 0 and not _needed(cut, a, b) else least + int(np.ceil(1.3 * top * (b - a)))
        panels.append((a, b, live, start, n, at))
        at += 2 * n
    states, size = 2 * system.poles.size, at
    state = np.eye(states, states + size)
    past = np.concatenate([np.zeros((size, states)), np.eye(size)], axis=1)
    now = np.full((size, states + size), np.nan)
    for a, b, live, start, n, place in panels:
        if n == 0:
            state = system.step(b - a) @ state
            continue
        state, rows = _panel(system, cut, (a, b, live, start, n), state, past, now, panels)
        now[place:place + 2 * n] = rows
    return np.concatenate([state, now])


def _needed(cut: Cut, a: float, b: float) -> bool:
    """Whether a later cut looks back into this interval."""
    if cut.lag.size == 1 and cut.pitch < 2 * np.pi:
        return False
    middle = (a + b) / 2
    for lag, delay in zip(cut.lag, cut.delay):
        phi = (cut.omega * (middle + delay) - lag) % cut.pitch
        if any(cut.entry < phi + k * cut.pitch < cut.exit for k in range(int(np.ceil(2 * np.pi / cut.pitch)))):
            return True
    return False


def _panel(system: _Modal, cut: Cut, panel: tuple, state: FloatArray, past: FloatArray, now: FloatArray,  # type: ignore
           panels: list) -> tuple[FloatArray, FloatArray]:  # type: ignore[type-arg]
    a, b, live, start, n = panel
    x, w, rising = gauss(n)
    half = (b - a) / 2
    t = a + half * (1 + x)
    dt = t[:, None] - t[None, :]
    free = system.rows(t - a)
    if live.size == 0:
        rows = (free @ state).reshape(2 * n, -1)
        return system.step(b - a) @ state, rows
    weight = half * rising[:, :, None, None] * system.kernel(dt)  # response at node i to force at node j
    phi = start[:, None] + cut.omega * t[None, :]
    cutting, drag = cut.matrices(phi)
    share = cut.share[live][:, None, None, None]
    own, damping = (share * cutting).sum(0), (share * drag).sum(0)
    memory = np.zeros((n, 2, state.shape[1]))
    for e, element in enumerate(live):
        memory += np.einsum("iab,ibm->iam", share[e] * cutting[e], _delayed(t - cut.delay[element], cut, panels, past, now))
    # F_i = -own_i r_i - damping_i r'_i + memory_i;  r = free + weight F;  r' = free' + weight' F
    big = np.einsum("iab,ijbc->iajc", own, weight)
    right = memory - np.einsum("iab,ibm->iam", own, free @ state)
    if cut.drag > 0:
        rate = half * rising[:, :, None, None] * system.kernel(dt, 1)
        # The impulse response jumps in velocity: r' also holds h(0) F_i, zero for a mass, so only the integral counts.
        big = big + np.einsum("iab,ijbc->iajc", damping, rate)
        right = right - np.einsum("iab,ibm->iam", damping, system.rows(t - a, 1) @ state)
    matrix = np.eye(2 * n) + big.reshape(2 * n, 2 * n)
    force = np.linalg.solve(matrix, right.reshape(2 * n, -1))
    rows = (free @ state).reshape(2 * n, -1) + weight.transpose(0, 2, 1, 3).reshape(2 * n, 2 * n) @ force
    push = (half * w[:, None, None] * system.drive(b - t)).transpose(1, 0, 2).reshape(-1, 2 * n)
    return system.step(b - a) @ state + push @ force, rows


def _delayed(times: FloatArray, cut: Cut, panels: list, past: FloatArray, now: FloatArray) -> FloatArray:  # type: ignore
    """Vibration at past times as maps of the initial data, by barycentric interpolation on its panel."""
    source = now
    if times[0] + 1e-9 * cut.period < 0 or times.mean() < 0:
        times, source = times + cut.period, past
    middle = float(times.mean())
    for a, b, _, _, n, place in panels:
        if a <= middle <= b:
            x, _, _ = gauss(n)
            rows = lagrange(x, 2 * (times - a) / (b - a) - 1)
            return np.einsum("ij,jcm->icm", rows, source[place:place + 2 * n].reshape(n, 2, -1))
    raise AssertionError("a delayed time lies on no panel")


def lagrange(x: FloatArray, at: FloatArray) -> FloatArray:
    """Interpolation matrix from Gauss nodes x to points, by the barycentric formula."""
    gap = x[:, None] - x[None, :] + np.eye(x.size)
    log = -np.log(np.abs(gap)).sum(1)
    sign = np.prod(np.sign(gap), axis=1)
    weight = sign * np.exp(log - log.max())
    difference = at[:, None] - x[None, :]
    exact = np.abs(difference) < 1e-15
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = weight / np.where(exact, 1.0, difference)
        rows = terms / terms.sum(1, keepdims=True)
    hit = exact.any(1)
    rows[hit] = exact[hit]
    return rows
