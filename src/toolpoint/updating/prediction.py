"""Prediction: what a model says at one set of values, with the exact derivatives that a fit needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.vibration import Frf, Modes


@dataclass(frozen=True, eq=False)
class Prediction:
    """Modes and responses of a model, and their derivatives to the numbers asked for, per unit of each.

    Parameters
    ----------
    modes : Modes, optional
        Real, mass-normalised modes at least at the measured Dofs; more modes than measured, so that crossings can be
        followed.
    frf : Frf, optional
        Receptances at the measured lines, outputs and inputs.
    frequency_slopes, damping_slopes : (n_p, n_modes) floats, optional
        Hz and 1 per unit.
    shape_slopes : (n_p, n_dofs, n_modes) floats, optional
    frf_slopes : (n_p, n_f, n_outputs, n_inputs) complex, optional
    """

    modes: Modes | None = None
    frf: Frf | None = None
    frequency_slopes: FloatArray | None = None
    damping_slopes: FloatArray | None = None
    shape_slopes: FloatArray | None = None
    frf_slopes: ComplexArray | None = None


class Model(Protocol):
    """Anything that predicts: `names` are the numbers to whose change the derivatives are asked for; none where empty."""

    def __call__(self, values: Mapping[str, float], names: Sequence[str]) -> Prediction:
        """Return the prediction at these values."""
