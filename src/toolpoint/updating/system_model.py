r"""A model made of a SecondOrderSystem that depends on named numbers: predictions with exact sensitivities.

Undamped modes with :math:`\phi^T M \phi = 1`:
:math:`F_i = K' - \omega_i^2 M'`, :math:`(\omega_i^2)' = \phi_i^T F_i \phi_i`,
:math:`\phi_i' = \sum_{j \ne i} \phi_j (\phi_j^T F_i \phi_i) / (\omega_i^2 - \omega_j^2) - \phi_i (\phi_i^T M' \phi_i)/2`,
for all parameters and modes in a few matrix products. Source: Fox, Kapoor, AIAA J. 6 (1968).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, fail
from toolpoint.updating.prediction import Prediction
from toolpoint.vibration import Dof, Frf, Modes, SecondOrderSystem
from toolpoint.vibration.eigen import mass_normalised
from toolpoint.vibration.sensitivity import MatrixDerivatives

_EQUAL = 1e-9
_TERMS = ("mass", "damping", "stiffness", "structural_damping")


class Systems(Protocol):
    """A system at any values, and its matrices' derivatives."""

    def system(self, values: Mapping[str, float]) -> SecondOrderSystem:
        """Return the system."""

    def derivatives(self, values: Mapping[str, float], names: Sequence[str]) -> MatrixDerivatives:
        """Return the derivatives per unit of these numbers."""


@dataclass(frozen=True, eq=False)
class AffineSystem:
    """A system whose matrices are affine in its numbers: base + sum (p - p_base) dM/dp, and so on.

    base : SecondOrderSystem, one pose; slopes : derivatives; values : the numbers at the base, in the order of slopes.
    """

    base: SecondOrderSystem
    slopes: MatrixDerivatives
    values: tuple[float, ...]

    def system(self, values: Mapping[str, float]) -> SecondOrderSystem:
        """Return the system at these values; numbers that are not named stay at the base."""
        change = np.array([values.get(n, v) - v for n, v in zip(self.slopes.names, self.values, strict=True)])
        new = {}
        for term in _TERMS:
            slope = getattr(self.slopes, term)
            if slope is not None:
                old = getattr(self.base, term)
                new[term] = np.tensordot(change, slope, 1) + (0.0 if old is None else old)
        return replace(self.base, **new)  # type: ignore[arg-type]

    def derivatives(self, values: Mapping[str, float], names: Sequence[str]) -> MatrixDerivatives:
        """Return the constant derivatives of these numbers."""
        if tuple(names) == self.slopes.names:
            return self.slopes
        missing = [n for n in names if n not in self.slopes.names]
        if missing:
            fail("names", ", ".join(missing), f"must be of {', '.join(self.slopes.names)}")
        at = [self.slopes.names.index(n) for n in names]
        part = {t: None if (a := getattr(self.slopes, t)) is None else a[at] for t in _TERMS}
        return MatrixDerivatives(tuple(names), **part)


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
        One damping ratio for all modes instead of the system's damping matrices.
    """

    systems: Systems
    modes: int = 0
    lines: FloatArray | None = None
    outputs: tuple[Dof, ...] = ()
    inputs: tuple[Dof, ...] = ()
    modal_damping: float | None = None

    def __call__(self, values: Mapping[str, float], names: Sequence[str] = ()) -> Prediction:
        """Return modes and receptances at these values, with derivatives to `names`."""
        system = self.systems.system(values)
        slopes = self.systems.derivatives(values, names) if names else None
        result = Prediction()
        every = self.modal_damping is not None
        modal = _Modal(system, slopes, None if every else self.modes) if self.modes or every else None
        if self.modes and modal is not None:
            result = _modes(system, modal, min(self.modes, system.size), self.modal_damping)
        if self.lines is None:
            return result
        if modal is not None and self.modal_damping is not None:
            values_, changes = _modal_response(self, system, modal, self.modal_damping)
        else:
            values_, changes = _direct_response(self, system, slopes)
        frf = Frf(self.lines, values_, self.outputs, self.inputs)
        return replace(result, frf=frf, frf_slopes=changes)


class _Modal:
    """All undamped modes and derivatives of the lowest `keep`: square_slopes (p, keep), turns (p, n, keep) in the vectors."""

    def __init__(self, system: SecondOrderSystem, slopes: MatrixDerivatives | None, keep: int | None = None) -> None:
        self.squares, self.vectors = mass_normalised(system.mass, system.stiffness)
        self.keep = self.squares.size if keep is None else min(keep, self.squares.size)
        self.omega = np.sqrt(np.maximum(self.squares, 0.0))
        self.slopes = slopes
        if slopes is None:
            return
        stiffness, mass = self.projected(slopes.stiffness), self.projected(slopes.mass)
        own = self.squares[:self.keep]
        form = stiffness - own * mass
        gap = own - self.squares[:, None]
        top = np.maximum(np.abs(own), np.abs(self.squares[:, None]))
        near = np.abs(gap) <= _EQUAL * top
        # Inside a group of equal roots the vectors turn with the parameter in jumps; there only frequencies are followed.
        self.turns = np.where(near, 0.0, form / np.where(near, 1.0, gap))
        each = np.arange(self.keep)
        self.turns[:, each, each] = -0.5 * mass[:, each, each]
        self.square_slopes = form[:, each, each]

    def projected(self, matrices: FloatArray | None) -> FloatArray:
        """Return phi^T A' phi of every parameter for the modes kept, (p, n, keep)."""
        n, kept = self.squares.size, self.vectors[:, :self.keep]
        count = len(self.slopes.names) if self.slopes else 0
        result = np.zeros((count, n, self.keep))
        if matrices is None:
            return result
        used = np.flatnonzero(matrices.any(axis=(1, 2)))
        if used.size == 0:
            return result
        # Two large products instead of a small one per parameter.
        right = matrices[used].reshape(-1, n) @ kept
        left = self.vectors.T @ np.swapaxes(right.reshape(used.size, n, -1), 0, 1).reshape(n, -1)
        result[used] = np.swapaxes(left.reshape(n, used.size, -1), 0, 1)
        return result


