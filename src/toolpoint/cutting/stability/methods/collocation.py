r"""Collocation: multipliers of general milling (unequal pitch and helix, process damping) by spectral collocation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, count, positive
from toolpoint.cutting.cut.arc import gauss, lagrange
from toolpoint.cutting.cut.coefficients import chip_direction, edge_matrix
from toolpoint.cutting.cut.modal_state import ModalState, plane_with_static
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.method import MEASURED_REASON, TURNING_REASON, Problem, require_milling
from toolpoint.cutting.stability.methods.search import search_depths
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmStart

MAX_COLLOCATION_DECAY = 12.0  # decay within a panel, as an exponent


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
        Axial Gauss slices of a helical or rounded edge (of each of its parts, rounded and cylindrical).
    levels : int
        Depths at which the chart is searched before bisection.
    tolerance : float
        Relative error of depth at which bisection stops.

    Source: pseudospectral collocation of the monodromy operator; Butcher, Bobrenkov, J. Vib. Control 17 (2011) 1873.

    Examples
    --------
    A cut of no depth leaves the multipliers of the free structure, exp(-z w T) in size:

    >>> import numpy as np
    >>> from toolpoint.cutting import CuttingCoefficients, Engagement, Tool
    >>> from toolpoint.vibration import Dof, Modes
    >>> modes = Modes([922.0], [0.011], [[5.0]], [Dof("tool", "+x")])
    >>> cut = MillingProblem(Tool(0.012, 2), Engagement.up(0.2), CuttingCoefficients(6e8, 2e8), modes, "tool:+x", "same")
    >>> values = Collocation().multipliers(cut, 9000.0, 1e-12)
    >>> bool(abs(abs(values[0]) - np.exp(-0.011 * 2 * np.pi * 922 * float(cut.tooth_period(9000.0)))) < 1e-6)
    True
    """

    name: ClassVar[str] = "collocation"
    needs_modes: ClassVar[bool] = True
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = False
    nodes: int = 10
    slices: int = 8
    levels: int = 24
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        for name, minimum in (("nodes", 4), ("slices", 1), ("levels", 2)):
            count(f"Collocation.{name}", getattr(self, name), minimum)
        positive("Collocation.tolerance", self.tolerance, 1e-2)

    def __str__(self) -> str:
        return "Collocation"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: turning and measured FRFs only; it takes every other cut."""
        if isinstance(problem, TurningProblem):
            return TURNING_REASON
        return None if problem.plane.is_modal else MEASURED_REASON

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. It always begins cold."""
        problem = require_milling(self, problem)
        return search_depths(self, problem, speeds, depth_max=depth_max, notes=plane_with_static(problem).notes)

    def multipliers(self, problem: MillingProblem, speed: float, depth: float) -> ComplexArray:
        """Return the multipliers over one period, largest first.

        The period is the tooth period for a regular tool, else a revolution, with speed variation its revolutions.
        """
        plane = plane_with_static(problem, speed)
        cut = Cut(problem, speed, depth, self.slices if problem.tool.has_helix or problem.tool.corner_radius else 1)
        values = np.linalg.eigvals(_monodromy(plane, cut, self.nodes)).astype(complex)
        return values[np.argsort(-np.abs(values))]


