"""Compiled kernels of FloquetDeterminant: the periodic Green matrix, its determinant as a polynomial in depth, counts.

Everything is scaled: s = w/w_max in [0, 1]; D(theta, s) = det(I + s M(theta)), M = w_max (1 - nu) K(theta),
nu = exp(-i theta). A polynomial's coefficients come from a Hessenberg form of M.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numba as nb
import numpy as np

from toolpoint._check import Array, ComplexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.far_call import address_of, caller_of
from toolpoint.cutting.stability.floquet.records import ArcSet, Green, HillLines, Room, Turning

MAX_POINTS = 48
MAX_NODES = 1500


@inner_njit(cache=True, nogil=True)
def turning_at(period: float, omega: float, w_max: float, poles: ComplexArray) -> Turning:
    """Return the `Turning` of one speed."""
    factors = np.empty(poles.size, np.complex128)
    for r in range(poles.size):
        factors[r] = np.exp(poles[r] * period)
    return Turning(period, omega, w_max, poles, factors)


@inner_njit(cache=True, nogil=True, fastmath=False)
def green_at(turning: Turning, nodes: ArcSet) -> Green:
    """Return the parts of the Green matrix at one speed that do not depend on theta."""
    period, omega, poles = turning.period, turning.omega, turning.poles
    pairs, weight, partial, angle = nodes.pairs, nodes.weight, nodes.partial, nodes.angle
    n, q = poles.size, angle.size
    wrapped = np.empty((n, 2, q * q))
    direct = nodes.static.copy()
    for r in range(n):
        s = poles[r]
        period_factor = np.exp(s * period)
        rise, fall = np.empty(q, np.complex128), np.empty(q, np.complex128)
        split = -s.real * period < 300.0  # else the factors of e^{s (ti - tj)} would overflow
        for i in range(q):
            if split:
                rise[i] = np.exp(s * (angle[i] / omega))
                fall[i] = np.exp(-s * (angle[i] / omega))
        for i in range(q):
            for j in range(q):
                e = rise[i] * fall[j] if split else np.exp(s * ((angle[i] - angle[j]) / omega))
                x = pairs[r, i, j] * e / omega
                y = weight[j] * x * period_factor
                wrapped[r, 0, i * q + j], wrapped[r, 1, i * q + j] = y.real, y.imag
                if partial[i, j] != 0.0:
                    direct[i, j] += 2.0 * partial[i, j] * x.real
    return Green(wrapped, direct, nodes.lines, nodes.node)


@inner_njit(cache=True, nogil=True)
def fill(nu: complex, turning: Turning, green: Green, out: ComplexArray) -> None:
    """Write M(theta) of modes into out: the geometric series of all earlier periods is nu/(1 - nu e^{sT}) for every pole."""
    wrapped, factors = green.wrapped, turning.factors
    q = green.direct.shape[0]
    re, im = green.direct.copy().reshape(q * q), np.zeros(q * q)
    for r in range(factors.size):
        a = nu / (1.0 - nu * factors[r])
        b = nu / (1.0 - nu * np.conj(factors[r]))
        # a x + b conj(x) in real arithmetic, which vectorises
        p, m = a + b, a - b
        pr, pi, mr, mi = p.real, p.imag, m.real, m.imag
        x, y = wrapped[r, 0], wrapped[r, 1]
        for k in range(q * q):
            re[k] += pr * x[k] - mi * y[k]
            im[k] += pi * x[k] + mr * y[k]
    scale = turning.w_max * (1.0 - nu)
    for i in range(q):
        for j in range(q):
            out[i, j] = scale * complex(re[i * q + j], im[i * q + j])


@inner_njit(cache=True, nogil=True)
def fill_hill(nu: complex, theta: float, turning: Turning, green: Green, out: ComplexArray) -> None:
    """Write the truncated Hill matrix of modes into out (MultiFrequency)."""
    poles, residues, fourier, static = green.lines.poles, green.lines.residues, green.lines.fourier, green.direct
    ways = residues.shape[1]
    order_max = (out.shape[0] // ways - 1) // 2
    centre = (fourier.shape[0] - 1) // 2
    scale = turning.w_max * (1.0 - nu)
    value = np.zeros((ways, ways), np.complex128)
    for l in range(-order_max, order_max + 1):
        s = 1j * (theta + 2 * math.pi * l) / turning.period
        for c in range(ways):
            for b in range(ways):
                value[c, b] = static[c, b]
        for r in range(residues.shape[0]):
            pole = complex(poles[2 * r], poles[2 * r + 1])
            x, y = 1.0 / (s - pole), 1.0 / (s - np.conj(pole))
            for c in range(ways):
                for b in range(ways):
                    value[c, b] += residues[r, c, b] * x + np.conj(residues[r, c, b]) * y
        column = (l + order_max) * ways
        for k in range(-order_max, order_max + 1):
            row = (k + order_max) * ways
            for i in range(ways):
                for b in range(ways):
                    total = 0.0 + 0.0j
                    for c in range(ways):
                        total += fourier[centre + k - l, i, c] * value[c, b]
                    out[row + i, column + b] = scale * total


@inner_njit(cache=True, nogil=True)
def size_of(nodes: ArcSet) -> int:
    """Return the size of the matrix: nodes on the arc, or harmonics times directions for a truncated Hill matrix."""
    lines = nodes.lines
    if lines.poles.size == 0:
        return nodes.angle.size
    return ((lines.fourier.shape[0] - 1) // 2 + 1) * lines.residues.shape[1]


@inner_njit(cache=True, nogil=True)
def room_of(nodes: ArcSet) -> Room:
    """Return work space for the determinant of a set of nodes."""
    q = size_of(nodes)
    return Room(np.empty((q, q), np.complex128), np.zeros((q + 1, q + 1), np.complex128))


@inner_njit(cache=True, nogil=True)
def hessenberg(a: ComplexArray) -> None:
    """Reduce a to upper Hessenberg form in place by stabilised elimination (a similarity)."""
    n = a.shape[0]
    for m in range(1, n - 1):
        best, pivot_row = abs(a[m, m - 1]), m
        for i in range(m + 1, n):
            size = abs(a[i, m - 1])
            if size > best:
                best, pivot_row = size, i
        # The column is eliminated already: the matrix falls into two blocks, and `polynomial` sees the zero.
        if best == 0.0:
            continue
        if pivot_row != m:
            for j in range(m - 1, n):
                a[pivot_row, j], a[m, j] = a[m, j], a[pivot_row, j]
            for i in range(n):
                a[i, pivot_row], a[i, m] = a[i, m], a[i, pivot_row]
        pivot = 1.0 / a[m, m - 1]
        for i in range(m + 1, n):
            y = a[i, m - 1] * pivot
            a[i, m - 1] = 0.0
            if y != 0.0:
                for j in range(m, n):
                    a[i, j] -= y * a[m, j]
                for k in range(n):
                    a[k, m] += y * a[k, i]


@inner_njit(cache=True, nogil=True)
def polynomial(h: ComplexArray, p: ComplexArray, coefficient: ComplexArray) -> int:
    """Write the coefficients of det(I + s h), h upper Hessenberg, by the recurrence over leading minors; return the degree."""
    n = h.shape[0]
    p[0, 0] = 1.0
    for k in range(1, n + 1):
        hk = h[k - 1, k - 1]
        p[k, 0] = p[k - 1, 0]
        for d in range(1, k):
            p[k, d] = p[k - 1, d] + hk * p[k - 1, d - 1]
        p[k, k] = hk * p[k - 1, k - 1]
        product = 1.0 + 0.0j
        for i in range(k - 1, 0, -1):
            product *= -h[i, i - 1]
            if product == 0.0:
                break
            factor = product * h[i - 1, k - 1]
            shift = k - i + 1
            for d in range(i):
                p[k, d + shift] += factor * p[i - 1, d]
    largest = 0.0
    for d in range(n + 1):
        coefficient[d] = p[n, d]
        largest = max(largest, abs(p[n, d]))
    degree = n
    # At s <= 1 a term so small is below rounding of the largest, and a leading coefficient of nothing but rounding would
    # put roots far out into Newton's way.
    while degree > 1 and abs(coefficient[degree]) < 1e-17 * largest:
        degree -= 1
    return degree


@inner_njit(cache=True, nogil=True)
def horner(c: ComplexArray, degree: int, s: complex) -> tuple[complex, complex]:
    """Return the value and derivative of the polynomial at s."""
    value, slope = c[degree], 0.0 + 0.0j
    for d in range(degree - 1, -1, -1):
        slope = slope * s + value
        value = value * s + c[d]
    return value, slope


def _green_node(theta: float, turning: Turning, green: Green, room: Room, coefficient: ComplexArray) -> int:
    """Write the polynomial of D at theta; returns its degree."""
    fill(factor_at(theta), turning, green, room.work)
    hessenberg(room.work)
    return polynomial(room.work, room.minors, coefficient)


def _hill_node(theta: float, turning: Turning, green: Green, room: Room, coefficient: ComplexArray) -> int:
    """Write the polynomial of the truncated Hill determinant at theta; returns its degree."""
    fill_hill(factor_at(theta), theta, turning, green, room.work)
    hessenberg(room.work)
    return polynomial(room.work, room.minors, coefficient)


@inner_njit(cache=True, nogil=True)
def factor_at(theta: float) -> complex:
    """Return nu, by which one period multiplies the vibration; just -1 at theta = pi, where the determinant is real."""
    nu = np.exp(-1j * theta)
    if abs(theta - math.pi) < 1e-14:
        # The rounding of exp(-i pi) would give the determinant an imaginary part, and flips are found by the sign of the
        # real one.
        nu = -1.0 + 0.0j
    return nu



def _node_kinds() -> tuple[Any, ...]:
    """Return the Numba types of the arguments of a node's kernel."""
    matrices, matrix, row = np.zeros((0, 2, 2), complex), np.zeros((0, 0), complex), np.zeros(0, complex)
    green = Green(np.zeros((0, 2, 0)), np.zeros((0, 0)), HillLines(np.zeros(0), matrices, matrices), 0)
    return tuple(nb.typeof(argument) for argument in (0.0, Turning(1.0, 1.0, 1.0, row, row), green, Room(matrix, matrix), row))


