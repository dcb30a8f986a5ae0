"""HillSystem: the Hill matrix of one speed, roots of its determinant in (theta, depth), and the error of each root."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.hill.fourier import HillCut, hill_cut, is_plain, periods, range_of_forces
from toolpoint.cutting.stability.hill.kernels import fill_blocks
from toolpoint.cutting.stability.hill.noise import depth_variance
from toolpoint.cutting.stability.hill.response import HarmonicResponse

ROUNDING_ERROR_RATIO = 1e-9  # error of a depth by rounding, over that depth
DERIVATIVE_STEP = 1e-6  # rad of theta, and relative of depth: step of the numerical derivatives
MAX_KEPT_SHAPES = 40  # kept Fourier series of a shaped cut, one for each depth
HARMONIC_REACH = 3  # highest harmonic whose influence on a root is estimated, over that of the matrix
SECOND_ORDER_FACTOR = 3.0  # on the square of a stated error over the depth, which first-order changes leave out
KEPT_FIRST_LINES = (0, 1)  # first line of every other one that stays
# On the stated error of a measured FRF, which is of first order and leaves out modes above the band.
MEASURED_SAFETY_FACTOR = 1.5


@dataclass(frozen=True)
class Root:
    """Root of the determinant, at which an eigenvalue of the Hill matrix vanishes.

    theta : angle of the multiplier, rad; depth : m; left, right : (rows,) null vectors, their product one; by_theta, by_depth :
    derivatives of the vanishing eigenvalue, 1/rad and 1/m; step : last change of depth, m; real : whether theta is held at 0 or
    pi (one real multiplier), else a conjugate pair crosses.
    """

    theta: float
    depth: float
    left: ComplexArray
    right: ComplexArray
    by_theta: complex
    by_depth: complex
    step: float
    real: bool

    @property
    def change(self) -> int:
        """Change of the number of unstable multipliers when the depth grows: 1 or -1 of a real one, 2 or -2 of a pair.

        The multiplier is exp(i theta): it leaves the unit circle where theta(depth) gets a negative imaginary part.
        """
        return (1 if self.real else 2) * (1 if (self.by_depth * np.conj(self.by_theta)).imag > 0 else -1)

    @property
    def factor(self) -> complex:
        """kappa, m: the depth moves by the real part of kappa times a change of the vanishing eigenvalue."""
        if self.real:
            return complex(-1 / self.by_depth)
        area = (np.conj(self.by_theta) * self.by_depth).imag
        return complex(1j * np.conj(self.by_theta) / area) if area else complex(np.inf)

    def moved(self, change: complex) -> tuple[float, float]:
        """Return the changes of (theta, rad; depth, m) that undo a change of the vanishing eigenvalue, to first order."""
        if self.real:
            return 0.0, float((-change / self.by_depth).real)
        a, b = self.by_theta, self.by_depth
        area = (np.conj(a) * b).imag
        if area == 0:
            return np.inf, np.inf
        return float(-(np.conj(change) * b).imag / area), float(-(np.conj(a) * change).imag / area)


class HillSystem:
    """Hill matrix G(i omega_k) A_{k-l}(theta, depth) of one speed (rev/min), and roots of det(I + that).

    Its unknowns are the harmonics -order_max .. order_max of the vibration in the directions that change the chip; theta is in
    rad, depth in m. A plain cut has a matrix proportional to depth: `unit` is its series for one metre.
    """

    def __init__(self, problem: MillingProblem, speed: float, response: HarmonicResponse) -> None:
        self.problem, self.response, self.is_linear = problem, response, is_plain(problem)
        self.omega = 2 * np.pi * speed / 60  # rad/s of the spindle
        self.period = 60 / (periods(problem) * speed)
        # Rounded to the nearest: with theta in -pi .. pi a harmonic lies up to half an order on either side of its number.
        self.order_max = int(np.floor(response.frequency_max * self.period + 0.5))
        self.harmonics = np.arange(-self.order_max, self.order_max + 1)
        self.directions = _chip_directions(problem, response)
        self.cuts: dict[float, HillCut] = {}
        self.unit = self.basis = None
        self.parts: list[ComplexArray] | None = None
        if self.is_linear:
            self.unit = hill_cut(problem, 1.0, 2 * self.order_max)
            self.basis = range_of_forces(problem, self.order_max)

    @staticmethod
    def rows(problem: MillingProblem, speed: float, response: HarmonicResponse) -> int:
        """Return the number of rows of the matrix of this speed."""
        order_max = int(np.floor(response.frequency_max * 60 / (periods(problem) * speed) + 0.5))
        return (2 * order_max + 1) * _chip_directions(problem, response).size

    @property
    def size(self) -> int:
        """Rows of the matrix."""
        return self.harmonics.size * self.directions.size

    def cut(self, depth: float) -> HillCut:
        """Return the Fourier coefficients of the cut at this depth."""
        if self.unit is not None:
            return self.unit.scaled(depth)
        if depth not in self.cuts:
            if len(self.cuts) >= MAX_KEPT_SHAPES:
                self.cuts.clear()
            self.cuts[depth] = hill_cut(self.problem, depth, 2 * self.order_max)
        return self.cuts[depth]

    def hertz(self, theta: float, harmonics: Array) -> FloatArray:
        """Return the frequencies (theta/(2 pi) + k)/T of the harmonics k, (n,) Hz."""
        return (theta / (2 * np.pi) + harmonics) / self.period

    def block(self, theta: float, cut: HillCut, rows: Array, *, columns: Array, response: ComplexArray) -> ComplexArray:
        """Return response (rows, a, d) times force of harmonics `columns` at harmonics `rows`, both consecutive numbers.

        The result has (rows times a, columns times directions) entries, without the unit matrix.
        """
        hz = self.hertz(theta, columns)
        turned = np.exp(-1j * (2 * np.pi * hz / self.omega)[:, None] * cut.delay)
        rate = self._rate(hz)
        n_directions = self.directions.size
        out = np.empty((rows.size * response.shape[1], columns.size * n_directions), complex)
        fill_blocks(*_forces_by_direction(cut, n_directions), turned, rate, np.ascontiguousarray(response),
                    rows[0], columns[0], out)
        return out

    def matrix(self, theta: float, cut: HillCut) -> ComplexArray:
        """Return the Hill matrix (size, size), without the unit matrix."""
        g = self.response.at(self.hertz(theta, self.harmonics))[:, self.directions]
        return self.block(theta, cut, self.harmonics, columns=self.harmonics, response=g)

    def eigenvalues(self, theta: float) -> ComplexArray:
        """Return the non-zero eigenvalues of a plain cut's matrix, (rank,) 1/m, from the range of its forces.

        The forces span fewer directions than the matrix has rows: F G V on their basis V has the same non-zero eigenvalues.
        """
        assert self.unit is not None and self.basis is not None
        if self.basis.shape[1] >= self.size:
            return np.linalg.eigvals(self.matrix(theta, self.unit))
        g = self.response.at(self.hertz(theta, self.harmonics))[:, self.directions]
        vibration = np.matmul(g, self.basis.reshape(self.harmonics.size, -1, self.basis.shape[1]))
        return np.linalg.eigvals(self._force_in_range(theta) @ vibration.reshape(self.size, -1))

    def _force_in_range(self, theta: float) -> ComplexArray:
        """Return the force of the harmonics in the range of the cut's forces, (rank, rows), per metre of depth.

        It is linear in what theta turns: the own force, that of every delay by exp(-i omega delay), the damping by i omega. The
        products of each with the basis are made once a speed.
        """
        assert self.unit is not None
        if self.parts is None:
            self.parts = self._range_parts()
        hz, n_directions = self.hertz(theta, self.harmonics), self.directions.size
        turned = np.exp(-1j * (2 * np.pi * hz / self.omega)[:, None] * self.unit.delay)
        direct, damped, *late = self.parts
        force = direct - sum(np.repeat(turned[:, q], n_directions) * part for q, part in enumerate(late))
        if self.problem.process_damping > 0:
            force = force + np.repeat(self._rate(hz), n_directions) * damped
        return np.asarray(force)

    def _range_parts(self) -> list[ComplexArray]:
        """Return the basis times own force, damping, and the force of every delay, each (rank, rows)."""
        assert self.unit is not None and self.basis is not None
        count, n_directions, cut = self.harmonics.size, self.directions.size, self.unit
        delays = cut.delay.size
        zero, none = np.zeros((count, delays), complex), np.zeros(count, complex)
        largest = float(np.abs(self._rate(self.hertz(np.pi, self.harmonics))).max()) or 1.0  # no digits lost in the difference
        inputs = [(zero, none), (zero, none + largest)]
        for q in range(delays):
            single = zero.copy()
            single[:, q] = 1
            inputs.append((single, none))
        parts = []
        for turned, rate in inputs:
            out = np.empty((self.basis.shape[0], count * n_directions), complex)
            fill_blocks(*_forces_by_direction(cut, n_directions), turned, rate,
                        np.ascontiguousarray(self._unit_response(count)),
                        self.harmonics[0], self.harmonics[0], out)
            parts.append(self.basis.conj().T @ out)
        direct, damped, *late = parts
        return [direct, (damped - direct) / largest, *(direct - part for part in late)]

    def _rate(self, hz: FloatArray) -> ComplexArray:
        """Return i omega C / v of process damping at these frequencies (Hz), N/m^2; v is the speed of the edge."""
        return np.asarray(2j * np.pi * hz * self.problem.process_damping / (self.omega * self.problem.tool.radius))

    def _unit_response(self, number: int) -> ComplexArray:
        """Return unit matrices (number, d, d), with which `block` gives the force itself."""
        d = self.problem.plane.size
        return np.broadcast_to(np.eye(d, dtype=complex), (number, d, d))

    def root(self, theta: float, depth: float, real: bool = False,
             *, within: tuple[float, float] = (-np.inf, np.inf)) -> Root | None:
        """Return the root near (theta, depth) by Newton's method on the vanishing eigenvalue; with `real` theta stays.

        within : two depths, m. None where 14 steps do not settle, or leave these depths by more than half their distance.
        """
        margin = 0.5 * (within[1] - within[0])  # infinite where anywhere will do
        state: Root | None = None
        for turn in range(14):
            state, value = self._linearise(theta, depth, real, state, self.is_linear or turn < 3)
            if not np.isfinite(value) or state.by_depth == 0:
                return None
            dtheta, ddepth = state.moved(value)
            if abs(ddepth) < 1e-10 * depth and abs(dtheta) < 1e-9:
                return replace(state, step=abs(ddepth))
            if not within[0] - margin < depth + ddepth < within[1] + margin:
                return None
            # Beyond a few tenths the linearisation tells nothing: an unbounded first step would end at another lobe's root.
            theta += float(np.clip(dtheta, -0.3, 0.3))
            depth += float(np.clip(ddepth, -0.3 * depth, 0.3 * depth))
            if not -0.3 < theta < np.pi + 0.3:
                return None
        return None

    def near(self, theta: float, depth: float) -> Root:
        """Linearise the determinant here without going to its root; `step` of the result is the distance to it."""
        root, value = self._linearise(theta, depth, False, None, True)
        return replace(root, step=abs(root.moved(value)[1]))

    def _linearise(self, theta: float, depth: float, real: bool, last: Root | None, renewed: bool) -> tuple[Root, complex]:
        """Return the eigenvalue nearest zero with its vectors and derivatives as a Root, and its value.

        last : state of the step before, whose vectors begin the iteration; renewed : whether the derivative by depth is taken
        anew, which costs a Fourier series of a shaped cut.
        """
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        left, right = _null_vectors(m, None if last is None else (last.left, last.right))
        right = right / np.vdot(left, right)
        value = complex(np.vdot(left, m @ right))

        def slope(matrix: ComplexArray, step: float) -> complex:
            return complex((np.vdot(left, matrix @ right) + 1 - value) / step)

        by_theta = slope(self.matrix(theta + DERIVATIVE_STEP, self.cut(depth)), DERIVATIVE_STEP)
        if self.is_linear:  # the matrix is I + depth H
            by_depth = (value - 1) / depth
        elif renewed or last is None:
            by_depth = slope(self.matrix(theta, self.cut(depth * (1 + DERIVATIVE_STEP))), DERIVATIVE_STEP * depth)
        else:
            # Near the root the derivative hardly changes, and Newton's method only converges a little more slowly with an
            # old one.
            by_depth = last.by_depth
        return Root(theta, depth, left, right, by_theta, by_depth, 0.0, real), value

    def sign(self, theta: float, depth: float) -> float:
        """Return the determinant at theta = 0 or pi, where it is real, with its sign and a root of its modulus.

        The root, of order a quarter of the rows and at least eight, keeps it within the range of numbers.
        """
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        sign, log = np.linalg.slogdet(m)
        return float(sign.real * np.exp(log / max(8, m.shape[0] // 4)))

    def logarithm(self, theta: float, depth: float) -> complex:
        """Return the logarithm of the determinant, its phase in -pi .. pi."""
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        sign, log = np.linalg.slogdet(m)
        return complex(log, np.angle(sign))

    def corrected(self, root: Root) -> tuple[float, float, float]:
        """Return (theta, depth, stated error): first-order changes of the root by all that the response leaves out.

        Modes: the harmonics beyond the matrix, added to the root; their sum up to any of them is at most the stated error. A
        measured FRF: its upper tenth left out, the mass line above the band, what may lie below it, and the interpolation
        between lines; stated, not added.
        """
        wide_harmonics = np.arange(-HARMONIC_REACH * (self.order_max + 1), HARMONIC_REACH * (self.order_max + 1) + 1)
        hz = self.hertz(root.theta, wide_harmonics)
        left, push = self._extend_vectors(root, wide_harmonics)

        # Harmonics in the order of their frequency: partial sums bound what a cut anywhere among them would leave.
        def moved(response: ComplexArray) -> tuple[float, float, float]:
            terms = np.einsum("ka,kac,kc->k", left, response[:, self.directions], push)
            sums = np.cumsum(terms[np.argsort(np.abs(hz))])
            return *root.moved(complex(sums[-1])), max(abs(root.moved(complex(part))[1]) for part in sums)

        dtheta, depth, error = moved(self.response.beyond(hz))
        error *= 1.0 if self.response.plane.is_modal else MEASURED_SAFETY_FACTOR
        floor = ROUNDING_ERROR_RATIO * root.depth + 2 * root.step
        if self.response.plane.is_modal:
            return root.theta + dtheta, root.depth + depth, error * (1 + SECOND_ORDER_FACTOR * error / root.depth) + floor
        error += MEASURED_SAFETY_FACTOR * (abs(moved(self.response.upper(hz))[1]) + abs(moved(self.response.below(hz))[1]))
        noise, scatters = self._noise(root, hz, left, push)
        spaced = [moved(self.response.between(hz, first))[1] for first in KEPT_FIRST_LINES]
        # Leaving out every other line changes noise too: of that, what two deviations explain is no error of interpolation.
        error += MEASURED_SAFETY_FACTOR * max(float(np.sqrt(max(change**2 - 4 * scatter, 0.0)))
                                              for change, scatter in zip(spaced, scatters, strict=True))
        return root.theta, root.depth, sum(e * (1 + SECOND_ORDER_FACTOR * e / root.depth) for e in (error, noise)) + floor

    def _noise(self, root: Root, hz: FloatArray, left: ComplexArray, push: ComplexArray) -> tuple[float, list[float]]:
        """Return half the 95 % interval of the depth by noise, m, and a variance, m^2, for each of `KEPT_FIRST_LINES`.

        The variances are those of the change of depth, by noise, when every other line is left out: the odd or the even ones.
        """
        influence = np.zeros((hz.size, push.shape[1], push.shape[1]), complex)
        influence[:, self.directions] = left[:, :, None] * push[:, None, :]
        plane, variance = self.response.plane, self.response.variance
        assert variance is not None
        variance_of_depth, *halved = (depth_variance(plane, variance, hz, influence=influence, factor=root.factor,
                                                     kept_lines=kept_lines)
                                      for kept_lines in (None, *(slice(first, None, 2) for first in KEPT_FIRST_LINES)))
        # Limits of draws hold their noise: stated here too, it would count twice.
        noise = 0.0 if plane.draws is not None else NORMAL_QUANTILE_95 * float(np.sqrt(variance_of_depth))
        return noise, halved

    def _extend_vectors(self, root: Root, wide_harmonics: Array) -> tuple[ComplexArray, ComplexArray]:
        """Return left null vector (wide, directions) and force (wide, d) of a root at harmonics beyond the matrix too.

        wide_harmonics : (wide,) consecutive numbers about zero. The left vector follows from one step of the matrix itself.
        """
        cut = hill_cut(self.problem, root.depth, self.order_max + int(wide_harmonics[-1]))
        push = self.block(root.theta, cut, wide_harmonics, columns=self.harmonics,
                          response=self._unit_response(wide_harmonics.size)) @ root.right
        g = self.response.at(self.hertz(root.theta, self.harmonics))[:, self.directions]
        left = -(root.left.conj() @ self.block(root.theta, cut, self.harmonics, columns=wide_harmonics,
                                               response=g)).reshape(wide_harmonics.size,
                                                                                                                             -1)
        left[np.abs(wide_harmonics) <= self.order_max] = root.left.conj().reshape(-1, self.directions.size)
        return left, push.reshape(wide_harmonics.size, -1)


def _chip_directions(problem: MillingProblem, response: HarmonicResponse) -> Array:
    """Return the indices of the directions that change a chip's thickness: x, y, and z of a tool with a corner radius.

    Directions in which the tool does not move are left out where they are the last; the kernel needs an array without gaps.
    """
    plane = response.plane
    motion = np.abs(plane.residues if plane.values is None else plane.values).max(axis=(0, 2))
    sides = plane.size if problem.tool.corner_radius > 0 else 2
    return np.arange(1 + int(np.flatnonzero(motion[:sides] > 0).max(initial=0)))


def _forces_by_direction(cut: HillCut, n_directions: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the force by the present vibration, by its rate, and by that of a delay ago, for the chip's directions.

    The arrays are copied whole: for parts of larger ones the kernel would be compiled once more.
    """
    now, drag, late = (np.ascontiguousarray(each[..., :n_directions]) for each in (cut.now, cut.drag, cut.late))
    return now, drag, late


def _null_vectors(m: ComplexArray, start: tuple[ComplexArray, ComplexArray] | None) -> tuple[ComplexArray, ComplexArray]:
    """Return the left and right eigenvectors (n,) of the eigenvalue nearest zero by inverse iteration, from `start`."""
    n = m.shape[0]
    factors, pivots, _ = zgetrf(m)
    # Newton's iteration may hit a root to the last digit: a zero pivot then stands for one of rounding's size, which gives
    # the null vectors at once; dividing by zero would lose the best of all roots.
    pivot_min = np.finfo(float).eps * max(float(np.abs(m).max()), np.finfo(float).tiny)
    diagonal = np.arange(n)
    factors[diagonal, diagonal] = np.where(factors[diagonal, diagonal] == 0, pivot_min, factors[diagonal, diagonal])
    left, right = (np.cos(np.arange(n) * 1.3 + 0.2) + 0j,) * 2 if start is None else start
    for _ in range(2 if start is not None else 6):
        right, _ = zgetrs(factors, pivots, right)
        right = right / np.linalg.norm(right)
        left, _ = zgetrs(factors, pivots, left, trans=2)
        left = left / np.linalg.norm(left)
    return left, right
