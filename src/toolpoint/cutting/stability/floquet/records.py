"""Records that the compiled kernels of FloquetDeterminant read and write."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray

# A boundary point: s = depth over the largest, theta, change of the count, error of s, ds/dtheta (zero where not known).
POINT = np.dtype([("s", float), ("theta", float), ("change", float), ("error", float), ("slope", complex)])
# A pole as it was when theta nodes were last laid about it: its theta, half width (rad) and loop.
POLE_STATE = np.dtype([("theta", float), ("half", float), ("loop", complex)])
# How many theta nodes and boundary points a near problem left; -1 where none are known.
NUMBERS = np.dtype([("nodes", np.int64), ("points", np.int64)])
# Two depths (as s) with the counts there, between which a boundary lies.
CELL = np.dtype([("lower", float), ("upper", float), ("n_lower", np.int64), ("n_upper", np.int64)])


class HillLines(NamedTuple):
    """A truncated Hill matrix (MultiFrequency): poles as real and imaginary parts in turn, residues (poles, ways, ways),
    Fourier coefficients of k n^T (4 top + 1, ways, ways); of no length where the Green matrix is meant."""

    poles: FloatArray
    residues: ComplexArray
    fourier: ComplexArray


class ArcSet(NamedTuple):
    """A set of q nodes on the arc of cut: n^T R_r k of every pole r, (poles, q, q); Gauss weights and angles, rad; `partial`
    (q, q) weights of the integral from the pitch's start; n^T static k where two nodes are at the same time; `node` is the
    address of the node's compiled kernel."""

    pairs: ComplexArray
    weight: FloatArray
    partial: FloatArray
    angle: FloatArray
    static: FloatArray
    lines: HillLines
    node: int


class Green(NamedTuple):
    """The parts of the Green matrix at one speed: per-pole matrices times e^{s(T + ti - tj)} as real and imaginary parts
    (poles, 2, q^2), the causal part of one period (q, q), and the address of the node's compiled kernel."""

    wrapped: FloatArray
    direct: FloatArray
    lines: HillLines
    node: int


class Turning(NamedTuple):
    """One speed: tooth period, s; rad/s; largest depth, m; poles and e^{sT} of each."""

    period: float
    omega: float
    w_max: float
    poles: ComplexArray
    factors: ComplexArray


class Room(NamedTuple):
    """Room for one determinant: the matrix (q, q) and the polynomials of its leading minors (q + 1, q + 1)."""

    work: ComplexArray
    minors: ComplexArray


class ThetaTable(NamedTuple):
    """Theta nodes in the order of their making: theta, coefficients and degree of D(theta, s); `order` sorts them by theta."""

    theta: FloatArray
    order: Array
    coefficient: ComplexArray
    degree: Array


class ScanMemory(NamedTuple):
    """Results of a near problem, updated by a scan: theta nodes, `NUMBERS`, poles as last seen (`POLE_STATE`), boundary points
    (`POINT`); of no length where nothing is to be kept. With a leading axis over speeds outside the kernels."""

    nodes: FloatArray
    numbers: Array
    poles: Array
    points: Array
