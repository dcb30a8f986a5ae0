"""Boundary points of general milling: the one-period map at one speed, its spectral radius over depth, roots and errors."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.cut.modal_state import ModalState, plane_with_static
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.levels import FRACTIONS_ABOVE_ROOT, FRACTIONS_BELOW_ROOT, depth_levels
from toolpoint.cutting.stability.methods.search import mean_period
from toolpoint.cutting.stability.panels.arnoldi import OVERFLOW_MARK, leading_eigenvalues
from toolpoint.cutting.stability.panels.balance import MAX_UNBALANCED_DECAY, balance, decay_between_cuts
from toolpoint.cutting.stability.panels.between import changes_of_sign, refine_levels, refine_near_new_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.cutting.stability.panels.kernels import inverses, responses
from toolpoint.cutting.stability.panels.layout import CutPanels
from toolpoint.cutting.stability.panels.records import ModalWaves, PanelTimes, PeriodOperator
from toolpoint.cutting.stability.panels.store import PanelStore

ROOT_ERROR_FLOOR = 3e-8  # relative error of depth by rounding, secant and Arnoldi residual (worst seen 1.2e-8 of 488)
ROUNDED_EDGE_FACTOR = 3.0  # on the error of rounded edges: a wall that begins to bound them leaves roots in the integrands
FIRST_BASIS_SIZE = 14  # Arnoldi vectors before the first look at the residual, where nothing is known
BASIS_DECREMENT = 2  # Arnoldi vectors fewer than last time before the first look at the residual
BASIS_INCREMENT = 8  # Arnoldi vectors more after each look at a residual that is still too large
COARSE_ROOT_TOLERANCE = 3e-4  # relative error of depth at which the search for a root with few nodes ends
BRACKET_MARGIN_FRACTION = 0.02  # of a bracket, beyond its ends
SECOND_BALANCE_FRACTION = 0.75  # of the balance, for the second growth of a root whose difference is rounding
MAX_CHATTER_FREQUENCY_RATIO = 4.0  # of the highest mode: no higher line of the vibration stands out
MAX_BASIS_SIZE = 160  # Arnoldi vectors
DECAY_NODE_FACTOR = 2.0  # additional nodes per radian of decay over those per radian of oscillation
ROOT_ROUNDS = 4  # rounds of looking for further roots beside those that were new


class PeriodMap:
    """The one-period map of the vibration at one spindle speed (rev/min), for any depth: multipliers by Arnoldi's method.

    nodes_min : Gauss nodes of a panel without oscillation; points : Gauss points on a piece of a helical or rounded edge;
    store : panels that speeds share; subspace_sizes : Arnoldi vectors that were enough last time, by accuracy, shared too.
    """

    def __init__(self, problem: MillingProblem, plane: PlaneDynamics, speed: float, nodes_min: int, points: int,
                 store: PanelStore, subspace_sizes: dict[float, int] | None = None) -> None:
        self.problem, self.speed, self.omega = problem, speed, 2 * np.pi * speed / 60
        self.system = _modal_state(plane)
        # The state in metres, as the vibration is: a badly scaled map has eigenvalues that Arnoldi's method cannot resolve.
        size = np.linalg.norm(self.system.left, axis=0)
        self.left = np.ascontiguousarray((self.system.left / size).astype(complex))
        self.right = np.ascontiguousarray((self.system.right * size[:, None]).astype(complex))
        self.slowest = float((-self.system.poles.real).min())
        self.static = np.ascontiguousarray(plane.static)
        self.nodes_min, self.points, self.store = nodes_min, points, store
        self.damped = problem.process_damping > 0
        self.panels: CutPanels | None = None
        self.vector = np.zeros(0)
        # Arnoldi vectors that were enough last time, by the accuracy that was asked for.
        self.subspace_sizes = {} if subspace_sizes is None else subspace_sizes
        self.overflow = False
        self.balance_fraction = 1.0  # of the balance's exponent: the multipliers do not depend on it but for rounding
        self.balances = False
        self.weight: FloatArray = np.zeros(0)

    def rebalanced_multipliers(self, depth: float, waves: float, accuracy: float, *, balance_fraction: float) -> ComplexArray:
        """Return the multipliers by another fraction of the balance; their difference is rounding."""
        self.panels, self.balance_fraction, vector = None, balance_fraction, self.vector
        self.vector = np.zeros(0)
        values = self.multipliers(depth, waves, accuracy)
        self.panels, self.balance_fraction, self.vector = None, 1.0, vector
        return values

    def _times(self, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return time, s, and seconds per radian at these angles."""
        variation = self.problem.speed_variation
        if variation is None:
            return angle / self.omega, np.full(angle.shape, 1 / self.omega)
        return variation.clock(angle, self.omega), 1 / (self.omega * variation.factor(angle))

    def _set_panels(self, panels: CutPanels) -> None:
        """Compute the responses of the panels at this speed."""
        if self.panels is panels:
            return
        self.panels = panels
        system = self.system
        time, rate = self._times(panels.angle)
        border = self._times(panels.ends)[0]
        p, d, m, n = panels.count.size, self.problem.plane.size, system.poles.size, panels.rising.shape[-1]
        force = (p, n * d, n * d)
        waves = ModalWaves(np.zeros(force), np.zeros(force), np.zeros((p, n * d, m), complex), np.zeros((p, n * d, m), complex),
                           np.zeros((p, 2 * m, n * d)), np.zeros((p, m), complex))
        times = PanelTimes(border[:-1], border[1:], time, panels.half * rate, panels.rising, panels.kind,
                           panels.legendre, self.problem.speed_variation is None)
        responses(times, panels.offset, panels.count, system.poles, self.left, self.right, self.static, waves)
        layout = panels.layout
        if self.damped:
            drag = self.problem.process_damping / self.problem.tool.radius * rate
            layout = layout._replace(drag=layout.drag * drag[:, None, None])
        waves = waves._replace(free=waves.free.view(float), free_velocity=waves.free_velocity.view(float))
        self.operator = PeriodOperator(1.0, layout, waves, np.zeros(force), self.damped)
        decay = decay_between_cuts(panels.cutting, border, self.slowest)
        self.balances = decay > MAX_UNBALANCED_DECAY
        self.weight = np.zeros(0) if not self.balances else balance(
            panels.cutting, border, time, exponent=self.balance_fraction * decay, size=d, states=2 * m)

    def multipliers(self, depth: float, waves: float, accuracy: float) -> ComplexArray:
        """Return the largest multipliers, largest first; the residual of the first is below `accuracy` times its size.

        A negative accuracy asks for a verdict alone: a residual of `MAX_RESIDUAL_RATIO` of the multiplier's distance from the
        unit circle is enough then. depth : m; waves : nodes per radian of rotation, see `waves_of`.
        """
        panels = self.store.panels(self.problem, depth, waves, nodes_min=self.nodes_min, points=self.points)
        if panels.empty:
            # Nothing cuts: the multipliers are those of the free modes.
            values = np.exp(self.system.poles * mean_period(self.problem, self.speed))
            return values[np.argsort(-np.abs(values))]
        self._set_panels(panels)
        operator = self.operator._replace(depth=panels.scale(depth))
        inverses(operator)
        size = panels.nodes * operator.layout.now.shape[1] + 2 * self.system.poles.size
        size_max, vector = min(size - 1, MAX_BASIS_SIZE), np.zeros(size)
        basis, h = self.store.room_for(size_max, size)
        basis[0] = self._start(size)
        plan = (accuracy, max(FIRST_BASIS_SIZE, self.subspace_sizes.get(accuracy, 0) - BASIS_DECREMENT), BASIS_INCREMENT)
        now, values = leading_eigenvalues(basis, h, vector, operator=operator, weight=self.weight, plan=plan)
        if now == OVERFLOW_MARK:
            self.overflow = True
            return np.array([np.exp(600.0)], complex)  # taken as unstable, and marked in the chart's status
        self.vector, self.subspace_sizes[accuracy] = vector, now
        return np.asarray(values)

    def _start(self, size: int) -> FloatArray:
        """Return the start of the Arnoldi basis: a component in every direction, and the last Ritz vector where it fits."""
        start = _every_direction(size)
        if self.vector.size == size:
            # Mostly the vector of the depth before, and some of everything: a multiplier that takes the lead between two
            # depths would not be in an invariant subspace.
            start = start + 3 * self.vector
            start /= np.sqrt(start @ start)
        return start


