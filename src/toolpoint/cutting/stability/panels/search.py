"""Boundary points of general milling: the one-period map at one speed, its spectral radius over depth, roots and errors."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.cut.modal_state import ModalState, plane_with_static
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.levels import depth_levels
from toolpoint.cutting.stability.methods.search import mean_period
from toolpoint.cutting.stability.panels.arnoldi import OVERFLOW, lead
from toolpoint.cutting.stability.panels.balance import PLAIN, balance, decay_between_cuts
from toolpoint.cutting.stability.panels.between import changes_of_sign, complete_beside, complete_levels
from toolpoint.cutting.stability.panels.bumps import Level
from toolpoint.cutting.stability.panels.kernels import inverses, responses
from toolpoint.cutting.stability.panels.layout import CutPanels
from toolpoint.cutting.stability.panels.records import ModalWaves, PanelTimes, PeriodOperator
from toolpoint.cutting.stability.panels.store import PanelStore

FLOOR = 3e-8  # relative error of depth that rounding, secant and Arnoldi residual leave (worst seen 1.2e-8 of 488)
ROUNDED = 3.0  # on the error of rounded edges: a wall that begins to bound them halfway leaves roots in the integrands
FIRST = 14  # Arnoldi vectors before the first look at the residual, where nothing is known
LESS, MORE = 2, 8  # as many less than last time are tried first, as many more after a look that does not do
BEFORE, BEYOND = (1 / 3, 2 / 3), (1 / 8, 1 / 2)  # where between a root and its neighbours it is looked once more
CROSSED = 3e-4  # relative error of depth at which the search for a root with few nodes ends
EDGE = 0.02  # of a bracket beyond its ends
OTHER_BALANCE = 0.75  # share of the balance by which a root is looked at again
HIGHEST = 4.0  # times the highest mode: no line of the vibration beyond stands out
MOST = 160  # vectors of a basis


class PeriodMap:
    """The one-period map of the vibration at one spindle speed, for any depth: multipliers by Arnoldi's method."""

    def __init__(self, problem: MillingProblem, plane: PlaneDynamics, speed: float, least: int, points: int,
                 store: PanelStore, enough: dict[float, int] | None = None) -> None:
        self.problem, self.speed, self.omega = problem, speed, 2 * np.pi * speed / 60
        self.system = _modal_state(plane)
        # The state in metres, as the vibration is: a badly scaled map has eigenvalues that Arnoldi's method cannot resolve.
        size = np.linalg.norm(self.system.left, axis=0)
        self.left = np.ascontiguousarray((self.system.left / size).astype(complex))
        self.right = np.ascontiguousarray((self.system.right * size[:, None]).astype(complex))
        self.slowest = float((-self.system.poles.real).min())
        self.static = np.ascontiguousarray(plane.static)
        self.least, self.points, self.store = least, points, store
        self.damped = problem.process_damping > 0
        self.of: CutPanels | None = None
        self.vector = np.zeros(0)
        self.enough = {} if enough is None else enough  # Arnoldi vectors that were enough last time, by what was wanted
        self.overflow = False
        self.tilt = 1.0  # share of the balance that is applied: the multipliers do not depend on it but for rounding
        self.balances = False
        self.weight: FloatArray = np.zeros(0)

    def tilted(self, depth: float, waves: float, accuracy: float, *, tilt: float) -> ComplexArray:
        """Return the multipliers by another share of the balance; what differs is rounding."""
        self.of, self.tilt, vector = None, tilt, self.vector
        self.vector = np.zeros(0)
        values = self.multipliers(depth, waves, accuracy)
        self.of, self.tilt, self.vector = None, 1.0, vector
        return values

    def _times(self, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Time, s, and seconds a radian at these angles."""
        variation = self.problem.speed_variation
        if variation is None:
            return angle / self.omega, np.full(angle.shape, 1 / self.omega)
        return variation.clock(angle, self.omega), 1 / (self.omega * variation.factor(angle))

    def _set(self, panels: CutPanels) -> None:
        """Responses of the panels at this speed."""
        if self.of is panels:
            return
        self.of = panels
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
        self.balances = decay > PLAIN
        self.weight = np.zeros(0) if not self.balances else balance(
            panels.cutting, border, time, exponent=self.tilt * decay, size=d, states=2 * m)

    def multipliers(self, depth: float, waves: float, accuracy: float) -> ComplexArray:
        """Return the largest multipliers, largest first; the first's residual is below `accuracy`, or below a twentieth of its
        distance from the unit circle when `accuracy` is not met and the distance is all that matters (accuracy negative)."""
        panels = self.store.panels(self.problem, depth, waves, least=self.least, points=self.points)
        if panels.empty:
            values = np.exp(self.system.poles * mean_period(self.problem, self.speed))
            return values[np.argsort(-np.abs(values))]
        self._set(panels)
        operator = self.operator._replace(depth=panels.scale(depth))
        inverses(operator)
        size = panels.nodes * operator.layout.now.shape[1] + 2 * self.system.poles.size
        most, vector = min(size - 1, MOST), np.zeros(size)
        basis, h = self.store.room_for(most, size)
        basis[0] = self._start(size)
        plan = (accuracy, max(FIRST, self.enough.get(accuracy, 0) - LESS), MORE)
        now, values = lead(basis, h, vector, operator, self.weight, plan)
        if now == OVERFLOW:
            self.overflow = True
            return np.array([np.exp(600.0)], complex)  # taken as unstable, and marked in the chart's status
        self.vector, self.enough[accuracy] = vector, now
        return np.asarray(values)

    def _start(self, size: int) -> FloatArray:
        """Start of the Arnoldi basis: something in every direction, and the last Ritz vector where it fits."""
        start = _every_direction(size)
        if self.vector.size == size:
            start = start + 3 * self.vector
            start /= np.sqrt(start @ start)
        return start


@lru_cache(maxsize=256)
def _every_direction(size: int) -> FloatArray:
    """A unit vector with something in every direction."""
    start = np.cos(np.arange(size) * 1.7 + 0.3) + 0.1
    return np.asarray(start / np.linalg.norm(start))


@lru_cache(maxsize=4)
def _modal_state(plane: PlaneDynamics) -> ModalState:
    """The modal state of a plane, which all speeds of a chart share."""
    return ModalState(plane)


def waves_of(plane: PlaneDynamics, problem: MillingProblem, speed: float) -> float:
    """Nodes a radian that the modes' oscillation asks for: the highest mode with a thousandth of the largest flexibility.

    A wave needs about two nodes a radian less than its decay would: what falls without turning is followed three times as
    closely, for overdamped pairs are differences of two large exponentials.
    """
    size = np.abs(plane.residues).max(axis=(1, 2)) / np.maximum(-plane.poles.real, 1e-3 * np.abs(plane.poles))
    seen = plane.poles[size > 1e-3 * size.max()]
    top = float((np.abs(seen) + 2 * DECAY * np.maximum(-seen.real - 0.5 * np.abs(seen), 0.0)).max())
    swing = problem.speed_variation.amplitude if problem.speed_variation is not None else 0.0
    return 1.05 * top / (2 * np.pi * speed / 60 * (1 - swing))


DECAY = 2.0
Point = tuple[float, float]  # depth, growth
AGAIN = 4  # rounds of looking for more beside the roots that were new
Start = tuple[float, float]  # depth of a root, slope of the growth there


class PanelSearch:
    """Boundary points of one speed: levels of the spectral radius, roots between them, each solved again more finely."""

    def __init__(self, settings: tuple[int, int, float], problem: MillingProblem, speed: float, depth_max: float,
                 store: PanelStore, near: FloatArray | None = None) -> None:
        self.nodes, self.levels, self.tolerance = settings
        self.problem, self.speed, self.top, self.store = problem, speed, depth_max, store
        self.near = np.zeros((0, 2)) if near is None else near
        self.slopes: list[tuple[float, float]] = []
        self.plane = plane_with_static(problem, speed)
        self.waves = waves_of(self.plane, problem, speed)
        self.maps: dict[int, PeriodMap] = {}
        self.enough: dict[float, int] = {}
        self.is_normal = True  # whether rounding leaves every root within the tolerance

    def map(self, more: int) -> PeriodMap:
        """The map with `more` extra nodes on every panel."""
        if more not in self.maps:
            points = 4 + (2 if more else 0)
            self.maps[more] = PeriodMap(self.problem, self.plane, self.speed, self.nodes + more, points, self.store,
                                       self.enough)
        return self.maps[more]

    @property
    def overflow(self) -> bool:
        """Whether a depth was beyond double precision."""
        return any(period_map.overflow for period_map in self.maps.values())

    def growth(self, depth: float, more: int = 0, accuracy: float = -1e-10) -> tuple[float, complex]:
        """(log of the spectral radius, critical multiplier)."""
        value = self.map(more).multipliers(depth, self.waves * (1 + 0.1 * more), accuracy)[0]
        return float(np.log(max(abs(value), 1e-300))), complex(value)

    def rows(self) -> list[tuple[float, ...]]:
        """Rows (depth, theta, frequency, change, error).

        Beside every root it is looked for more: a band can open and close next to it (a flip lobe before a Hopf lobe), and
        nothing of that shows at the levels."""
        grid = depth_levels(self.problem, self.top, self.levels, power=1.5).tolist()
        self.store.levels.update(grid)
        levels = [self._look(w) for w in grid]
        levels = complete_levels([self._least(levels[0]), *levels], self._look)
        rows: list[tuple[float, ...]] = []
        for _ in range(AGAIN):
            fresh: list[Level] = []
            for low, high in changes_of_sign(levels):
                if not any(low.depth < row[0] < high.depth for row in rows):
                    row, slope = self._boundary((low.depth, low.growth), (high.depth, high.growth))
                    rows.append(row)
                    fresh += self._beside(row, slope, low, high)
            if not fresh:
                break
            levels = complete_beside(levels, fresh, self._look)
        return rows

    def _look(self, depth: float) -> Level:
        """The leading multipliers at a depth, well enough for a verdict."""
        return Level.of(depth, self.map(0).multipliers(depth, self.waves, -1e-6))

    def _beside(self, row: tuple[float, ...], slope: float, low: Level, high: Level) -> list[Level]:
        """Levels on both sides of a root, close to it and on the way to its neighbours."""
        w, near, a, b = row[0], 1e-6 * row[0] + 2 * row[-1], low.depth, high.depth
        if w - near <= a or w + near >= b:
            return []
        size = max(abs(slope) * near, 1e-300) * (1 if high.growth > 0 else -1)
        sides = [replace(self._look(w - near), growth=-size), replace(self._look(w + near), growth=size)]
        return [*sides, *(self._look(a + (w - a) * place) for place in BEFORE),
                *(self._look(w + (b - w) * place) for place in BEYOND)]

    def _least(self, first: Level) -> Level:
        """A depth so small that the cut is stable, from the first level down."""
        w = 0.02 * first.depth
        while True:
            place = self._look(w)
            if place.growth <= 0 or w < 1e-9 * self.top:
                return replace(place, growth=min(place.growth, -1e-12))
            w *= 0.1

    def _boundary(self, low: Point, high: Point) -> tuple[tuple[float, ...], float]:
        """Row of a root in a bracket, and the slope of the growth there."""
        a, b, rising = low[0], high[0], high[1] > 0
        a, b = a - EDGE * (b - a), b + EDGE * (b - a)  # with more nodes the root may lie beyond a level close to it
        best, error, mu, slope = self._solved(a, b, self._known(a, b, rising), rising)
        if not error < b - a:  # also where there was nothing near, or it led astray
            best, error, mu, slope = self._solved(a, b, self._crossed(low, high)[:2], rising)
        error = min(error + self._rounding(best, slope), b - a)
        self.slopes.append((best, slope))
        theta = abs(float(np.angle(mu)))
        if abs(mu.imag) < 1e-7 * abs(mu):
            theta = np.pi if mu.real < 0 else 0.0
        single = 1 if theta in (0.0, np.pi) else 2
        return (best, theta, self._frequency(theta), single if rising else -single, error), slope

    def _rounding(self, depth: float, slope: float) -> float:
        """Error of a root, m, that rounding of a far from normal map leaves: what another balance makes of its growth."""
        period_map = self.map(3)
        if not period_map.balances or slope == 0:
            return 0.0
        values = [period_map.tilted(depth, 1.3 * self.waves, -1e-10, tilt=tilt)[0] for tilt in (1.0, OTHER_BALANCE)]
        shift = abs(float(np.diff(np.log(np.maximum(np.abs(values), 1e-300)))[0]) / slope)
        self.is_normal &= shift <= self.tolerance * depth
        return shift

    def _known(self, a: float, b: float, rising: bool) -> Start | None:
        """Root and slope that a near problem had in this bracket."""
        inside = [(w, slope) for w, slope in self.near.tolist() if a < w < b and (slope > 0) == rising]
        return inside[0] if len(inside) == 1 else None

    def _crossed(self, low: Point, high: Point) -> tuple[float, float, float]:
        """Root to a few parts in ten thousand, slope and growth there: inverse quadratic interpolation, bisection where that is
        not safe (Chandrupatla, Advances in Engineering Software 28 (1997) 145)."""
        (b, gb), (a, ga) = low, high
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
            if abs(g) < CROSSED * w * min(abs(slope), abs(other)) or abs(b - a) < CROSSED * w:
                return w, slope if (slope > 0) == (high[1] > 0) else other, g
            place, part = (a - b) / (c - b), (ga - gb) / (gc - gb)
            share = 0.5
            if part**2 < place and (1 - part)**2 < 1 - place:
                share = ga / (gb - ga) * gc / (gb - gc) + (c - a) / (b - a) * ga / (gc - ga) * gb / (gc - gb)
            least = min(0.5, 0.1 * CROSSED * w / abs(b - a))
            share = min(max(share, least), 1 - least)

    def _solved(self, a: float, b: float, start: Start | None, rising: bool) -> tuple[float, float, complex, float]:
        """(root, error, multiplier, slope) from a start near it; the error is the bracket's width where there is no root."""
        if start is None:
            return a, b - a, 0j, 0.0
        w, slope = best, _ = start
        error, mu = b - a, 0j
        for more in (3, 6):
            w, slope, mu, sure = self._polished(w, slope if (slope > 0) == rising else 0.0, more, a, b)
            if sure and (slope > 0) != rising:
                # The root of a near problem led to the other end of a narrow band, which is no root of this bracket.
                return best, b - a, 0j, 0.0
            shift = abs(self.growth(w, more - 3)[0] / slope) if sure and slope else b - a
            shift *= ROUNDED if self.problem.tool.corner_radius > 0 else 1.0
            error, best = min(shift * (1 + shift / (b - a)) + FLOOR * w, b - a), w
            if error <= self.tolerance * w:
                break
        return best, error, mu, slope

    def _polished(self, w: float, slope: float, more: int, a: float, b: float) -> tuple[float, float, complex, bool]:
        """Root of the growth with `more` nodes near w by the secant rule, in the bracket where that fails; its slope, the
        multiplier, and whether it is a root."""
        from scipy.optimize import brentq

        g, mu = self.growth(w, more)
        for _ in range(8):
            new = w - g / slope if slope else np.nan
            if not a <= new <= b:
                break
            g_new, mu = self.growth(new, more)
            if abs(new - w) > 1e-8 * w and g_new != g:
                slope = (g_new - g) / (new - w)
            step, w, g = abs(new - w), new, g_new
            if step < 1e-10 * w or abs(g / slope) < 1e-10 * w:
                return w, slope, mu, True
        ends = {x: self.growth(x, more)[0] for x in (a, b)}
        if not np.isfinite(list(ends.values())).all() or (ends[a] > 0) == (ends[b] > 0):
            return w, slope, mu, False
        # At the ends what was seen first counts: a growth of nearly nothing may have the other sign when it is asked again.
        w = float(brentq(lambda x: ends[x] if x in ends else self.growth(x, more)[0], a, b, xtol=1e-12 * b, rtol=1e-10,
                         disp=False))
        delta = 1e-6 * (b - a) if w < 0.5 * (a + b) else -1e-6 * (b - a)
        g, mu = self.growth(w, more)
        return w, (self.growth(w + delta, more)[0] - g) / delta, mu, True

    def _frequency(self, theta: float) -> float:
        period = mean_period(self.problem, self.speed)
        f = np.abs(theta / (2 * np.pi) + np.arange(-400, 401)) / period
        f = f[f <= max(HIGHEST * self.plane.span[1], float(f.min()))]
        size: Array = np.linalg.norm(self.plane.response(f), axis=(1, 2))
        return float(f[np.argmax(size)])
