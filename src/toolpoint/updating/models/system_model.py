r"""A model made of a SecondOrderSystem that depends on named numbers: predictions with exact sensitivities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.updating.models.damped_modes import has_damping, predict_damped_modes
from toolpoint.updating.models.low_rank import TERMS, Term, factor_matrices
from toolpoint.updating.models.prediction import Prediction
from toolpoint.updating.models.response_slopes import direct_response, modal_response
from toolpoint.updating.models.shape_turns import EqualDamping, UndampedModes, mode_prediction
from toolpoint.vibration import Dof, Frf, SecondOrderSystem
from toolpoint.vibration.sensitivity import MatrixDerivatives

Factors = dict[str, Term]
DAMPING_RATIO = "damping_ratio"  # the number of a model that damps all its modes alike; no matrix depends on it


class Systems(Protocol):
    """A system at any values, and its matrices' derivatives."""

    def system(self, values: Mapping[str, float]) -> SecondOrderSystem:
        """Return the system."""

    def derivatives(self, values: Mapping[str, float], names: Sequence[str]) -> MatrixDerivatives:
        """Return the derivatives per unit of these numbers."""

    def factors(self, values: Mapping[str, float], names: tuple[str, ...], owner: tuple[int, ...]) -> Factors:
        """Return their low-rank factors, number k belonging to parameter owner[k]."""


@dataclass(frozen=True, eq=False)
class AffineSystem:
    """A system whose matrices are affine in its numbers: base + sum (p - p_base) dM/dp, and so on.

    base : SecondOrderSystem, one pose; slopes : derivatives; values : the numbers at the base, in the order of slopes.

    >>> from toolpoint.vibration.sensitivity import MatrixDerivatives
    >>> base = SecondOrderSystem([[2.0]], [[8e6]])
    >>> springs = AffineSystem(base, MatrixDerivatives(("k",), stiffness=[[[1.0]]]), (8e6,))
    >>> springs.system({"k": 9e6}).stiffness.tolist()
    [[9000000.0]]
    """

    base: SecondOrderSystem
    slopes: MatrixDerivatives
    values: tuple[float, ...]
    _factors_by_choice: dict[object, Factors] = field(default_factory=dict, repr=False)

    def system(self, values: Mapping[str, float]) -> SecondOrderSystem:
        """Return the system at these values; numbers that are not named stay at the base."""
        change = np.array([values.get(n, v) - v for n, v in zip(self.slopes.names, self.values, strict=True)])
        new: dict[str, Any] = {}
        for term in TERMS:
            slope = getattr(self.slopes, term)
            if slope is not None:
                old = getattr(self.base, term)
                new[term] = np.tensordot(change, slope, 1) + (0.0 if old is None else old)
        return replace(self.base, **new)

    def derivatives(self, values: Mapping[str, float], names: Sequence[str]) -> MatrixDerivatives:
        """Return the constant derivatives of these numbers."""
        if tuple(names) == self.slopes.names:
            return self.slopes
        unknown_names = [n for n in names if n not in self.slopes.names]
        if unknown_names:
            fail("names", ", ".join(unknown_names), f"must be of {', '.join(self.slopes.names)}")
        position = [self.slopes.names.index(n) for n in names]
        part = {t: None if (a := getattr(self.slopes, t)) is None else a[position] for t in TERMS}
        return MatrixDerivatives(tuple(names), **part)

    def factors(self, values: Mapping[str, float], names: tuple[str, ...], owner: tuple[int, ...]) -> Factors:
        """Return the low-rank factors of the constant derivatives, made once for each choice of numbers."""
        key = names, owner
        if key not in self._factors_by_choice:
            self._factors_by_choice[key] = factor_matrices(self.derivatives(values, names), owner)
        return self._factors_by_choice[key]


@dataclass(frozen=True, eq=False)
class SystemModel:
    """The model of a fit, from a system that depends on numbers.

    Parameters
    ----------
    systems : Systems
        For example an `AffineSystem`.
    modes : int
        How many of the lowest modes are predicted; 0 for none.
    lines : (n_f,) floats, optional
        Hz, where receptances are predicted.
    outputs, inputs : sequences of Dof
        Of the receptances; must be among the system's.
    modal_damping : float, optional
        One damping ratio for all modes instead of the system's damping matrices; a number named `DAMPING_RATIO` takes its
        place.
    """

    systems: Systems
    modes: int = 0
    lines: FloatArray | None = None
    outputs: tuple[Dof, ...] = ()
    inputs: tuple[Dof, ...] = ()
    modal_damping: float | None = None

    def __call__(self, values: Mapping[str, float], names: Sequence[str] = ()) -> Prediction:
        """Return modes and receptances at these values, with derivatives to `names`."""
        if not names:
            return self._predicted(values, {}, np.zeros(0), np.zeros(0))
        return self.along(values, tuple(names), tuple(range(len(names))), slopes=np.ones(len(names)))

    def along(self, values: Mapping[str, float], names: tuple[str, ...], owner: tuple[int, ...], *, slopes: FloatArray
              ) -> Prediction:
        """Return the prediction with derivatives per parameter: number names[k] moves by slopes[k] with parameter owner[k]."""
        ratio_slopes = np.zeros(max(owner, default=-1) + 1)
        for k, name in enumerate(names):
            if name == DAMPING_RATIO:
                ratio_slopes[owner[k]] += slopes[k]
        return self._predicted(values, self.systems.factors(values, names, owner), slopes, ratio_slopes)

    def _predicted(self, values: Mapping[str, float], factors: Factors, slopes: FloatArray, ratio_slopes: FloatArray
                   ) -> Prediction:
        result, system, number = Prediction(), self.systems.system(values), ratio_slopes.size
        equal_damping = (None if self.modal_damping is None else
                 EqualDamping(values.get(DAMPING_RATIO, self.modal_damping), ratio_slopes))
        weighted = {name: (term, term.scaled(slopes)) for name, term in factors.items()}
        modal = None
        if self.modes or equal_damping:
            modal = UndampedModes(system, weighted, number, None if equal_damping else self.modes)
        if self.modes and modal is not None:
            number_of_modes = min(self.modes, system.size)
            result = (predict_damped_modes(system, modal, number_of_modes)
                      if equal_damping is None and has_damping(system, weighted)
                      else mode_prediction(system, modal, number_of_modes, equal_damping=equal_damping))
        if self.lines is None:
            return result
        left = system.output_map[_places(system.outputs, self.outputs)]
        right = system.input_map[:, _places(system.inputs, self.inputs)]
        if modal is not None and equal_damping is not None:
            response, changes = modal_response(self.lines, left, right, modal=modal, equal_damping=equal_damping)
        else:
            response, changes = direct_response(self.lines, left, right, system=system, factors=weighted, count=number)
        return replace(result, frf=Frf(self.lines, response, self.outputs, self.inputs), frf_slopes=changes)


def _places(labels: Sequence[Dof], chosen: Sequence[Dof]) -> list[int]:
    """Return where labels stand among others."""
    position = {dof: i for i, dof in reversed(list(enumerate(labels)))}
    return [position[dof] for dof in chosen]