class Cut:
    """One cut at a speed and depth over the angle of rotation: edge elements, their engagement, delays and times.

    In angle every delay is constant, also when the speed varies; time enters through `clock`.
    """

    def __init__(self, problem: MillingProblem, speed: float, depth: float, slices: int) -> None:
        tool, arc = problem.tool, problem.engagement
        self.problem, self.omega = problem, 2 * np.pi * speed / 60
        self.variation = problem.speed_variation
        is_tooth_periodic = tool.is_regular and self.variation is None
        self.pitch = 2 * np.pi / tool.teeth if is_tooth_periodic else 2 * np.pi
        self.period = self.pitch if self.variation is None else 2 * np.pi * self.variation.revolutions
        length, rounded = tool.edge_length(depth), tool.corner_radius * np.pi / 2
        ends = [0.0, rounded, length] if 0 < rounded < length else [0.0, length]
        x, w, _ = gauss(slices)
        middle = np.concatenate([a + (b - a) * (1 + x) / 2 for a, b in pairwise(ends)])
        width = np.concatenate([(b - a) * w / 2 for a, b in pairwise(ends)])
        height, kappa, radius = tool.along_edge(middle)
        lag = tool.angles(height)  # (slices, teeth): angle behind tooth 0's tip
        advance = (np.roll(lag, 1, axis=1) - lag) % (2 * np.pi)
        delay = np.where(advance == 0, 2 * np.pi, 2 * np.pi - advance)
        if is_tooth_periodic:
            lag, delay = lag[:, :1], np.full((middle.size, 1), self.pitch)
        self.lag, self.delay = lag.ravel(), delay.ravel()
        self.share, self.kappa = (np.repeat(v, lag.shape[1]) for v in (width, kappa))
        self.entry, self.exit = (np.repeat(v, lag.shape[1]) for v in arc.at_radius(tool.radius / radius))
        self.ways = problem.plane.size
        self.drag = problem.process_damping / tool.radius

    def clock(self, angle: FloatArray) -> FloatArray:
        """Return the time at which the spindle has turned by `angle`, s."""
        if self.variation is None:
            return np.asarray(angle) / self.omega
        return self.variation.clock(np.asarray(angle), self.omega)

    def rate(self, angle: FloatArray) -> FloatArray:
        """Return the seconds a radian at `angle`."""
        if self.variation is None:
            return np.full(np.shape(angle), 1 / self.omega)
        return 1 / (self.omega * self.variation.factor(np.asarray(angle)))

    def breaks(self) -> FloatArray:
        """Return the break points of one period, rad: entries, exits, and the same one delay later."""
        turns = 2 * np.pi * np.arange(max(1, round(self.period / (2 * np.pi))))
        first = np.concatenate([self.entry + self.lag, self.exit + self.lag])
        times = (first[:, None] + turns).ravel() % self.period
        images = (times[:, None] + np.unique(np.round(self.delay, 12))[None, :]).ravel() % self.period
        ends = np.concatenate([[0.0, self.period], times, *([images] if self.delay.size <= 16 else [])])
        ends = np.unique(np.round(ends / self.period, 11)) * self.period
        # No panel may look back into itself.
        parts = np.maximum(1, np.ceil(np.diff(ends) / (0.9 * self.delay.min() if self.delay.size > 1 else 9.0))).astype(int)
        split = [a + (b - a) * np.arange(1, n + 1) / n for a, b, n in zip(ends[:-1], ends[1:], parts)]
        return np.concatenate([[0.0], *split])

    def elements(self, a: float, b: float) -> tuple[Array, FloatArray]:
        """Return the elements (tooth and slice) in cut between a and b, and their angle when the spindle is at angle zero."""
        middle = (a + b) / 2
        phi = (middle - self.lag[:, None] + self.pitch * np.arange(round(2 * np.pi / self.pitch))) % (2 * np.pi)
        element, turn = np.nonzero((phi > self.entry[:, None]) & (phi < self.exit[:, None]))
        return element, phi[element, turn] - middle

    def matrices(self, phi: FloatArray, live: Array) -> tuple[FloatArray, FloatArray]:
        """Return k n^T and the process damping's matrix times 1/rate of elements at angles, shape (elements, n, d, d), per
        metre."""
        d, kappa = self.ways, self.kappa[live][:, None]
        chip = np.concatenate([chip_direction(phi) * np.sin(kappa)[..., None],
                               np.broadcast_to(-np.cos(kappa), phi.shape)[..., None]], axis=-1)
        tangent = np.stack([np.cos(phi), -np.sin(phi), np.zeros_like(phi)], axis=-1)
        push = chip + self.problem.damping_friction * tangent
        drag = self.drag * push[..., :d, None] * chip[..., None, :d]
        return edge_matrix(self.problem.coefficients, phi, kappa)[..., :d, :d], drag


class _Panel(NamedTuple):
    """A stretch of the period: its angles, the elements in cut with their angles at its start, nodes, place of these."""

    begin: Any
    end: Any
    live: Array
    start: FloatArray
    nodes: int
    place: int


def _monodromy(plane: PlaneDynamics, cut: Cut, nodes_min: int) -> FloatArray:
    """Return the matrix that maps (state, vibration at the nodes in cut) of one period on those of the next."""
    system = ModalState(plane)
    ends = _split_steep(cut, cut.breaks(), float(-plane.poles.real.min()))
    panels: list[_Panel] = []
    offset = 0
    omega_max = np.abs(plane.poles).max()
    spans = np.diff(cut.clock(ends))
    live = [cut.elements(a, b) for a, b in pairwise(ends)]
    counts = [nodes_min + int(np.ceil(1.3 * omega_max * span)) for span in spans]
    needed = _panels_looked_into(cut, ends, live, counts)
    for place, (a, b) in enumerate(pairwise(ends)):
        elements, start = live[place]
        n = counts[place] if elements.size or needed[place] else 0
        panels.append(_Panel(a, b, elements, start, n, offset))
        offset += cut.ways * n
    states, size = 2 * system.poles.size, offset
    state: FloatArray = np.eye(states, states + size)
    past = np.concatenate([np.zeros((size, states)), np.eye(size)], axis=1)
    now = np.full((size, states + size), np.nan)
    for panel in panels:
        if panel.nodes == 0:
            state = system.step(float(cut.clock(panel.end) - cut.clock(panel.begin))) @ state
            continue
        state, rows = _panel(system, cut, panel, state, past, now, panels, plane.static)
        now[panel.place:panel.place + cut.ways * panel.nodes] = rows
    return np.concatenate([state, now])


