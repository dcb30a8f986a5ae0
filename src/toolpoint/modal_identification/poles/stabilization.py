"""Stabilization diagram as data: the poles of all model orders and which of them are stable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, BoolArray, ComplexArray, FloatArray
from toolpoint._notebook import NotebookText

MAX_POLE_DAMPING = 0.2  # ratio: above, a pole is not that of a structure
STABLE_FREQUENCY_TOLERANCE = 0.01  # relative, between neighbouring orders
STABLE_DAMPING_TOLERANCE = 0.10  # relative
MIN_STABLE_MAC = 0.95  # of participation vectors


@dataclass(frozen=True, eq=False)
class Diagram(NotebookText):
    """Physically possible poles of every model order.

    Parameters
    ----------
    order : (n,) ints
        Model order of each pole.
    poles : (n,) complex
        Upper poles, rad/s, not yet corrected for a window.
    participation : (n_inputs, n) complex
        Participation vector of each, of unit length.
    level : (n,) ints
        0 new, 1 stable in frequency, 2 also in damping, 3 also in participation, against the next lower order.
    orders : tuple of int
        All orders that were solved.

    >>> pole = 2 * np.pi * 100.0 * (-0.01 + 1j)
    >>> pairs = [(order, np.array([pole]), np.ones((1, 1))) for order in (4, 6)]
    >>> Diagram.collected(pairs, (1.0, 1e4)).level.tolist()  # new, then stable in frequency, damping and participation
    [0, 3]
    """

    order: np.ndarray
    poles: ComplexArray
    participation: ComplexArray
    level: np.ndarray
    orders: tuple[int, ...]

    @classmethod
    def collected(cls, orders: Sequence[tuple[int, Array, Array]], omega_range: tuple[float, float]) -> Diagram:
        """Return the diagram of (order, poles, participation) triples, kept to stable poles with ``|s|`` in a range (rad/s)."""
        parts, previous = [], None
        for order, poles, vectors in orders:
            keep = cls.is_physical(poles, omega_range)
            s, v = poles[keep], vectors[:, keep]
            v = v / np.maximum(np.linalg.norm(v, axis=0), np.finfo(float).tiny)
            parts.append((np.full(s.size, order), s, v, _levels(s, v, previous)))
            previous = (s, v)
        number, s, v, level = [np.concatenate([part[i] for part in parts], axis=-1) for i in range(4)]
        return cls(number, s, v, level, tuple(item[0] for item in orders))

    @staticmethod
    def is_physical(poles: Array, omega_range: tuple[float, float]) -> BoolArray:
        """Return whether each pole (rad/s) is an upper one, stable, of a damping that structures have, with ``|s|`` in the
        range."""
        size = np.abs(poles)
        return np.asarray((poles.imag > 0) & (size >= omega_range[0]) & (size <= omega_range[1]) & (poles.real < 0)
                          & (-poles.real <= MAX_POLE_DAMPING * size))

    @property
    def frequency(self) -> FloatArray:
        """Natural frequency of every pole, Hz."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def damping_ratio(self) -> FloatArray:
        """Damping ratio of every pole."""
        return -self.poles.real / np.abs(self.poles)

    def __repr__(self) -> str:
        return (f"Diagram({self.poles.size} poles of {len(self.orders)} orders up to {max(self.orders)}, "
                f"{int((self.level == 3).sum())} stable)")


def _levels(s: ComplexArray, v: ComplexArray, previous: tuple[ComplexArray, ComplexArray] | None) -> np.ndarray:
    """Return the level of every pole against the poles of the next lower order."""
    level = np.zeros(s.size, int)
    if previous is None or previous[0].size == 0 or s.size == 0:
        return level
    previous_poles, vectors = previous
    shift = np.abs(np.abs(s)[:, None] - np.abs(previous_poles)) / np.abs(s)[:, None]
    ratio, previous_ratio = -s.real / np.abs(s), -previous_poles.real / np.abs(previous_poles)
    change = np.abs(ratio[:, None] - previous_ratio) / ratio[:, None]
    correlation = np.abs(v.conj().T @ vectors) ** 2
    first = shift < STABLE_FREQUENCY_TOLERANCE
    second = first & (change < STABLE_DAMPING_TOLERANCE)
    third = second & (correlation > MIN_STABLE_MAC)
    return first.any(axis=1).astype(int) + second.any(axis=1) + third.any(axis=1)
