r"""Automatic selection of modes from the poles of all model orders: groups that return from order to order.

Every order offers its poles to the groups found so far (one pole to a group at most, the best total match); a group
that returns in enough orders is a mode. The distance of two poles is

.. math:: d = |s_1 - s_2| / (w\,|\Re s|) + (1 - MAC(l_1, l_2)),

in half widths of the resonance, so a close pair stays apart where its poles are apart or its participations differ.
Idea of grouping across orders: Vanlanduit, Verboven, Guillaume, Schoukens, JSV 265 (2003) 647; Reynders, Houbrechts,
De Roeck, MSSP 29 (2012) 228.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification.poles.stabilization import Diagram

DISTANCE_HALF_WIDTHS = 1.0  # unit of the distance between poles
MEDIAN_MEMBERS = 7  # of a group, in the highest orders, whose median is its pole
MIN_GROUP_SIZE = 4  # orders


@dataclass(frozen=True, eq=False)
class Selection(NotebookText):
    """Modes selected across orders: poles (rad/s), participation (n_inputs, n_modes), share of orders with each."""

    poles: ComplexArray
    participation: ComplexArray
    support: FloatArray

    def __repr__(self) -> str:
        return f"Selection({self.poles.size} modes, support {self.support.min(initial=1.0):.2f} .. 1)"


def select_poles(diagram: Diagram, share: float = 0.35) -> Selection:
    """Return the groups of poles that hold in at least `share` of the orders above their first, and in four or more.

    A group's pole is the median of its members in the highest orders, where the bias of noise is least; its
    participation is that of its highest order.
    """
    members = group_poles(diagram)
    orders = np.array(diagram.orders)
    kept: list[tuple[complex, ComplexArray, float]] = []
    for group in members:
        indices = np.array(group)
        possible = int((orders >= diagram.order[indices].min()).sum())
        support = indices.size / max(possible, MIN_GROUP_SIZE)
        if indices.size < min(MIN_GROUP_SIZE, orders.size) or support < share:
            continue
        highest = indices[np.argsort(-diagram.order[indices], kind="stable")][:MEDIAN_MEMBERS]
        s = diagram.poles[highest]
        kept.append((complex(np.median(s.real), np.median(s.imag)), diagram.participation[:, highest[0]], support))
    kept.sort(key=lambda entry: abs(entry[0]))
    inputs = diagram.participation.shape[0]
    return Selection(np.array([entry[0] for entry in kept], complex),
                     np.stack([entry[1] for entry in kept], axis=1) if kept else np.zeros((inputs, 0), complex),
                     np.array([entry[2] for entry in kept]))


def drop_repeated(choice: Selection) -> Selection:
    """Return the selection without poles that repeat another within a tenth of its half width.

    For methods with a common denominator, which know no participation and cannot have repeated roots.
    """
    kept: list[int] = []
    for i in np.argsort(-choice.support, kind="stable").tolist():
        s = choice.poles[i]
        # Closer than a tenth of their half width two poles are one: no band of lines would part them.
        if all(abs(s - choice.poles[j]) > 0.1 * abs(choice.poles[j].real) for j in kept):
            kept.append(i)
    kept.sort()
    return Selection(choice.poles[kept], choice.participation[:, kept], choice.support[kept])


def group_poles(diagram: Diagram) -> list[list[int]]:
    """Return the indices of the poles of every group, from the highest order down."""
    groups: list[list[int]] = []
    for order in sorted(set(diagram.order.tolist()), reverse=True):
        indices = np.flatnonzero(diagram.order == order)
        last_members = np.array([group[-1] for group in groups], int)
        centre = np.array([np.median(diagram.poles[group[-MEDIAN_MEMBERS:]].real)
                           + 1j * np.median(diagram.poles[group[-MEDIAN_MEMBERS:]].imag) for group in groups], complex)
        assigned = set()
        if groups:
            distance = _distance(diagram, indices, last_members, centre)
            # Bounded: one pole without a partner must not pull all the others to their second best.
            rows, columns = linear_sum_assignment(np.minimum(distance, 10.0))
            for row, column in zip(rows, columns, strict=True):
                if distance[row, column] < 1.0:
                    groups[column].append(int(indices[row]))
                    assigned.add(int(indices[row]))
        groups += [[int(i)] for i in indices if int(i) not in assigned]
    return groups


def _distance(diagram: Diagram, indices: np.ndarray, last_members: np.ndarray, centre: ComplexArray) -> FloatArray:
    s = diagram.poles[indices]
    width = np.maximum(np.abs(s.real)[:, None], np.abs(centre.real)) * DISTANCE_HALF_WIDTHS + 1e-6 * np.abs(centre)
    correlation = np.abs(diagram.participation[:, indices].conj().T @ diagram.participation[:, last_members]) ** 2
    return np.abs(s[:, None] - centre) / width + (1 - correlation)