def _split_steep(cut: Cut, ends: FloatArray, decay: float) -> FloatArray:
    """Return ends of panels within which the fastest decay (1/s) is at most exp(-12): backwards it would drown the rest."""
    parts = np.maximum(1, np.ceil(decay * np.diff(cut.clock(ends)) / MAX_COLLOCATION_DECAY)).astype(int)
    return np.concatenate([[0.0], *(a + (b - a) * np.arange(1, n + 1) / n for a, b, n in zip(ends[:-1], ends[1:], parts))])


def _panels_looked_into(cut: Cut, ends: FloatArray, live: list[tuple[Array, FloatArray]], counts: list[int]) -> Array:
    """Whether a panel that cuts looks back into each panel."""
    out = np.zeros(ends.size - 1, bool)
    for a, b, (elements, _), n in zip(ends[:-1], ends[1:], live, counts):
        if elements.size:
            angle = a + (b - a) / 2 * (1 + gauss(n)[0])
            past_angles = _wrap_into_period(angle[:, None] - np.unique(cut.delay[elements]), cut.period)
            out[np.unique(np.searchsorted(ends, past_angles, side="right") - 1)] = True
    return out


def _wrap_into_period(angle: FloatArray, period: float) -> FloatArray:
    """Move angles of the past period into the present one."""
    return np.clip(np.where(angle < 0, angle + period, angle), 0.0, np.nextafter(period, 0.0))


def _panel(system: ModalState, cut: Cut, panel: _Panel, state: FloatArray, past: FloatArray, now: FloatArray,
           panels: Sequence[_Panel], static: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b, live, start, n, _ = panel
    d = cut.ways
    x, w, rising = gauss(n)
    angle = a + (b - a) / 2 * (1 + x)
    t, rate = cut.clock(angle), cut.rate(angle)
    begin, end = float(cut.clock(a)), float(cut.clock(b))
    half = (b - a) / 2 * rate  # d(time)/dx at the nodes
    dt = t[:, None] - t[None, :]
    free = system.rows(t - begin)
    if live.size == 0:
        return system.step(end - begin) @ state, (free @ state).reshape(d * n, -1)
    weight = (half * rising)[:, :, None, None] * system.kernel(dt)  # response at node i to force at node j
    weight[np.arange(n), np.arange(n)] += static  # what answers at once
    phi = start[:, None] + angle[None, :]
    cutting, drag = cut.matrices(phi, live)
    share = cut.share[live][:, None, None, None]
    present, damping = (share * cutting).sum(0), (share * drag).sum(0) * rate[:, None, None]
    memory = np.zeros((n, d, state.shape[1]))
    for e, element in enumerate(live):
        memory += np.einsum("iab,ibm->iam", share[e] * cutting[e],
                            _delayed_vibration(angle - cut.delay[element], cut, panels, past, now))
    # F_i = -own_i r_i - damping_i r'_i + memory_i;  r = free + weight F;  r' = free' + weight' F
    big = np.einsum("iab,ijbc->iajc", present, weight)
    right = memory - np.einsum("iab,ibm->iam", present, free @ state)
    if cut.drag > 0:
        # The impulse response starts at zero, so the velocity has no term in the force of the same moment.
        velocity = (half * rising)[:, :, None, None] * system.kernel(dt, 1)
        big = big + np.einsum("iab,ijbc->iajc", damping, velocity)
        right = right - np.einsum("iab,ibm->iam", damping, system.rows(t - begin, 1) @ state)
    matrix = np.eye(d * n) + big.reshape(d * n, d * n)
    force = np.linalg.solve(matrix, right.reshape(d * n, -1))
    rows = (free @ state).reshape(d * n, -1) + weight.transpose(0, 2, 1, 3).reshape(d * n, d * n) @ force
    push = ((half * w)[:, None, None] * system.drive(end - t)).transpose(1, 0, 2).reshape(-1, d * n)
    return system.step(end - begin) @ state + push @ force, rows


def _delayed_vibration(angle: FloatArray, cut: Cut, panels: Sequence[_Panel], past: FloatArray, now: FloatArray) -> FloatArray:
    """Return the vibration at past angles as maps of the initial data, by barycentric interpolation on its panel."""
    # A panel may look back across the border of two: every angle is interpolated on its own panel, never extrapolated.
    border = np.array([panel.begin for panel in panels])
    moved = _wrap_into_period(angle, cut.period)
    on = np.searchsorted(border, moved, side="right") - 1
    out = np.empty((angle.size, cut.ways, now.shape[1]))
    for p, is_past in {(int(p), bool(t < 0)) for p, t in zip(on, angle)}:
        a, b, _, _, n, place = panels[p]
        selected = (on == p) & ((angle < 0) == is_past)
        rows = lagrange(gauss(n)[0], 2 * (moved[selected] - a) / (b - a) - 1)
        source = (past if is_past else now)[place:place + cut.ways * n].reshape(n, cut.ways, -1)
        out[selected] = np.einsum("ij,jcm->icm", rows, source)
    return out
