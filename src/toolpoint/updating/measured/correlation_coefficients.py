r"""Weighted correlation coefficients of two paired sets of modes: frequency, mean, mass, displacement, MAC, total.

All lie within 0 (nothing in common) and 1 (equal). The thesis that names these coefficients (University of Huddersfield,
2006, on vibration-induced errors of a machining centre) was at hand without its formulas; the definitions are this module's:

- frequency: :math:`1 - |f - f_m| / \max(f, f_m)` of every pair;
- mean: the mean of the frequency coefficients with equal weights;
- mass: their mean weighted by the share of each measured mode in the effective (or given) modal mass;
- displacement: :math:`1 - \|\hat\phi - \hat\phi_m\|_1 / (\|\hat\phi\|_1 + \|\hat\phi_m\|_1)` with the model's shape
  scaled by its modal scale factor: unlike MAC, it counts every Dof by its size and not by its square;
- MAC: see `vibration.correlation`;
- total: the weighted mean over the pairs of the product of frequency, displacement and MAC coefficient.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import Array, FloatArray, fail, floats, nonnegative
from toolpoint._notebook import NotebookText
from toolpoint.vibration import Modes, correlation


@dataclass(frozen=True, eq=False)
class CorrelationCoefficients(NotebookText):
    """Coefficients of each pair: frequency, displacement, mac, weight (sum 1), (n_pairs,); over all: mean, mass, total."""

    frequency: FloatArray
    displacement: FloatArray
    mac: FloatArray
    weight: FloatArray
    mean: float
    mass: float
    total: float

    def table(self) -> str:
        """Return the coefficients as text."""
        lines = [" pair  frequency  displacement    MAC   weight"]
        lines += [f"{r + 1:5d} {f:10.4f} {d:13.4f} {m:6.4f} {w:8.4f}" for r, (f, d, m, w) in enumerate(
            zip(self.frequency, self.displacement, self.mac, self.weight, strict=True))]
        return "\n".join([*lines, f"mean {self.mean:.4f}, mass {self.mass:.4f}, total {self.total:.4f}"])


def coefficients(measured: Modes, predicted: Modes, weight: ArrayLike | None = None) -> CorrelationCoefficients:
    """Return the coefficients of modes that are paired one to one at the same Dofs.

    Parameters
    ----------
    measured, predicted : Modes
        The same number of modes in the same order; the measured Dofs must be among the predicted ones.
    weight : (n_modes,) floats, optional
        Mass that takes part in every mode; equal where left out.
    """
    if measured.count != predicted.count or measured.count == 0:
        fail("predicted", f"{predicted.count} modes for {measured.count}", "must be paired one to one",
             remedy="use `pair_modes` first")
    weights_given = np.ones(measured.count) if weight is None else weight
    shares = nonnegative("weight", floats("weight", weights_given, (measured.count,)))
    if shares.sum() <= 0:
        fail("weight", "all zero", "must weigh at least one mode")
    shares = shares / shares.sum()
    y, phi = measured.shape, predicted.shape_at(measured.dofs)
    f, fm = predicted.frequency, measured.frequency
    frequency = 1 - np.abs(f - fm) / np.maximum(np.maximum(f, fm), 1e-300)
    mac = np.diag(correlation.mac(y, phi))
    moved = _displacement(y, phi)
    return CorrelationCoefficients(frequency, moved, mac, shares, float(frequency.mean()), float(shares @ frequency),
                                   float(shares @ (frequency * moved * mac)))


def _displacement(y: Array, phi: Array) -> FloatArray:
    scaled = phi * np.diag(correlation.modal_scale_factor(phi, y))
    bottom = np.abs(y).sum(axis=0) + np.abs(scaled).sum(axis=0)
    return np.asarray(1 - np.abs(y - scaled).sum(axis=0) / bottom)