@lru_cache(maxsize=256)
def _every_direction(size: int) -> FloatArray:
    """Return a unit vector with a component in every direction."""
    # No random numbers: results are the same to the last bit from run to run.
    start = np.cos(np.arange(size) * 1.7 + 0.3) + 0.1
    return np.asarray(start / np.linalg.norm(start))


@lru_cache(maxsize=4)
def _modal_state(plane: PlaneDynamics) -> ModalState:
    """Return the modal state of a plane, which all speeds of a chart share."""
    return ModalState(plane)


def waves_of(plane: PlaneDynamics, problem: MillingProblem, speed: float) -> float:
    """Return the nodes per radian of rotation that the modes need at a speed (rev/min), by the fastest of them.

    Modes with less than a thousandth of the largest dynamic flexibility do not count. A real pole takes three times the nodes
    of an oscillating one of the same size: an overdamped pair is the difference of two large exponentials.
    """
    size = np.abs(plane.residues).max(axis=(1, 2)) / np.maximum(-plane.poles.real, 1e-3 * np.abs(plane.poles))
    poles = plane.poles[size > 1e-3 * size.max()]
    omega_max = float((np.abs(poles) + 2 * DECAY_NODE_FACTOR * np.maximum(-poles.real - 0.5 * np.abs(poles), 0.0)).max())
    swing = problem.speed_variation.amplitude if problem.speed_variation is not None else 0.0
    return 1.05 * omega_max / (2 * np.pi * speed / 60 * (1 - swing))