def _modes(system: SecondOrderSystem, modal: _Modal, keep: int, ratio: float | None) -> Prediction:
    omega = modal.omega[:keep]
    if (omega <= 0).any():
        fail("model", f"{int((omega <= 0).sum())} modes at 0 Hz or unstable", "must be held in all directions",
             "raise the lower bounds of the stiffnesses, or ground the model")
    damping, damping_slopes = _damping(system, modal, keep, ratio)
    shape = system.output_map @ modal.vectors
    modes = Modes(omega / (2 * np.pi), damping, shape[:, :keep], system.outputs)  # type: ignore[arg-type]
    if modal.slopes is None:
        return Prediction(modes)
    return Prediction(modes, None, modal.square_slopes[:, :keep] / (4 * np.pi * omega), damping_slopes,
                      (shape @ np.swapaxes(modal.turns[:, :, :keep], 0, 1).reshape(shape.shape[1], -1)).reshape(
                          shape.shape[0], -1, keep).swapaxes(0, 1))


def _damping(
    system: SecondOrderSystem, modal: _Modal, keep: int, ratio: float | None
) -> tuple[FloatArray, FloatArray | None]:
    """Diagonal of the modal damping matrix as ratios, sum of the viscous and the structural part."""
    omega, zeta = modal.omega[:keep], np.zeros(keep)
    slopes = None if modal.slopes is None else np.zeros((len(modal.slopes.names), keep))
    if ratio is not None:
        return np.full(keep, ratio), slopes
    each = np.arange(keep)
    for term, power in (("damping", 1), ("structural_damping", 2)):
        matrix = getattr(system, term)
        if matrix is None:
            continue
        inner = modal.vectors.T @ matrix @ modal.vectors
        part = inner[each, each] / (2 * omega**power)
        zeta += part
        if slopes is not None and modal.slopes is not None:
            own = modal.projected(getattr(modal.slopes, term))[:, each, each]
            turned = 2 * (inner[:, :keep] * modal.turns[:, :, :keep]).sum(axis=1)
            change = modal.square_slopes[:, :keep] / (2 * omega**2)
            slopes += (own + turned) / (2 * omega**power) - power * part * change
    return zeta, slopes


def _maps(model: SystemModel, system: SecondOrderSystem) -> tuple[Array, Array]:
    rows = [system.outputs.index(d) for d in model.outputs]
    columns = [system.inputs.index(d) for d in model.inputs]
    return system.output_map[rows], system.input_map[:, columns]  # type: ignore[index]


def _direct_response(
    model: SystemModel, system: SecondOrderSystem, slopes: MatrixDerivatives | None
) -> tuple[ComplexArray, ComplexArray | None]:
    left, right = _maps(model, system)
    w = 2 * np.pi * np.asarray(model.lines)[:, None, None]
    z = system.stiffness - w**2 * system.mass + 0j
    if system.damping is not None:
        z += 1j * w * system.damping
    if system.structural_damping is not None:
        z += 1j * system.structural_damping
    # Symmetric matrices: one factorisation serves forces and (transposed) responses.
    both = np.linalg.solve(z, np.concatenate([right, left.T], axis=1) + 0j)
    forced, sensed = both[..., :right.shape[1]], both[..., right.shape[1]:]
    values = left @ forced
    if slopes is None:
        return values, None
    result: ComplexArray = np.zeros((len(slopes.names), *values.shape), complex)
    outer = np.einsum("fao,fbi->foiab", sensed, forced).reshape(values.size, -1)
    factors = {"stiffness": 1.0, "damping": 1j * w, "structural_damping": 1j, "mass": -w**2}
    for term, factor in factors.items():
        matrix = getattr(slopes, term)
        if matrix is not None:
            flat = matrix.reshape(len(slopes.names), -1)
            used = np.abs(flat).any(axis=0)
            result -= factor * (flat[:, used] @ outer[:, used].T).reshape(result.shape)
    return values, result


def _modal_response(
    model: SystemModel, system: SecondOrderSystem, modal: _Modal, ratio: float
) -> tuple[ComplexArray, ComplexArray | None]:
    left, right = _maps(model, system)
    a, b = left @ modal.vectors, modal.vectors.T @ right
    w, omega = 2 * np.pi * np.asarray(model.lines)[:, None], modal.omega
    g = 1 / (omega**2 - w**2 + 2j * ratio * omega * w)
    values = np.einsum("or,fr,ri->foi", a, g, b)
    if modal.slopes is None:
        return values, None
    da, db = a @ modal.turns, np.swapaxes(modal.turns, -1, -2) @ b
    dg = -(g**2) * (1 + 1j * ratio * w / omega) * modal.square_slopes[:, None, :]
    changes = (np.einsum("por,fr,ri->pfoi", da, g, b, optimize=True) + np.einsum("or,fr,pri->pfoi", a, g, db, optimize=True)
               + np.einsum("or,pfr,ri->pfoi", a, dg, b, optimize=True))
    return values, changes
