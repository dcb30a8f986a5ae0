r"""FloquetDeterminant: stability of milling, exact in depth, from Modes of any number or a measured FRF."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from toolpoint._check import Array, FloatArray, count, fail, positive
from toolpoint.cutting.cut.arc import ArcNodes, breaks, straight_nodes
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.floquet.helical import boundaries, count_at, helical_nodes
from toolpoint.cutting.stability.floquet.records import NUMBERS, POINT, POLE_STATE, ArcSet, HillLines, ScanMemory
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.levels import depth_levels, spacing_note
from toolpoint.cutting.stability.method import TURNING_REASON, Problem, refuse_overdamped, require_milling
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart

STATUS = ("complete", "the largest depths of some speeds are beyond double precision and taken as unstable: lower depth_max",
          "some speeds have more boundary points than can be kept: lower depth_max",
          "some boundary points were bracketed only: see their error")


MAX_FLOQUET_ROWS = 700  # rows of the matrix
# Decay of a real pole in a tooth period, as an exponent, up to which the determinant is right (found to 29, wrong at 53).
MAX_FLOQUET_DECAY = 30.0
MAX_NODE_ATTEMPTS = 5  # with more and more arc nodes
EASY_TOLERANCE_FRACTION = 1e-4  # share of the tolerance below which a near problem is tried with fewer arc nodes


@dataclass(frozen=True)
class FloquetDeterminant:
    r"""Boundaries from the periodic Green function; no time steps and no depth grid.

    One delay equals one period, so on the boundary :math:`r(t - T) = e^{-i\theta} r(t)` and the vibration obeys
    :math:`r(t) = -w (1 - e^{-i\theta}) \int_0^T G_\theta(t - s) A(s) r(s) ds` with the quasi-periodic Green function
    :math:`G_\theta`. Discretised at Gauss nodes on the arc of cut, its determinant
    :math:`D(\theta, w) = \det(I + w (1 - e^{-i\theta}) K(\theta))` is a polynomial in w. The number of unstable
    multipliers is minus the phase change of D over :math:`\theta \in [0, \pi]` in units of pi: a whole number.
    Boundary points are solved for (theta, w) and solved again with more nodes: the difference is the stated error.
    A measured FRF has no Green function in closed form: it is handed to `HillDeterminant`. Helical tools of equal pitch
    are solved with the mean matrix of each depth (about a second a speed).

    Parameters
    ----------
    tolerance : float
        Relative error of depth wanted; nodes are added until the estimate is below it.
    nodes : int
        Least nodes on an arc.
    levels : int
        Depths between 0 and depth_max at which the count is taken (denser near 0). A band of (un)stable depths
        narrower than their spacing that opens and closes between two of them can be missed.
    base : int
        Theta intervals before refinement.

    Source: the generalised Nyquist count of a Fredholm determinant; Insperger, Stepan, Semi-Discretization for
    Time-Delay Systems, 2011, for the equation and its multipliers.

    Examples
    --------
    >>> FloquetDeterminant(tolerance=1e-7).levels
    48
    """

    name: ClassVar[str] = "floquet"
    needs_modes: ClassVar[bool] = False
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = True
    tolerance: float = 1e-6
    nodes: int = 5
    levels: int = 48
    base: int = 16

    def __post_init__(self) -> None:
        positive("FloquetDeterminant.tolerance", self.tolerance, 1e-2)
        count("FloquetDeterminant.nodes", self.nodes, 3)
        count("FloquetDeterminant.levels", self.levels, 4)
        count("FloquetDeterminant.base", self.base, 4)

    def __str__(self) -> str:
        return "FloquetDeterminant"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: all but teeth of equal pitch and helix on a cylinder; a measured FRF goes to HillDeterminant."""
        if isinstance(problem, MillingProblem) and not problem.plane.is_modal:
            return HillDeterminant().refuses(problem)
        return refusal(problem)

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart, beginning with the theta nodes, boundary points and arc nodes that a near problem needed."""
        problem, warm = require_milling(self, problem), warm or WarmStart()
        if not problem.plane.is_modal:
            return HillDeterminant().solve(problem, speeds, depth_max)
        refuse_overdamped("FloquetDeterminant", problem, speeds, decay_max=MAX_FLOQUET_DECAY)
        if problem.tool.has_helix:
            return self._helical(problem, speeds, depth_max)
        warm.fit(problem, depth_max)
        groups = [self._group(problem, speeds, group, depth_max, warm) for group in _group_speeds(problem, speeds)]
        index, depth, theta, change, error = (np.concatenate(column) for column in zip(*(columns for columns, _ in groups)))
        frequency = chatter_frequency(problem, speeds[index.astype(int)], theta)
        state = max(state for _, state in groups)
        return assemble_chart(speeds, depth_max, (index, depth, theta, frequency, change, error), method=str(self),
                         notes=(*problem.notes, self._note(depth_max)), search=STATUS[state])

    def _helical(self, problem: MillingProblem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart of a helical tool: counts at levels with the shape of each, boundaries as fixed points."""
        inside = depth_levels(problem, depth_max, 20, power=2.0)
        levels = np.concatenate([[0.0], inside])
        rows, state = [], 0
        for i, speed in enumerate(speeds):
            frozen = Frozen(self, problem, float(speed))
            counts = np.array([0, *(count_at(frozen, float(speed), float(d)) for d in levels[1:])])
            rows += [(i, *row) for row in boundaries(frozen, float(speed), counts, levels=levels)]
            state = max(state, frozen.state)
        table = np.array(rows, float).reshape(-1, 5)
        frequency = chatter_frequency(problem, speeds[table[:, 0].astype(int)], table[:, 2])
        return assemble_chart(speeds, depth_max, (table[:, 0], table[:, 1], table[:, 2], frequency, table[:, 3], table[:, 4]),
                         method=str(self), notes=(*problem.notes, f"helix: {spacing_note(inside)}"), search=STATUS[state])

    def _note(self, depth_max: float) -> str:
        return (f"exact in depth; error of each point estimated from two discretisations; stable or unstable bands "
                f"narrower than about {2e3 * depth_max / self.levels:.2g} mm can be missed at large depths")

    def _group(self, problem: MillingProblem, speeds: FloatArray, group: Array, depth_max: float,
               warm: WarmStart) -> tuple[tuple[Array, ...], int]:
        plane = problem.plane_at(float(speeds[group[0]]))
        # Nodes must resolve the waves of the highest mode, of which most lie in a turn at the lowest speed of the group.
        density = 1.05 * _highest_omega(plane) / (2 * np.pi * speeds[group].min() / 60)
        remaining, nodes_min, parts, state = group, self.nodes, [], 0
        for attempt in range(MAX_NODE_ATTEMPTS):
            final = attempt == MAX_NODE_ATTEMPTS - 1
            # A speed that a near problem solved at a later attempt begins there: what failed then fails again.
            now = remaining if final else np.array([i for i in remaining if warm.attempts.get(float(speeds[i]), 0) <= attempt],
                                                   int)
            if now.size:
                is_solved, part, state_now, easy = self._attempt(problem, plane, speeds, now, depth_max, density,
                                                                 nodes_min, warm, final)
                warm.keep_attempts(speeds[now], np.maximum(attempt - easy, 0))
                parts.append(part)
                state = max(state, state_now)
                remaining = np.setdiff1d(remaining, now[is_solved])
            # Both grow: the density for waves that are too fast, the least number for short arcs, which density leaves at a
            # few nodes.
            density, nodes_min = 1.3 * density, nodes_min + 4
        return tuple(np.concatenate(c) for c in zip(*parts)), state

    def _attempt(self, problem: MillingProblem, plane: PlaneDynamics, speeds: FloatArray, group: Array, depth_max: float,
                 density: float, nodes_min: int, warm: WarmStart, final: bool) -> tuple[Array, tuple[Array, ...], int, Array]:
        n, second = speeds[group], _vibrates_along_y(plane)

        def arc_set(density: float, nodes_min: int) -> ArcSet:
            nodes = straight_nodes(problem.coefficients, problem.engagement, problem.tool.teeth, density=density,
                                   nodes_min=nodes_min,
                                   second_direction=second,
                                   size=plane.size)
            _check_affordable(nodes, float(n.min()))
            return green_set(nodes, plane)

        # The error of a point is its difference between two sets of nodes that share none.
        sets = arc_set(density, nodes_min), arc_set(1.15 * density, nodes_min + 3)
        points, number, status = self.scan(problem, plane, n, sets=sets, depth_max=depth_max, warm=warm)
        tight, easy = (np.array([_is_within_tolerance(points[i, :number[i]], share * self.tolerance) for i in range(n.size)])
                       for share in (1.0, EASY_TOLERANCE_FRACTION))
        is_solved = np.ones(n.size, bool) if final else tight
        places = np.nonzero((np.arange(points.shape[1]) < number[:, None]) & is_solved[:, None])
        p = points[places]
        part = (group[places[0]], p["s"] * depth_max, p["theta"], p["change"].astype(int), p["error"] * depth_max)
        return is_solved, part, int(status[is_solved].max(initial=0)), easy

    def scan(self, problem: MillingProblem, plane: PlaneDynamics, n: FloatArray, *, sets: tuple[ArcSet, ArcSet],
             depth_max: float, warm: WarmStart | None = None) -> tuple[Array, Array, Array]:
        """Return boundary points (n_speeds, MAX_POINTS) of `POINT`, their number and the status of every speed."""
        from toolpoint.cutting.stability.floquet.kernels import MAX_POINTS
        from toolpoint.cutting.stability.floquet.nodes import MAX_KEPT_NODES
        from toolpoint.cutting.stability.floquet.scan import scan_many

        kept, poles, points_max = (0, 0, 0) if warm is None else (MAX_KEPT_NODES, plane.poles.size, MAX_POINTS)
        empty = ScanMemory(np.zeros(kept), np.array((0, -1), NUMBERS), np.zeros(poles, POLE_STATE), np.zeros(points_max, POINT))
        memory = (warm or WarmStart()).begin(n, empty)
        points = np.zeros((n.size, MAX_POINTS), POINT)
        number, status, resolved = scan_many(
            problem.tooth_period(n), 2 * np.pi * n / 60, depth_max, np.array(plane.poles), sets,
            (np.arange(1, self.levels + 1) / self.levels) ** 2, self.base, points, memory)
        if warm is not None:
            warm.keep(n, memory)
        for i in np.flatnonzero(resolved < 1).tolist():
            _end_at_resolved(points[i], number, i, float(resolved[i]))
        return points, number, status