Point = tuple[float, float]  # depth, growth
Start = tuple[float, float]  # depth of a root, slope of the growth there


class PanelSearch:
    """Boundary points of one speed: levels of the spectral radius, roots between them, each solved again more finely."""

    def __init__(self, settings: tuple[int, int, float], problem: MillingProblem, speed: float, depth_max: float,
                 store: PanelStore, known_roots: FloatArray | None = None) -> None:
        self.nodes, self.levels, self.tolerance = settings
        self.problem, self.speed, self.depth_max, self.store = problem, speed, depth_max, store
        self.known_roots = np.zeros((0, 2)) if known_roots is None else known_roots
        self.slopes: list[tuple[float, float]] = []
        self.plane = plane_with_static(problem, speed)
        self.waves = waves_of(self.plane, problem, speed)
        self.maps: dict[int, PeriodMap] = {}
        self.subspace_sizes: dict[float, int] = {}
        self.is_normal = True  # whether rounding leaves every root within the tolerance

    def map(self, extra_nodes: int) -> PeriodMap:
        """Return the map with `extra_nodes` extra nodes on every panel."""
        if extra_nodes not in self.maps:
            points = 4 + (2 if extra_nodes else 0)
            self.maps[extra_nodes] = PeriodMap(self.problem, self.plane, self.speed, self.nodes + extra_nodes,
                                               points, self.store,
                                       self.subspace_sizes)
        return self.maps[extra_nodes]

    @property
    def overflow(self) -> bool:
        """Whether a depth was beyond double precision."""
        return any(period_map.overflow for period_map in self.maps.values())

    def growth(self, depth: float, extra_nodes: int = 0, accuracy: float = -1e-10) -> tuple[float, complex]:
        """Return (log of the spectral radius, critical multiplier)."""
        value = self.map(extra_nodes).multipliers(depth, self.waves * (1 + 0.1 * extra_nodes), accuracy)[0]
        return float(np.log(max(abs(value), 1e-300))), complex(value)

    def rows(self) -> list[tuple[float, ...]]:
        """Return the boundary points as rows (depth, theta, frequency, change, error).

        Beside every root it is looked for more: a band can open and close next to it (a flip lobe before a Hopf lobe), and
        nothing of that shows at the levels."""
        grid = depth_levels(self.problem, self.depth_max, self.levels, power=1.5).tolist()
        self.store.levels.update(grid)
        levels = [self._look(w) for w in grid]
        levels = refine_levels([self._stable_level(levels[0]), *levels], self._look)
        rows: list[tuple[float, ...]] = []
        for _ in range(ROOT_ROUNDS):
            fresh: list[Level] = []
            for lower, upper in changes_of_sign(levels):
                if not any(lower.depth < row[0] < upper.depth for row in rows):
                    row, slope = self._boundary((lower.depth, lower.growth), (upper.depth, upper.growth))
                    rows.append(row)
                    fresh += self._levels_beside(row, slope, lower, upper)
            if not fresh:
                break
            levels = refine_near_new_levels(levels, fresh, self._look)
        return rows

    def _look(self, depth: float) -> Level:
        """Return the level of a depth: its leading multipliers, accurate enough for a verdict."""
        return Level.of(depth, self.map(0).multipliers(depth, self.waves, -1e-6))

    def _levels_beside(self, row: tuple[float, ...], slope: float, lower: Level, upper: Level) -> list[Level]:
        """Return levels on both sides of a root, close to it and on the way to its neighbours."""
        w, margin, a, b = row[0], 1e-6 * row[0] + 2 * row[-1], lower.depth, upper.depth
        if w - margin <= a or w + margin >= b:
            return []
        size = max(abs(slope) * margin, 1e-300) * (1 if upper.growth > 0 else -1)
        sides = [replace(self._look(w - margin), growth=-size), replace(self._look(w + margin), growth=size)]
        return [*sides, *(self._look(a + (w - a) * place) for place in FRACTIONS_BELOW_ROOT),
                *(self._look(w + (b - w) * place) for place in FRACTIONS_ABOVE_ROOT)]

    def _stable_level(self, first: Level) -> Level:
        """Return a depth so small that the cut is stable, from the first level down."""
        w = 0.02 * first.depth
        while True:
            place = self._look(w)
            if place.growth <= 0 or w < 1e-9 * self.depth_max:
                return replace(place, growth=min(place.growth, -1e-12))
            w *= 0.1

    def _boundary(self, lower: Point, upper: Point) -> tuple[tuple[float, ...], float]:
        """Return the row of a root in a bracket, and the slope of the growth there."""
        a, b, rising = lower[0], upper[0], upper[1] > 0
        # With more nodes the root may lie beyond a level close to it.
        a, b = a - BRACKET_MARGIN_FRACTION * (b - a), b + BRACKET_MARGIN_FRACTION * (b - a)
        best, error, mu, slope = self._solve_from(a, b, self._known_root(a, b, rising), rising)
        if not error < b - a:  # also where there was nothing near, or it led astray
            best, error, mu, slope = self._solve_from(a, b, self._coarse_root(lower, upper)[:2], rising)
        error = min(error + self._rounding_error(best, slope), b - a)
        self.slopes.append((best, slope))
        theta = abs(float(np.angle(mu)))
        if abs(mu.imag) < 1e-7 * abs(mu):
            theta = np.pi if mu.real < 0 else 0.0
        single = 1 if theta in (0.0, np.pi) else 2
        return (best, theta, self._frequency(theta), single if rising else -single, error), slope

    def _rounding_error(self, depth: float, slope: float) -> float:
        """Return the error of a root, m, by rounding of a far from normal map: the change of its growth with another
        balance."""
        period_map = self.map(3)
        if not period_map.balances or slope == 0:
            return 0.0
        values = [period_map.rebalanced_multipliers(depth, 1.3 * self.waves, -1e-10, balance_fraction=tilt)[0]
                  for tilt in (1.0, SECOND_BALANCE_FRACTION)]
        shift = abs(float(np.diff(np.log(np.maximum(np.abs(values), 1e-300)))[0]) / slope)
        self.is_normal &= shift <= self.tolerance * depth
        return shift

    def _known_root(self, a: float, b: float, rising: bool) -> Start | None:
        """Return the root and slope that a near problem had in this bracket."""
        inside = [(w, slope) for w, slope in self.known_roots.tolist() if a < w < b and (slope > 0) == rising]
        return inside[0] if len(inside) == 1 else None

    def _coarse_root(self, lower: Point, upper: Point) -> tuple[float, float, float]:
        """Return a root to a few parts in ten thousand, slope and growth there: inverse quadratic interpolation, bisection
        where that is not safe (Chandrupatla, Advances in Engineering Software 28 (1997) 145)."""
        (b, gb), (a, ga) = lower, upper
        share = min(max(ga / (ga - gb), 0.05), 0.95)
        while True:
            w = a + share * (b - a)
            g = self.growth(w, accuracy=-1e-7)[0]
            slope = (g - ga) / (w - a)
            if (g > 0) == (ga > 0):
                c, gc = a, ga
            else:
                c, gc, b, gb = b, gb, a, ga
            a, ga = w, g
            other = (g - gb) / (w - b)
            if abs(g) < COARSE_ROOT_TOLERANCE * w * min(abs(slope), abs(other)) or abs(b - a) < COARSE_ROOT_TOLERANCE * w:
                return w, slope if (slope > 0) == (upper[1] > 0) else other, g
            place, part = (a - b) / (c - b), (ga - gb) / (gc - gb)
            share = 0.5
            if part**2 < place and (1 - part)**2 < 1 - place:
                share = ga / (gb - ga) * gc / (gb - gc) + (c - a) / (b - a) * ga / (gc - ga) * gb / (gc - gb)
            # Not nearer to an end than a tenth of the tolerance, or the bracket would not shrink.
            share_min = min(0.5, 0.1 * COARSE_ROOT_TOLERANCE * w / abs(b - a))
            share = min(max(share, share_min), 1 - share_min)

    def _solve_from(self, a: float, b: float, start: Start | None, rising: bool) -> tuple[float, float, complex, float]:
        """Return (root, error, multiplier, slope) from a start near it; the error is the bracket's width where there is no
        root."""
        if start is None:
            return a, b - a, 0j, 0.0
        w, slope = best, _ = start
        error, mu = b - a, 0j
        # The second, finer root is asked for only where the first is not sure of the tolerance.
        for extra_nodes in (3, 6):
            w, slope, mu, sure = self._polish(w, slope if (slope > 0) == rising else 0.0, extra_nodes, a, b)
            if sure and (slope > 0) != rising:
                # The root of a near problem led to the other end of a narrow band, which is no root of this bracket.
                return best, b - a, 0j, 0.0
            shift = abs(self.growth(w, extra_nodes - 3)[0] / slope) if sure and slope else b - a
            shift *= ROUNDED_EDGE_FACTOR if self.problem.tool.corner_radius > 0 else 1.0
            error, best = min(shift * (1 + shift / (b - a)) + ROOT_ERROR_FLOOR * w, b - a), w
            if error <= self.tolerance * w:
                break
        return best, error, mu, slope

    def _polish(self, w: float, slope: float, extra_nodes: int, a: float, b: float) -> tuple[float, float, complex, bool]:
        """Return the root of the growth with `extra_nodes` nodes near w by the secant rule, in the bracket where that fails;
        its slope, the multiplier, and whether it is a root."""
        from scipy.optimize import brentq

        g, mu = self.growth(w, extra_nodes)
        for _ in range(8):
            new = w - g / slope if slope else np.nan
            if not a <= new <= b:
                break
            g_new, mu = self.growth(new, extra_nodes)
            # Over a step as short as the growth's own rounding the slope would be noise: the one before is kept.
            if abs(new - w) > 1e-8 * w and g_new != g:
                slope = (g_new - g) / (new - w)
            step, w, g = abs(new - w), new, g_new
            if step < 1e-10 * w or abs(g / slope) < 1e-10 * w:
                return w, slope, mu, True
        ends = {x: self.growth(x, extra_nodes)[0] for x in (a, b)}
        if not np.isfinite(list(ends.values())).all() or (ends[a] > 0) == (ends[b] > 0):
            return w, slope, mu, False
        # At the ends what was seen first counts: a growth of nearly nothing may have the other sign when it is asked again.
        w = float(brentq(lambda x: ends[x] if x in ends else self.growth(x, extra_nodes)[0], a, b, xtol=1e-12 * b, rtol=1e-10,
                         disp=False))
        delta = 1e-6 * (b - a) if w < 0.5 * (a + b) else -1e-6 * (b - a)
        g, mu = self.growth(w, extra_nodes)
        return w, (self.growth(w + delta, extra_nodes)[0] - g) / delta, mu, True

    def _frequency(self, theta: float) -> float:
        period = mean_period(self.problem, self.speed)
        # A multiplier knows its frequency up to whole tooth passings: the line at which the tool answers most is the one
        # that is heard.
        f = np.abs(theta / (2 * np.pi) + np.arange(-400, 401)) / period
        f = f[f <= max(MAX_CHATTER_FREQUENCY_RATIO * self.plane.span[1], float(f.min()))]
        size: Array = np.linalg.norm(self.plane.response(f), axis=(1, 2))
        return float(f[np.argmax(size)])
