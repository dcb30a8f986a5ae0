"""Selection of operational modes: poles that recur across the orders, and scatter between blocks by less than their half width.

A pole of the noise returns across the orders of one decomposition as a mode does, but each block of the record puts it
elsewhere: its deviation reaches its own half width. A mode's does not. This needs no bound on frequency steps from order to
order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint.modal_identification.operational.subspace import SubspacePoles
from toolpoint.modal_identification.poles.selection import group_poles

MIN_ORDERS_OF_MODE = 4  # orders
MIN_SUPPORT = 0.35  # of the orders from the first that has the pole
MAX_DEVIATION_HALF_WIDTHS = 0.3  # standard deviation of a mode's pole over its half width
MIN_REPEATED_MAC = 0.8  # of shapes of two poles within a half width that are halves of one mode


@dataclass(frozen=True, eq=False)
class SelectedModes:
    """Modes selected across orders.

    Parameters
    ----------
    poles : (n_modes,) complex
        rad/s.
    deviations : (n_blocks, n_modes) complex
        First-order change for each block, rad/s.
    scatter : (n_modes,) complex
        Variance of the poles across the orders, real and imaginary part: what the choice of an order moves, (rad/s)^2.
    support : (n_modes,) floats
        Share of the orders with the mode.
    undetermined : (n,) floats
        Frequencies (Hz) of groups that returned but that the record does not determine.
    """

    poles: ComplexArray
    deviations: ComplexArray
    scatter: ComplexArray
    support: FloatArray
    undetermined: FloatArray

    def chosen(self, kept: BoolArray) -> SelectedModes:
        """Return those of the modes that are kept; the others count as undetermined."""
        left_out = np.abs(self.poles[~kept]) / (2 * np.pi)
        return SelectedModes(self.poles[kept], self.deviations[:, kept], self.scatter[kept], self.support[kept],
                             np.sort(np.concatenate([self.undetermined, left_out])))


def deviation_of_mean(deviations: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the standard deviations (real, imaginary) of the mean over blocks, shape (n_modes,) each."""
    count = deviations.shape[0]
    scale = 1 / (count * (count - 1))
    return np.sqrt((deviations.real**2).sum(axis=0) * scale), np.sqrt((deviations.imag**2).sum(axis=0) * scale)


@dataclass(frozen=True, eq=False)
class _Group:
    """Mean pole of one group, with its block deviations, scatter, support and shape."""

    pole: complex
    deviation: ComplexArray
    scatter: complex
    support: float
    vector: ComplexArray

    @property
    def is_determined(self) -> bool:
        """Whether the record puts the pole well within its own half width."""
        deviations = [float(part[0]) for part in deviation_of_mean(self.deviation[:, None])]
        return max(deviations) <= MAX_DEVIATION_HALF_WIDTHS * abs(self.pole.real)


def select_modes(all_poles: SubspacePoles) -> SelectedModes:
    """Return the modes of all orders: each the mean of its group, weighted by the inverse variance of its frequency."""
    diagram = all_poles.diagram
    orders = np.array(diagram.orders)
    groups = []
    for indices in group_poles(diagram):
        members = np.array(indices)
        support = members.size / max(int((orders >= diagram.order[members].min()).sum()), MIN_ORDERS_OF_MODE)
        if members.size >= MIN_ORDERS_OF_MODE and support >= MIN_SUPPORT:
            groups.append(_mean_of_group(all_poles, members, support))
    determined = [group for group in groups if group.is_determined]
    kept = _drop_halves(determined)
    blocks = all_poles.deviations.shape[0]
    return SelectedModes(
        np.array([group.pole for group in kept], complex),
        np.stack([group.deviation for group in kept], axis=1) if kept else np.zeros((blocks, 0), complex),
        np.array([group.scatter for group in kept], complex), np.array([group.support for group in kept]),
        np.sort([abs(group.pole) / (2 * np.pi) for group in groups if not group.is_determined]))


def _mean_of_group(all_poles: SubspacePoles, members: np.ndarray, support: float) -> _Group:
    poles = all_poles.diagram.poles[members]
    _, imaginary = deviation_of_mean(all_poles.deviations[:, members])
    weight = 1 / np.maximum(imaginary, 1e-12 * np.abs(poles)) ** 2
    weight /= weight.sum()
    mean = complex(weight @ poles)
    offset = poles - mean
    return _Group(mean, all_poles.deviations[:, members] @ weight, complex(weight @ offset.real**2, weight @ offset.imag**2),
                  support,
                  all_poles.diagram.participation[:, members[int(np.argmax(weight))]])


def _drop_halves(groups: list[_Group]) -> list[_Group]:
    """Return the groups, lowest first, without those that repeat a better determined one with nearly its shape.

    An order too high splits a mode in two poles within its half width.
    """
    kept: list[_Group] = []
    for group in sorted(groups, key=lambda g: float((np.abs(g.deviation) ** 2).sum())):
        repeats = any(abs(group.pole - other.pole) < max(abs(group.pole.real), abs(other.pole.real))
                      and abs(np.vdot(group.vector, other.vector)) ** 2 > MIN_REPEATED_MAC for other in kept)
        if not repeats:
            kept.append(group)
    return sorted(kept, key=lambda g: abs(g.pole))
