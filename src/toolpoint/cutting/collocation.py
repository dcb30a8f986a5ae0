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
        """Return the multipliers over one period, largest first.

        The period is the tooth period for a regular tool, else a revolution, with speed variation its revolutions.
        """
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
    """One cut at a speed and depth over the angle of rotation: edge elements, their engagement, delays and times.

    In angle every delay is constant, also when the speed varies; time enters through `clock`.
    """

    def __init__(self, problem: MillingProblem, speed: float, depth: float, slices: int) -> None:
        tool, arc = problem.tool, problem.engagement
        self.problem, self.omega = problem, 2 * np.pi * speed / 60
        self.variation = problem.speed_variation
        alike = tool.is_regular and self.variation is None
        self.pitch = 2 * np.pi / tool.teeth if alike else 2 * np.pi
        self.period = self.pitch if self.variation is None else 2 * np.pi * self.variation.revolutions
        x, w, _ = gauss(slices)
        lag = tool.angles(depth * (1 + x) / 2)  # (slices, teeth): angle behind tooth 0's tip
        ahead = (np.roll(lag, 1, axis=1) - lag) % (2 * np.pi)
        delay = np.where(ahead == 0, 2 * np.pi, 2 * np.pi - ahead)
        if alike:
            lag, delay = lag[:, :1], np.full((slices, 1), self.pitch)
        self.lag, self.delay = lag.ravel(), delay.ravel()
        self.share = np.repeat(depth * w / 2, lag.shape[1])
        self.entry, self.exit = arc.entry, arc.exit
        self.drag = problem.process_damping / tool.radius

    def clock(self, angle: FloatArray) -> FloatArray:
        """Time at which the spindle has turned by `angle`, s."""
        if self.variation is None:
            return np.asarray(angle) / self.omega
        return self.variation.clock(np.asarray(angle), self.omega)

    def rate(self, angle: FloatArray) -> FloatArray:
        """Seconds a radian at `angle`."""
        if self.variation is None:
            return np.full(np.shape(angle), 1 / self.omega)
        return 1 / (self.omega * self.variation.factor(np.asarray(angle)))

    def breaks(self) -> FloatArray:
        """Break points of one period, rad: entries, exits, and the same one delay later."""
        turns = 2 * np.pi * np.arange(max(1, round(self.period / (2 * np.pi))))
        first = np.concatenate([self.entry + self.lag, self.exit + self.lag])
        times = (first[:, None] + turns).ravel() % self.period
        later = (times[:, None] + np.unique(np.round(self.delay, 12))[None, :]).ravel() % self.period
        every = np.concatenate([[0.0, self.period], times, *([later] if self.delay.size <= 16 else [])])
        return np.unique(np.round(every / self.period, 11)) * self.period

    def elements(self, a: float, b: float) -> tuple[Array, FloatArray]:
        """Elements (tooth and slice) in cut between a and b, and their angle when the spindle is at angle zero."""
        middle = (a + b) / 2
        phi = (middle - self.lag[:, None] + self.pitch * np.arange(round(2 * np.pi / self.pitch))) % (2 * np.pi)
        at, turn = np.nonzero((phi > self.entry) & (phi < self.exit))
        return at, phi[at, turn] - middle

    def matrices(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """k n^T and the process damping's matrix times 1/rate at the angles, shape (..., 2, 2), per metre of depth."""
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
        span = float(cut.clock(b) - cut.clock(a))
        n = 0 if live.size == 0 and not _needed(cut, a, b) else least + int(np.ceil(1.3 * top * span))
        panels.append((a, b, live, start, n, at))
        at += 2 * n
    states, size = 2 * system.poles.size, at
    state = np.eye(states, states + size)
    past = np.concatenate([np.zeros((size, states)), np.eye(size)], axis=1)
    now = np.full((size, states + size), np.nan)
    for a, b, live, start, n, place in panels:
        if n == 0:
            state = system.step(float(cut.clock(b) - cut.clock(a))) @ state
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
        phi = (middle + delay - lag) % cut.pitch
        if any(cut.entry < phi + k * cut.pitch < cut.exit for k in range(round(2 * np.pi / cut.pitch))):
            return True
    return False


def _panel(system: _Modal, cut: Cut, panel: tuple, state: FloatArray, past: FloatArray, now: FloatArray,  # type: ignore
           panels: list) -> tuple[FloatArray, FloatArray]:  # type: ignore[type-arg]
    a, b, live, start, n = panel
    x, w, rising = gauss(n)
    angle = a + (b - a) / 2 * (1 + x)
    t, rate = cut.clock(angle), cut.rate(angle)
    begin, end = float(cut.clock(a)), float(cut.clock(b))
    half = (b - a) / 2 * rate  # d(time)/dx at the nodes
    dt = t[:, None] - t[None, :]
    free = system.rows(t - begin)
    if live.size == 0:
        return system.step(end - begin) @ state, (free @ state).reshape(2 * n, -1)
    weight = (half * rising)[:, :, None, None] * system.kernel(dt)  # response at node i to force at node j
    phi = start[:, None] + angle[None, :]
    cutting, drag = cut.matrices(phi)
    share = cut.share[live][:, None, None, None]
    own, damping = (share * cutting).sum(0), (share * drag).sum(0) * rate[:, None, None]
    memory = np.zeros((n, 2, state.shape[1]))
    for e, element in enumerate(live):
        memory += np.einsum("iab,ibm->iam", share[e] * cutting[e], _delayed(angle - cut.delay[element], cut, panels, past, now))
    # F_i = -own_i r_i - damping_i r'_i + memory_i;  r = free + weight F;  r' = free' + weight' F
    big = np.einsum("iab,ijbc->iajc", own, weight)
    right = memory - np.einsum("iab,ibm->iam", own, free @ state)
    if cut.drag > 0:
        # The impulse response starts at zero, so the velocity has no term in the force of the same moment.
        velocity = (half * rising)[:, :, None, None] * system.kernel(dt, 1)
        big = big + np.einsum("iab,ijbc->iajc", damping, velocity)
        right = right - np.einsum("iab,ibm->iam", damping, system.rows(t - begin, 1) @ state)
    matrix = np.eye(2 * n) + big.reshape(2 * n, 2 * n)
    force = np.linalg.solve(matrix, right.reshape(2 * n, -1))
    rows = (free @ state).reshape(2 * n, -1) + weight.transpose(0, 2, 1, 3).reshape(2 * n, 2 * n) @ force
    push = ((half * w)[:, None, None] * system.drive(end - t)).transpose(1, 0, 2).reshape(-1, 2 * n)
    return system.step(end - begin) @ state + push @ force, rows


def _delayed(angle: FloatArray, cut: Cut, panels: list, past: FloatArray, now: FloatArray) -> FloatArray:  # type: ignore
    """Vibration at past angles as maps of the initial data, by barycentric interpolation on its panel."""
    source = now
    if angle.mean() < 0:
        angle, source = angle + cut.period, past
    middle = float(angle.mean())
    for a, b, _, _, n, place in panels:
        if a <= middle <= b:
            x, _, _ = gauss(n)
            rows = lagrange(x, 2 * (angle - a) / (b - a) - 1)
            return np.einsum("ij,jcm->icm", rows, source[place:place + 2 * n].reshape(n, 2, -1))
    raise AssertionError("a delayed angle lies on no panel")


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
