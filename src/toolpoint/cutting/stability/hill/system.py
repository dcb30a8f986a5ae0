"""HillSystem: the Hill matrix of one speed, roots of its determinant in (theta, depth), and the error of each root."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.hill.fourier import HillCut, hill_cut, is_plain, periods, range_of_forces
from toolpoint.cutting.stability.hill.kernels import fill_blocks
from toolpoint.cutting.stability.hill.noise import NORMAL_95, depth_variance
from toolpoint.cutting.stability.hill.response import HarmonicResponse

FLOOR = 1e-9  # relative error of depth that rounding leaves
SMALL = 1e-6  # step of the numerical derivatives
KEPT = 40  # shapes
REACH = 3  # harmonics whose influence on a root is estimated, over those of the matrix
CURVED = 3.0  # on the square of a stated error over the depth, which first-order changes leave out
SAFETY = 1.5  # on the stated error of a measured FRF, which is of first order and knows nothing of modes above the band


@dataclass(frozen=True)
class Root:
    """A root of the determinant: angle of the multiplier, depth, null vectors, derivatives of the vanishing eigenvalue."""

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
        """Multipliers that leave the unit circle when the depth grows: those of theta with a negative imaginary part."""
        return (1 if self.real else 2) * (1 if (self.by_depth * np.conj(self.by_theta)).imag > 0 else -1)

    @property
    def factor(self) -> complex:
        """kappa: the depth moves by the real part of kappa times a change of the vanishing eigenvalue."""
        if self.real:
            return complex(-1 / self.by_depth)
        area = (np.conj(self.by_theta) * self.by_depth).imag
        return complex(1j * np.conj(self.by_theta) / area) if area else complex(np.inf)

    def moved(self, change: complex) -> tuple[float, float]:
        """How far (theta, depth) move when the vanishing eigenvalue is changed by this much."""
        if self.real:
            return 0.0, float((-change / self.by_depth).real)
        a, b = self.by_theta, self.by_depth
        area = (np.conj(a) * b).imag
        if area == 0:
            return np.inf, np.inf
        return float(-(np.conj(change) * b).imag / area), float(-(np.conj(a) * change).imag / area)


class HillSystem:
    """det(I + G(i omega_k) A_{k-l}(theta, depth)) of one speed: harmonics of the vibration in the directions a chip sees."""

    def __init__(self, problem: MillingProblem, speed: float, response: HarmonicResponse) -> None:
        self.problem, self.response, self.plain = problem, response, is_plain(problem)
        self.omega = 2 * np.pi * speed / 60
        self.period = 60 / (periods(problem) * speed)
        self.top = int(np.floor(response.top * self.period + 0.5))
        self.harmonics = np.arange(-self.top, self.top + 1)
        self.seen = _seen(problem, response)
        self.kept: dict[float, HillCut] = {}
        self.unit = self.basis = None
        self.parts: list[ComplexArray] | None = None
        if self.plain:
            self.unit = hill_cut(problem, 1.0, 2 * self.top)
            self.basis = range_of_forces(problem, self.top)

    @staticmethod
    def rows(problem: MillingProblem, speed: float, response: HarmonicResponse) -> int:
        """Rows that the matrix of this speed has."""
        top = int(np.floor(response.top * 60 / (periods(problem) * speed) + 0.5))
        return (2 * top + 1) * _seen(problem, response).size

    @property
    def size(self) -> int:
        """Rows of the matrix."""
        return self.harmonics.size * self.seen.size

    def cut(self, depth: float) -> HillCut:
        """The Fourier coefficients of the cut at this depth."""
        if self.unit is not None:
            return self.unit.scaled(depth)
        if depth not in self.kept:
            if len(self.kept) >= KEPT:
                self.kept.clear()
            self.kept[depth] = hill_cut(self.problem, depth, 2 * self.top)
        return self.kept[depth]

    def hertz(self, theta: float, harmonics: Array) -> FloatArray:
        """Frequencies of the harmonics, Hz."""
        return (theta / (2 * np.pi) + harmonics) / self.period

    def block(self, theta: float, cut: HillCut, rows: Array, *, columns: Array, response: ComplexArray) -> ComplexArray:
        """Response times force of the harmonics `columns` at the harmonics `rows`, without the unit matrix."""
        hz = self.hertz(theta, columns)
        turned = np.exp(-1j * (2 * np.pi * hz / self.omega)[:, None] * cut.delay)
        rate = self._rate(hz)
        seen = self.seen.size
        out = np.empty((rows.size * response.shape[1], columns.size * seen), complex)
        fill_blocks(*_seen_by(cut, seen), turned, rate, np.ascontiguousarray(response), rows[0], columns[0], out)
        return out

    def matrix(self, theta: float, cut: HillCut) -> ComplexArray:
        """The Hill matrix, without the unit matrix."""
        g = self.response.at(self.hertz(theta, self.harmonics))[:, self.seen]
        return self.block(theta, cut, self.harmonics, columns=self.harmonics, response=g)

    def eigenvalues(self, theta: float) -> ComplexArray:
        """Eigenvalues of a plain cut's matrix per metre of depth that are not zero, from the range of its forces."""
        assert self.unit is not None and self.basis is not None
        if self.basis.shape[1] >= self.size:
            return np.linalg.eigvals(self.matrix(theta, self.unit))
        g = self.response.at(self.hertz(theta, self.harmonics))[:, self.seen]
        vibration = np.matmul(g, self.basis.reshape(self.harmonics.size, -1, self.basis.shape[1]))
        return np.linalg.eigvals(self._force_in_range(theta) @ vibration.reshape(self.size, -1))

    def _force_in_range(self, theta: float) -> ComplexArray:
        """Force of the harmonics in the range of the cut's forces, (rank, rows), per metre of depth.

        It is linear in what theta turns: the own force, that of every delay by exp(-i omega delay), the damping by i omega. The
        products of each with the basis are made once a speed.
        """
        assert self.unit is not None
        if self.parts is None:
            self.parts = self._range_parts()
        hz, seen = self.hertz(theta, self.harmonics), self.seen.size
        turned = np.exp(-1j * (2 * np.pi * hz / self.omega)[:, None] * self.unit.delay)
        direct, damped, *late = self.parts
        force = direct - sum(np.repeat(turned[:, q], seen) * part for q, part in enumerate(late))
        if self.problem.process_damping > 0:
            force = force + np.repeat(self._rate(hz), seen) * damped
        return np.asarray(force)

    def _range_parts(self) -> list[ComplexArray]:
        """The basis times own force, damping, and the force of every delay, each (rank, rows)."""
        assert self.unit is not None and self.basis is not None
        count, seen, cut = self.harmonics.size, self.seen.size, self.unit
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
            out = np.empty((self.basis.shape[0], count * seen), complex)
            fill_blocks(*_seen_by(cut, seen), turned, rate, np.ascontiguousarray(self._unit_response(count)),
                        self.harmonics[0], self.harmonics[0], out)
            parts.append(self.basis.conj().T @ out)
        direct, damped, *late = parts
        return [direct, (damped - direct) / largest, *(direct - part for part in late)]

    def _rate(self, hz: FloatArray) -> ComplexArray:
        """i omega C / v of process damping at these frequencies."""
        return np.asarray(2j * np.pi * hz * self.problem.process_damping / (self.omega * self.problem.tool.radius))

    def _unit_response(self, number: int) -> ComplexArray:
        d = self.problem.plane.size
        return np.broadcast_to(np.eye(d, dtype=complex), (number, d, d))

    def root(self, theta: float, depth: float, real: bool = False,
             *, within: tuple[float, float] = (-np.inf, np.inf)) -> Root | None:
        """The root near (theta, depth) by Newton's method on the vanishing eigenvalue; with `real` theta stays.

        None where the steps do not settle or leave these depths by more than half their distance.
        """
        margin = 0.5 * (within[1] - within[0])  # infinite where anywhere will do
        near: Root | None = None
        for turn in range(14):
            near, value = self._linear(theta, depth, real, near, self.plain or turn < 3)
            if not np.isfinite(value) or near.by_depth == 0:
                return None
            dtheta, ddepth = near.moved(value)
            if abs(ddepth) < 1e-10 * depth and abs(dtheta) < 1e-9:
                return replace(near, step=abs(ddepth))
            if not within[0] - margin < depth + ddepth < within[1] + margin:
                return None
            theta += float(np.clip(dtheta, -0.3, 0.3))
            depth += float(np.clip(ddepth, -0.3 * depth, 0.3 * depth))
            if not -0.3 < theta < np.pi + 0.3:
                return None
        return None

    def near(self, theta: float, depth: float) -> Root:
        """What is known of a root here without going to it; `step` is the distance to it."""
        root, value = self._linear(theta, depth, False, None, True)
        return replace(root, step=abs(root.moved(value)[1]))

    def _linear(self, theta: float, depth: float, real: bool, last: Root | None, renewed: bool) -> tuple[Root, complex]:
        """(null vectors and derivatives of the eigenvalue nearest zero, its value)."""
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        left, right = _null_vectors(m, None if last is None else (last.left, last.right))
        right = right / np.vdot(left, right)
        value = complex(np.vdot(left, m @ right))

        def slope(at: ComplexArray, step: float) -> complex:
            return complex((np.vdot(left, at @ right) + 1 - value) / step)

        by_theta = slope(self.matrix(theta + SMALL, self.cut(depth)), SMALL)
        if self.plain:  # the matrix is I + depth H
            by_depth = (value - 1) / depth
        elif renewed or last is None:
            by_depth = slope(self.matrix(theta, self.cut(depth * (1 + SMALL))), SMALL * depth)
        else:
            by_depth = last.by_depth
        return Root(theta, depth, left, right, by_theta, by_depth, 0.0, real), value

    def sign(self, theta: float, depth: float) -> float:
        """The determinant at theta = 0 or pi, where it is real, scaled to the size of a signed n-th root."""
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        sign, log = np.linalg.slogdet(m)
        return float(sign.real * np.exp(log / max(8, m.shape[0] // 4)))

    def logarithm(self, theta: float, depth: float) -> complex:
        """Logarithm of the determinant, its phase in -pi .. pi."""
        m = self.matrix(theta, self.cut(depth))
        np.fill_diagonal(m, m.diagonal() + 1)
        sign, log = np.linalg.slogdet(m)
        return complex(log, np.angle(sign))

    def corrected(self, root: Root) -> tuple[float, float, float]:
        """(theta, depth, stated error): first-order changes of the root by all that the response leaves out.

        Modes: the harmonics beyond the matrix, added to the root; their sum up to any of them is at most the stated error. A
        measured FRF: its upper tenth left out, the mass line above the band, what may lie below it, and the interpolation
        between lines; stated, not added.
        """
        wide = np.arange(-REACH * (self.top + 1), REACH * (self.top + 1) + 1)
        hz = self.hertz(root.theta, wide)
        left, push = self._extended(root, wide)

        def moved(response: ComplexArray) -> tuple[float, float, float]:
            terms = np.einsum("ka,kac,kc->k", left, response[:, self.seen], push)
            sums = np.cumsum(terms[np.argsort(np.abs(hz))])
            return *root.moved(complex(sums[-1])), max(abs(root.moved(complex(part))[1]) for part in sums)

        dtheta, depth, error = moved(self.response.beyond(hz))
        error *= 1.0 if self.response.plane.is_modal else SAFETY
        floor = FLOOR * root.depth + 2 * root.step
        if self.response.plane.is_modal:
            return root.theta + dtheta, root.depth + depth, error * (1 + CURVED * error / root.depth) + floor
        error += SAFETY * (abs(moved(self.response.upper(hz))[1]) + abs(moved(self.response.below(hz))[1]))
        noise, scatter = self._noise(root, hz, left, push)
        spaced = max(abs(moved(self.response.between(hz, first))[1]) for first in (0, 1))
        # Leaving out every other line changes noise too: of that, what two deviations explain is no error of interpolation.
        error += SAFETY * float(np.sqrt(max(spaced**2 - 4 * scatter, 0.0)))
        return root.theta, root.depth, sum(e * (1 + CURVED * e / root.depth) for e in (error, noise)) + floor

    def _noise(self, root: Root, hz: FloatArray, left: ComplexArray, push: ComplexArray) -> tuple[float, float]:
        """(half the 95 % interval of the depth by noise, m; variance by noise of that when every other line is left out)."""
        influence = np.zeros((hz.size, push.shape[1], push.shape[1]), complex)
        influence[:, self.seen] = left[:, :, None] * push[:, None, :]
        plane, variance = self.response.plane, self.response.variance
        assert variance is not None
        whole, halved = (depth_variance(plane, variance, hz, influence=influence, factor=root.factor, less=less)
                         for less in (None, slice(0, None, 2)))
        return NORMAL_95 * float(np.sqrt(whole)), halved

    def _extended(self, root: Root, wide: Array) -> tuple[ComplexArray, ComplexArray]:
        """Left null vector (harmonics, seen) and force (harmonics, d) of a root, at harmonics beyond the matrix too."""
        cut = hill_cut(self.problem, root.depth, self.top + int(wide[-1]))
        push = self.block(root.theta, cut, wide, columns=self.harmonics, response=self._unit_response(wide.size)) @ root.right
        g = self.response.at(self.hertz(root.theta, self.harmonics))[:, self.seen]
        left = -(root.left.conj() @ self.block(root.theta, cut, self.harmonics, columns=wide, response=g)).reshape(wide.size,
                                                                                                                   -1)
        left[np.abs(wide) <= self.top] = root.left.conj().reshape(-1, self.seen.size)
        return left, push.reshape(wide.size, -1)


def _seen(problem: MillingProblem, response: HarmonicResponse) -> Array:
    """Directions that a chip's thickness depends on and in which the tool moves; the last ones are left out alone."""
    plane = response.plane
    moves = np.abs(plane.residues if plane.values is None else plane.values).max(axis=(0, 2))
    sides = plane.size if problem.tool.corner_radius > 0 else 2
    return np.arange(1 + int(np.flatnonzero(moves[:sides] > 0).max(initial=0)))


def _seen_by(cut: HillCut, seen: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the force by what is seen of the vibration now, by its rate, and by that of a delay ago: whole arrays, as the
    kernel would be compiled for parts of larger ones too."""
    now, drag, late = (np.ascontiguousarray(each[..., :seen]) for each in (cut.now, cut.drag, cut.late))
    return now, drag, late


def _null_vectors(m: ComplexArray, start: tuple[ComplexArray, ComplexArray] | None) -> tuple[ComplexArray, ComplexArray]:
    """Left and right eigenvectors of the eigenvalue nearest zero by inverse iteration."""
    n = m.shape[0]
    factors, pivots, _ = zgetrf(m)
    # Newton's iteration may hit a root to the last digit: a zero pivot then stands for one of rounding's size, which gives
    # the null vectors at once; dividing by zero would lose the best of all roots.
    least = np.finfo(float).eps * max(float(np.abs(m).max()), np.finfo(float).tiny)
    at = np.arange(n)
    factors[at, at] = np.where(factors[at, at] == 0, least, factors[at, at])
    left, right = (np.cos(np.arange(n) * 1.3 + 0.2) + 0j,) * 2 if start is None else start
    for _ in range(2 if start is not None else 6):
        right, _ = zgetrs(factors, pivots, right)
        right = right / np.linalg.norm(right)
        left, _ = zgetrs(factors, pivots, left, trans=2)
        left = left / np.linalg.norm(left)
    return left, right