class Frozen:
    """Boundaries of one speed with the shape of the cut frozen at a depth (see `helical.Frozen`)."""

    def __init__(self, method: FloquetDeterminant, problem: MillingProblem, speed: float) -> None:
        self.method, self.problem, self.plane = method, problem, problem.plane_at(speed)
        self.density = 1.05 * _highest_omega(self.plane) / (2 * np.pi * speed / 60)
        self.state = 0

    def __call__(self, depth: float, speed: float, depth_max: float) -> FloatArray:
        method, nodes_min = self.method, self.method.nodes
        for attempt in range(4):
            coarse, fine = (green_set(helical_nodes(self.problem, depth, d, nodes_min=n,
                                                    second_direction=_vibrates_along_y(self.plane)),
                                      self.plane)
                            for d, n in ((self.density, nodes_min), (1.15 * self.density, nodes_min + 3)))
            points, number, status = method.scan(self.problem, self.plane, np.array([speed]), sets=(coarse, fine),
                                                 depth_max=depth_max)
            rows = points[0, :number[0]]
            if _is_within_tolerance(rows, method.tolerance) or attempt == 3:
                break
            nodes_min += 4
        self.state = max(self.state, int(status[0]))
        rows = np.sort(rows, order="s")
        return np.stack([depth_max * rows["s"], rows["theta"], rows["change"], depth_max * rows["error"]], axis=1)


