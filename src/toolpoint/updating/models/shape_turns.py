r"""Derivatives of undamped modes along parameters, for all parameters and modes in a few products of small matrices.

With :math:`\phi^T M \phi = 1`: :math:`F_i = K' - \omega_i^2 M'`, :math:`(\omega_i^2)' = \phi_i^T F_i \phi_i`,
:math:`\phi_i' = \sum_{j \ne i} \phi_j (\phi_j^T F_i \phi_i) / (\omega_i^2 - \omega_j^2) - \phi_i (\phi_i^T M' \phi_i)/2`,
each :math:`\phi^T A' \phi` from the low-rank factors of A'. Source: Fox, Kapoor, AIAA J. 6 (1968).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.updating.models.low_rank import Term
from toolpoint.updating.models.prediction import Prediction, ShapeSlopes
from toolpoint.vibration import Modes, SecondOrderSystem
from toolpoint.vibration.eigen import mass_normalised
from toolpoint.vibration.modes import remark_overdamped

Weighted = Mapping[str, tuple[Term, FloatArray]]
REPEATED_SQUARE_TOLERANCE = 1e-9  # distance of two squared frequencies over their size up to which they are one


class UndampedModes:
    """All undamped modes, with derivatives of the lowest `keep` along `count` parameters, worked out when asked for.

    squares, omega : (n,), (rad/s)^2 and rad/s; vectors : (n, n) of unit modal mass.
    """

    def __init__(self, system: SecondOrderSystem, factors: Weighted, count: int, keep: int | None = None) -> None:
        self.squares, self.vectors = mass_normalised(system.mass, system.stiffness)
        self.keep = self.squares.size if keep is None else min(keep, self.squares.size)
        self.omega = np.sqrt(np.maximum(self.squares, 0.0))
        self.factors, self.count = factors, count

    @property
    def square_slopes(self) -> FloatArray:
        """Derivatives of the squared natural frequencies, (keep, count)."""
        return self._slopes[0]

    @property
    def turns(self) -> FloatArray:
        """Derivatives of the vectors written in the vectors, (n, keep, count)."""
        return self._slopes[1]

    @cached_property
    def _slopes(self) -> tuple[FloatArray, FloatArray]:
        kept, each = self.squares[:self.keep], np.arange(self.keep)
        form, growth = np.zeros((self.count, self.squares.size, self.keep)), np.zeros((self.count, self.keep))
        for term in ("stiffness", "mass"):
            if term in self.factors:
                used, products = self.projected(term)
                if term == "stiffness":
                    form[used] = products
                else:
                    form[used] -= kept * products
                    growth[used] = -0.5 * products[:, each, each]
        gap = kept - self.squares[:, None]
        gap[np.abs(gap) <= REPEATED_SQUARE_TOLERANCE * np.maximum(kept, self.squares[:, None])] = np.inf
        square_slopes = form[:, each, each].T
        # Inside a group of equal roots the vectors turn with the parameter in jumps; there only frequencies are followed.
        form /= gap
        form[:, each, each] = growth
        return square_slopes, form.transpose(1, 2, 0)

    def projected(self, term: str) -> tuple[np.ndarray, FloatArray]:
        """Return the parameters that a matrix depends on, and phi^T A' phi for the modes kept, (used, n, keep)."""
        factor, weights = self.factors[term]
        sensed = factor.seen(self.vectors)
        return factor.used, (sensed * weights[:, :, None]).swapaxes(1, 2) @ sensed[:, :, :self.keep]

    def diagonal(self, term: str) -> FloatArray:
        """Return the diagonal of phi^T A' phi along every parameter, (keep, count)."""
        result = np.zeros((self.keep, self.count))
        if term in self.factors:
            factor, weights = self.factors[term]
            result[:, factor.used] = (factor.seen(self.vectors[:, :self.keep]) ** 2 * weights[:, :, None]).sum(axis=1).T
        return result


@dataclass(frozen=True, eq=False)
class EqualDamping:
    """One damping ratio of all modes; slopes (count,), how it moves with every parameter."""

    ratio: float
    slopes: FloatArray


def mode_prediction(system: SecondOrderSystem, modal: UndampedModes, keep: int, *, equal_damping: EqualDamping | None
                    ) -> Prediction:
    """Return the lowest `keep` modes with their derivatives; damping from the modal damping matrix, or equal in
    all modes (`equal_damping`)."""
    omega = modal.omega[:keep]
    if (omega <= 0).any():
        fail("model", f"{int((omega <= 0).sum())} modes at 0 Hz or unstable", "must be held in all directions",
             remedy="raise the lower bounds of the stiffnesses, or ground the model")
    damping, damping_slopes = _damping(system, modal, keep, equal_damping)
    shape = system.output_map @ modal.vectors
    modes = Modes(omega / (2 * np.pi), damping, shape[:, :keep], system.outputs,
                  notes=remark_overdamped(damping))
    if not modal.count:
        return Prediction(modes)
    return Prediction(modes, None, (modal.square_slopes[:keep] / (4 * np.pi * omega[:, None])).T, damping_slopes,
                      ShapeSlopes(shape, modal.turns[:, :keep]))


def _damping(
    system: SecondOrderSystem, modal: UndampedModes, keep: int, equal_damping: EqualDamping | None
) -> tuple[FloatArray, FloatArray | None]:
    """Diagonal of the modal damping matrix as ratios, sum of the viscous and the structural part, and slopes (count, keep)."""
    omega, zeta = modal.omega[:keep], np.zeros(keep)
    slopes = np.zeros((keep, modal.count)) if modal.count else None
    if equal_damping is not None:
        return np.full(keep, equal_damping.ratio), None if slopes is None else slopes.T + equal_damping.slopes[:, None]
    for term, power in (("damping", 1), ("structural_damping", 2)):
        matrix = getattr(system, term)
        if matrix is None:
            continue
        modal_damping = modal.vectors.T @ (matrix @ modal.vectors[:, :keep])
        part = np.diagonal(modal_damping) / (2 * omega**power)
        zeta += part
        if slopes is not None:
            turned = 2 * np.einsum("im,imp->mp", modal_damping, modal.turns[:, :keep])
            change = modal.square_slopes[:keep] / (2 * omega[:, None] ** 2)
            slopes += (modal.diagonal(term)[:keep] + turned) / (2 * omega[:, None] ** power) - power * part[:, None] * change
    return zeta, None if slopes is None else slopes.T
