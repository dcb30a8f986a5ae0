"""Prediction: what a model says at one set of values, with the exact derivatives that a fit needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.vibration import Frf, Modes


@dataclass(frozen=True, eq=False)
class ShapeSlopes:
    """Derivatives of shapes kept as a product, d shape = basis @ turns: basis (n_dofs, n), turns (n, n_modes, n_p).

    coordinates : (n, n_modes), the shapes themselves in the basis; its first n_modes columns where left out. Most of what a fit
    needs of the derivatives are sums over the Dofs, which are cheaper in the n coordinates.
    """

    basis: FloatArray
    turns: Array
    coordinates: Array | None = None

    def coordinates_of(self, modes: np.ndarray) -> Array:
        """Return the coordinates of these modes in the basis, (n, len(modes))."""
        return np.eye(len(self.turns))[:, modes] if self.coordinates is None else self.coordinates[:, modes]

    @classmethod
    def of(cls, array: Array, shapes: Array) -> ShapeSlopes:
        """Return the derivatives of an array (n_p, n_dofs, n_modes), with the identity as basis."""
        return cls(np.eye(array.shape[1]), np.ascontiguousarray(np.moveaxis(array, 0, -1)), shapes)

    @property
    def array(self) -> Array:
        """All derivatives, (n_p, n_dofs, n_modes)."""
        return np.asarray(np.moveaxis(np.tensordot(self.basis, self.turns, 1), -1, 0))


@dataclass(frozen=True, eq=False)
class Prediction:
    """Modes and responses of a model, and their derivatives to the numbers asked for, per unit of each.

    Parameters
    ----------
    modes : Modes, optional
        Modes at least at the measured Dofs, real with unit modal mass or complex of any scale; more modes than measured, so
        that crossings can be followed.
    frf : Frf, optional
        Receptances at the measured lines, outputs and inputs.
    frequency_slopes, damping_slopes : (n_p, n_modes) floats, optional
        Hz and 1 per unit.
    shape_slopes : (n_p, n_dofs, n_modes), or `ShapeSlopes`, optional
    frf_slopes : (n_p, n_f, n_outputs, n_inputs) complex, optional

    >>> modes = Modes([318.31], [0.01], [[1.0]], ["tool:+x"])
    >>> slope = modes.frequency / (2 * 8e6)  # of a frequency that grows as the root of a stiffness of 8e6 N/m
    >>> Prediction(modes, frequency_slopes=slope[None, :]).frequency_slopes.shape  # numbers, modes
    (1, 1)
    """

    modes: Modes | None = None
    frf: Frf | None = None
    frequency_slopes: FloatArray | None = None
    damping_slopes: FloatArray | None = None
    shape_slopes: Array | ShapeSlopes | None = None
    frf_slopes: ComplexArray | None = None


class PredictionModel(Protocol):
    """Anything that predicts: `names` are the numbers to whose change the derivatives are asked for; none where empty."""

    def __call__(self, values: Mapping[str, float], names: Sequence[str]) -> Prediction:
        """Return the prediction at these values."""


@runtime_checkable
class DirectedModel(Protocol):
    """A model that differentiates along parameters that each move several of its numbers."""

    def along(self, values: Mapping[str, float], names: tuple[str, ...], owner: tuple[int, ...], *, slopes: FloatArray
              ) -> Prediction:
        """Return the prediction with derivatives per parameter: number names[k] moves by slopes[k] with parameter owner[k]."""