# The determinant is at the bottom of all other kernels, so they call it by its address (`far_call`), which `Green` carries.
node_at = caller_of(_node_kinds())


@cache
def node_address(*, hill: bool = False) -> int:
    """Return where a node's compiled kernel is in this process: of the Green matrix, or of the Hill matrix where asked for."""
    return address_of(_hill_node if hill else _green_node, _node_kinds())


@inner_njit(cache=True, nogil=True)
def root(c: ComplexArray, degree: int, guess: complex) -> complex:
    """Return Newton's root of the polynomial near a guess."""
    s = guess
    for _ in range(30):
        value, slope = horner(c, degree, s)
        if slope == 0.0:
            break
        step = value / slope
        # Near a double root the slope is small and a full step would leave for another root.
        if abs(step) > 0.3 * (abs(s) + 1e-3):
            step *= 0.3 * (abs(s) + 1e-3) / abs(step)
        s -= step
        if abs(step) < 1e-14 * (abs(s) + 1e-6):
            break
    return s


@inner_njit(cache=True, nogil=True)
def polish(within: tuple[float, float], theta: float, guess: complex, turning: Turning, green: Green, room: Room,
           c: ComplexArray) -> tuple[float, float, int, bool]:
    """Return a crossing (theta, s, sense, ok): theta where the root s(theta) is real, by the secant rule between two thetas."""
    theta_a, theta_b = within
    span = theta_b - theta_a
    t0 = theta
    degree = node_at(green.node, (t0, turning, green, room, c))
    s0 = root(c, degree, guess)
    # The secant rule needs a second place; it stays inside, as beyond the interval another root may be the nearest.
    t1 = t0 + 1e-4 * span if t0 + 1e-4 * span <= theta_b else t0 - 1e-4 * span
    s1 = s0
    slope = 0.0
    for _ in range(25):
        degree = node_at(green.node, (t1, turning, green, room, c))
        s1 = root(c, degree, s1)
        if t1 != t0 and s1.imag != s0.imag:
            slope = (s1.imag - s0.imag) / (t1 - t0)
        if slope == 0.0:
            break
        step = -s1.imag / slope
        if abs(step) > 0.5 * span:
            step *= 0.5 * span / abs(step)
        if abs(s1.imag) < 1e-12 * abs(s1) or abs(step) < 1e-15:
            break
        t0, s0 = t1, s1
        t1 = t1 + step
        if t1 < 0.0 or t1 > 2 * math.pi:
            return t1, s1.real, 0, False
    # A thousand times the target: roots of a polynomial of degree 50 are not known better where two of them are close.
    good = abs(s1.imag) < 1e-9 * abs(s1) and s1.real > 0
    # 1/s is an eigenvalue of -M: Im(1/s) falling with theta means Im s rising, and the count grows with depth.
    return t1, s1.real, 2 if slope > 0 else -2, good


@inner_njit(cache=True, nogil=True)
def put_point(points: Array, p: int, s: float, theta: float, change: float, error: float) -> None:
    """Write a boundary point whose slope is not known."""
    points[p].s, points[p].theta, points[p].change, points[p].error = s, theta, change, error
    points[p].slope = 0.0