def _end_at_resolved(points: Array, number: Array, i: int, resolved: float) -> None:
    """Take depths above s = `resolved`, which the scan could not resolve, as unstable, with the whole gap as error."""
    if points["change"][:number[i]].sum() > 0 or number[i] >= points.size:
        return
    # A pair at no angle in particular: what crosses there is not known, only that nothing above is judged.
    points[number[i]] = (max(resolved, 1e-9), np.pi / 2, 2, 1 - resolved, 0)
    number[i] += 1


def _check_affordable(nodes: ArcNodes, speed: float) -> None:
    """Refuse matrices that would take minutes a speed, with the remedy."""
    size = nodes.angle.size
    if size > MAX_FLOQUET_ROWS:
        fail("speeds", f"{speed:g} rev/min needs a matrix of {size} (highest frequency times tooth period)",
             f"must be at most {MAX_FLOQUET_ROWS}", remedy="leave out the modes far above the chatter band, raise the "
             "least speed, or use ZeroOrder()")


def rows_of(problem: MillingProblem, plane: PlaneDynamics, speed: float, *, nodes_min: int) -> int:
    """Return the rows of the first matrix that modes need at this speed."""
    density = 1.05 * _highest_omega(plane) / (2 * np.pi * speed / 60)
    ends = breaks(problem.engagement, problem.tool.teeth)
    count = sum(nodes_min + int(np.ceil(density * (b - a))) for a, b in pairwise(ends))
    several = problem.engagement.arc > 2 * np.pi / problem.tool.teeth
    return 2 * count if several and _vibrates_along_y(plane) else count


def _vibrates_along_y(plane: PlaneDynamics) -> bool:
    """Whether the tool can vibrate along y."""
    return bool(np.any(plane.residues[:, 1]) or np.any(plane.static[1]))


