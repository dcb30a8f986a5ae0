r"""Compiled kernels of Timoshenko segments: a base receptance carried to the tip, and the dynamic stiffness of a segment.

State of a section: deflection w, section rotation t, shear force V and bending moment M that the part beyond exerts on the
part before. With a = rho w^2/E, b = rho w^2/(kappa G), c = rho A w^2/(E I) the 4x4 system matrix Z satisfies
Z^4 = -(a + b) Z^2 - (a b - c) I (Cayley-Hamilton), so exp(Z h) is a sum of I, Z, Z^2, Z^3 with coefficients that are entire
functions of h: no cancellation at low frequency, none at the cut-off. A segment is cut into pieces short enough for their
series; a receptance passes a piece by H' = (T11 H + T12)(T21 H + T22)^-1, which loses no digits however long the whole is.

Imported only when asked for: numba takes most of a second to load.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import ComplexArray, FloatArray

MAX_PIECE_PHASE = 1.2  # rad: largest wave number times length of a piece
SERIES_TERM_COUNT = 14  # even terms of the series: 1.2^28/28! is below 1e-27


@njit(cache=True, nogil=True, error_model="numpy")
def _pieces(omega: float, density: float, modulus: complex, shear: complex, area: float, second: float, length: float) -> int:
    """Return the number of equal pieces of a segment at omega (rad/s); the other arguments as in `carry_receptances`."""
    a, b = abs(density * omega**2 / modulus), abs(density * omega**2 / shear)
    c = abs(density * area * omega**2 / (modulus * second))
    largest = np.sqrt(0.5 * (a + b) + np.sqrt(0.25 * (a + b) ** 2 + c + a * b))
    return max(1, int(np.ceil(largest * length / MAX_PIECE_PHASE)))


@njit(cache=True, nogil=True, error_model="numpy")
def _transfer(omega: float, density: float, modulus: complex, shear: complex, area: float, second: float, h: float,
              out: ComplexArray) -> None:
    """Fill out, (4, 4) complex128, with the transfer matrix exp(Z h) of a piece.

    omega : rad/s; density, area, second : real; modulus E, shear kappa G : complex, Pa; h : m.
    """
    bending, slide = 1.0 / (modulus * second), 1.0 / (shear * area)
    inertia, turning = density * area * omega**2, density * second * omega**2
    p = density * omega**2 * (1.0 / modulus + 1.0 / shear)
    q = (density * omega**2) ** 2 / (modulus * shear) - inertia * bending
    # Z^(2n) = u I + v Z^2; the sums over even and odd powers of h.
    u, v = 1.0 + 0.0j, 0.0j
    c0, c1, c2, c3 = 0.0j, 0.0j, 0.0j, 0.0j
    even_power, odd_power = 1.0, h
    for n in range(SERIES_TERM_COUNT):
        c0 += u * even_power
        c2 += v * even_power
        c1 += u * odd_power
        c3 += v * odd_power
        u, v = -q * v, u - p * v
        even_power *= h * h / ((2 * n + 1) * (2 * n + 2))
        odd_power *= h * h / ((2 * n + 2) * (2 * n + 3))
    # exp(Z h) = c0 I + c1 Z + c2 Z^2 + c3 Z^3, written out entry by entry.
    # Rows of Z: w' = t + V slide, t' = M bending, V' = -inertia w, M' = -turning t - V.
    # Z^2 w: w'' = bending M - inertia slide w; t'' = -bending (turning t + V); V'' = -inertia (t + V slide);
    # M'' = -turning bending M + inertia w.
    s1, s2 = inertia * slide, turning * bending
    out[0, 0], out[0, 1] = c0 - c2 * s1, c1 - c3 * (s1 + s2)
    out[0, 2], out[0, 3] = c1 * slide - c3 * (s1 * slide + bending), c2 * bending
    out[1, 0], out[1, 1] = c3 * bending * inertia, c0 - c2 * s2
    out[1, 2], out[1, 3] = -c2 * bending, c1 * bending - c3 * s2 * bending
    out[2, 0], out[2, 1] = -c1 * inertia + c3 * inertia * s1, -c2 * inertia
    out[2, 2], out[2, 3] = c0 - c2 * s1, -c3 * inertia * bending
    out[3, 0], out[3, 1] = c2 * inertia, -c1 * turning + c3 * (inertia + turning * s2)
    out[3, 2], out[3, 3] = -c1 + c3 * (s1 + s2), c0 - c2 * s2


@njit(cache=True, nogil=True, error_model="numpy")
def carry_receptances(omega: FloatArray, segments: ComplexArray, base: ComplexArray, tip: ComplexArray,
                      sway: ComplexArray) -> None:
    """Carry base receptances through segments to their end, and fill the base's wrench per tip wrench.

    omega : (n_f,) float64, rad/s; base, tip, sway : (n_f, m, 2, 2) complex128, C-contiguous, m alternatives a line;
    segments : (n, 7) complex128 rows density, E, kappa G, area, second moment, length, kind (0 beam; 1 elastic connection
    whose translational and rotational compliances stand in place of E and kappa G);
    tip : receptances at the end; sway : force and moment on the base per tip force and moment.
    """
    t, f = np.empty((4, 4), np.complex128), np.empty((2, 2), np.complex128)
    for line in range(omega.size):
        for draw in range(base.shape[1]):
            for i in range(2):
                for j in range(2):
                    tip[line, draw, i, j] = base[line, draw, i, j]
                    sway[line, draw, i, j] = 1.0 if i == j else 0.0
        for s in range(segments.shape[0]):
            density, modulus, shear, area, second, length, kind = segments[s]
            # A connection in series adds its compliance, and passes the wrench on.
            if kind.real == 1.0:
                for draw in range(base.shape[1]):
                    tip[line, draw, 0, 0] += modulus
                    tip[line, draw, 1, 1] += shear
                continue
            pieces = _pieces(omega[line], density.real, modulus, shear, area.real, second.real, length.real)
            _transfer(omega[line], density.real, modulus, shear, area.real, second.real, length.real / pieces, t)
            for draw in range(base.shape[1]):
                for _ in range(pieces):
                    _pass(t, tip[line, draw], sway[line, draw], f)


@njit(cache=True, nogil=True, error_model="numpy")
def _pass(t: ComplexArray, h: ComplexArray, sway: ComplexArray, f: ComplexArray) -> None:
    """Carry a receptance h and the base's wrench `sway`, (2, 2) complex128 each, through one piece, in place.

    t : (4, 4) transfer matrix; f : (2, 2) room for intermediate results.
    """
    # f = T21 H + T22, the wrench at the end of the piece per wrench at its start.
    for i in range(2):
        for j in range(2):
            f[i, j] = t[2 + i, 0] * h[0, j] + t[2 + i, 1] * h[1, j] + t[2 + i, 2 + j]
    det = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]
    i00, i01, i10, i11 = f[1, 1] / det, -f[0, 1] / det, -f[1, 0] / det, f[0, 0] / det
    # H' = (T11 H + T12) f^-1, sway' = sway f^-1.
    for i in range(2):
        for j in range(2):
            f[i, j] = t[i, 0] * h[0, j] + t[i, 1] * h[1, j] + t[i, 2 + j]
    for i in range(2):
        a, b = f[i, 0], f[i, 1]
        h[i, 0], h[i, 1] = a * i00 + b * i10, a * i01 + b * i11
        a, b = sway[i, 0], sway[i, 1]
        sway[i, 0], sway[i, 1] = a * i00 + b * i10, a * i01 + b * i11


@njit(cache=True, nogil=True, error_model="numpy")
def segment_stiffness(omega: FloatArray, segment: ComplexArray, out: ComplexArray) -> None:
    """Fill the dynamic stiffness of a free segment over (w, t) at its start and at its end.

    omega : (n_f,) float64, rad/s; segment : (7,) complex128, a row of `carry_receptances`; out : (n_f, 4, 4) complex128.
    Pieces are joined by condensing the section between them.
    """
    t, piece = np.empty((4, 4), np.complex128), np.empty((4, 4), np.complex128)
    density, modulus, shear, area, second, length, _ = segment
    for line in range(omega.size):
        pieces = _pieces(omega[line], density.real, modulus, shear, area.real, second.real, length.real)
        _transfer(omega[line], density.real, modulus, shear, area.real, second.real, length.real / pieces, t)
        _stiffness(t, piece)
        for i in range(4):
            for j in range(4):
                out[line, i, j] = piece[i, j]
        for _ in range(pieces - 1):
            _append(out[line], piece)


@njit(cache=True, nogil=True, error_model="numpy")
def _stiffness(t: ComplexArray, out: ComplexArray) -> None:
    """Fill out, (4, 4) complex128, the dynamic stiffness of a piece, from its transfer matrix t, (4, 4) complex128.

    The wrench at the start is -T12^-1 (u' - T11 u), u and u' the motions of start and end; that at the end is T21 u + T22 f.
    """
    det = t[0, 2] * t[1, 3] - t[0, 3] * t[1, 2]
    inverse = np.empty((2, 2), np.complex128)
    inverse[0, 0], inverse[0, 1] = t[1, 3] / det, -t[0, 3] / det
    inverse[1, 0], inverse[1, 1] = -t[1, 2] / det, t[0, 2] / det
    for i in range(2):
        for j in range(2):
            out[i, 2 + j] = -inverse[i, j]
            out[i, j] = inverse[i, 0] * t[0, j] + inverse[i, 1] * t[1, j]
            out[2 + i, 2 + j] = t[2 + i, 2] * inverse[0, j] + t[2 + i, 3] * inverse[1, j]
    for i in range(2):
        for j in range(2):
            out[2 + i, j] = out[j, 2 + i]  # reciprocity holds for the exact matrix


@njit(cache=True, nogil=True, error_model="numpy")
def _append(total: ComplexArray, piece: ComplexArray) -> None:
    """Join a piece to the end of a segment, in place: K_ij - K_is K_ss^-1 K_sj, s the section between.

    total, piece : (4, 4) complex128 dynamic stiffness over start and end.
    """
    k00, k01 = total[2, 2] + piece[0, 0], total[2, 3] + piece[0, 1]
    k10, k11 = total[3, 2] + piece[1, 0], total[3, 3] + piece[1, 1]
    det = k00 * k11 - k01 * k10
    inverse = ((k11 / det, -k01 / det), (-k10 / det, k00 / det))
    left = total[:2, 2:].copy()
    right = piece[:2, 2:].copy()
    for i in range(2):
        a, b = left[i, 0], left[i, 1]
        c, d = right[0, i], right[1, i]
        la, lb = a * inverse[0][0] + b * inverse[1][0], a * inverse[0][1] + b * inverse[1][1]
        ra, rb = c * inverse[0][0] + d * inverse[1][0], c * inverse[0][1] + d * inverse[1][1]
        for j in range(2):
            total[i, j] -= la * left[j, 0] + lb * left[j, 1]
            total[i, 2 + j] = -(la * right[0, j] + lb * right[1, j])
            total[2 + i, 2 + j] = piece[2 + i, 2 + j] - (ra * right[0, j] + rb * right[1, j])
    for i in range(2):
        for j in range(2):
            total[2 + i, j] = total[j, 2 + i]