def _is_within_tolerance(points: Array, tolerance: float) -> bool:
    """Whether all points where stability itself changes (the count leaves or reaches zero) are within the tolerance."""
    order = np.argsort(points["s"])
    s, change, error = points["s"][order], points["change"][order], points["error"][order]
    after = np.cumsum(change)
    # Where a further multiplier leaves or returns beyond the first, the cut is unstable on both sides: such points may be
    # coarse.
    matters = (after == 0) | (after - change == 0)
    # A negative count is no count: points were missed or counted twice.
    return bool((error[matters] <= tolerance * s[matters] + 1e-14).all() and (after >= 0).all())


def green_set(nodes: ArcNodes, plane: PlaneDynamics) -> ArcSet:
    """Return a set of nodes as the kernels read it."""
    from toolpoint.cutting.stability.floquet.kernels import node_address

    pairs = np.einsum("ia,rab,jb->rij", nodes.chip, plane.residues, nodes.force)
    static = np.where(nodes.same_time, nodes.chip @ plane.static @ nodes.force.T, 0.0)
    none = HillLines(np.zeros(0), np.zeros((0, 2, 2), complex), np.zeros((0, 2, 2), complex))
    return ArcSet(np.ascontiguousarray(pairs), nodes.weight, nodes.partial, nodes.angle, static, none, node_address())


def _highest_omega(plane: PlaneDynamics) -> float:
    """Return the highest angular frequency that matters: the largest pole with at least 1e-3 of the largest dynamic
    flexibility."""
    # The height of each resonance; a pole without damping counts as if it had a thousandth.
    size = np.abs(plane.residues).max(axis=(1, 2)) / np.maximum(-plane.poles.real, 1e-3 * np.abs(plane.poles))
    return float(np.abs(plane.poles[size > 1e-3 * size.max()]).max())


def _group_speeds(problem: MillingProblem, speeds: FloatArray) -> list[Array]:
    """Return groups of speeds that share nodes: within a factor of 1.3; each alone where the response depends on the speed."""
    if problem.depends_on_speed:
        return [np.array([i]) for i in range(speeds.size)]
    # Nodes are counted for the lowest of a group: a wider one would give its fastest speeds more rows than they need, at
    # their cube.
    level = np.floor(np.log(speeds / speeds.min()) / np.log(1.3)).astype(int)
    return [np.flatnonzero(level == k) for k in np.unique(level)]


def chatter_frequency(problem: MillingProblem, speeds: FloatArray, theta: FloatArray, *, chunk: int = 2000) -> FloatArray:
    """Return of all |theta/2 pi + k|/T the frequency with the largest response, Hz."""
    out = np.empty(theta.size)
    for start in range(0, theta.size, chunk):
        part = slice(start, start + chunk)
        out[part] = _strongest_harmonic(problem, speeds[part], theta[part])
    return out


def _strongest_harmonic(problem: MillingProblem, speeds: FloatArray, theta: FloatArray) -> FloatArray:
    if theta.size == 0:
        return theta
    period = problem.tooth_period(speeds)
    # A line above the highest mode answers ever less: 1.3 times it holds every maximum of the response.
    order_max = int(np.ceil(1.3 * problem.plane.span[1] * period.max())) + 2
    f = (theta[:, None] / (2 * np.pi) + np.arange(-min(order_max, 400), min(order_max, 400) + 1)) / period[:, None]
    if problem.depends_on_speed:
        size = np.array([_response_size(problem.plane_at(float(n)), row) for n, row in zip(speeds, f)])
    else:
        size = _response_size(problem.plane, f)
    return np.abs(f[np.arange(theta.size), np.argmax(size, axis=1)])


def _response_size(plane: PlaneDynamics, f: FloatArray) -> FloatArray:
    return np.linalg.norm(plane.response(np.abs(f)), axis=(-2, -1))


def refusal(problem: Problem) -> str | None:
    """Return why a cut has no single delay with a matrix in proportion to depth, and which method to use; None where it has."""
    if isinstance(problem, TurningProblem):
        return TURNING_REASON
    remedy = "use method=PanelArnoldi() or Collocation(), or leave it out"
    if not problem.tool.is_regular:
        return f"unequal pitch or helix; must have teeth of equal pitch and helix ({remedy})"
    if problem.tool.corner_radius > 0:
        return f"a corner radius or ball; must be a cylindrical cut (the chip normal changes along the edge) ({remedy})"
    if problem.speed_variation is not None:
        return f"spindle-speed variation; has no single tooth period ({remedy})"
    if problem.process_damping > 0:
        return f"process damping; is not linear in the delay factor ({remedy})"
    return None
