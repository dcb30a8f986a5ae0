r"""Least-squares frequency-domain residues (LSFD): given poles, the residues of every response with residual terms.

:math:`H_{jk} = \sum_r \frac{A_{jkr}}{p - s_r} + \frac{A_{jkr}^*}{p - s_r^*} + \frac{LR_{jk}}{p^2} + UR_{jk}` times
:math:`p^0 .. p^2` for receptance .. accelerance. Source: Heylen, Lammens, Sas, Modal Analysis Theory and Testing, A.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.modal_identification.basis import factor, laplace, pole_terms, real_rows
from toolpoint.modal_identification.scaling import factor_rank_one
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True, eq=False)
class Residues:
    """Residues (n_outputs, n_inputs, n_modes), lower and upper residual (n_outputs, n_inputs), share of energy explained.

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> residues(frf, modes.poles).values.shape  # outputs, inputs, modes
    (1, 1, 1)
    """

    values: ComplexArray
    lower: FloatArray
    upper: FloatArray
    quality: FloatArray


def residues(frf: Frf, poles: ComplexArray, lower: bool = True, *, upper: bool = True) -> Residues:
    """Return the residues of all responses for common poles (rad/s, free of the window's decay), each on its own.

    Poles that coincide cannot be told apart by residues alone; a method with participation factors is needed for them.

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> residue = residues(frf, modes.poles).values[0, 0, 0]
    >>> bool(np.isclose(residue, 0.1**2 / (2j * modes.poles[0].imag)))  # phi^2 / (2 i w_d)
    True
    """
    size = np.abs(poles)
    distance = np.abs(poles[:, None] - poles) + np.eye(poles.size) * size.max(initial=1.0)
    if poles.size > 1 and distance.min() < 1e-6 * size.min():
        fail("poles", "two poles coincide", "must differ", remedy="use method='refined', which parts them by their references")
    p = laplace(frf)
    if lower and (p == 0).any():
        fail("frf", "a line at 0 Hz", "must not be there for a lower residual, which is infinite there",
             remedy="leave the line out (frf.between), or the residual (lower=False)")
    terms = [pole_terms(p, poles).reshape(p.size, -1)]
    terms += [(1 / p**2)[:, None]] if lower else []
    terms += [np.ones((p.size, 1), complex)] if upper else []
    basis = real_rows(np.concatenate(terms, axis=1) * factor(frf)[:, None])
    scale = np.linalg.norm(basis, axis=0)
    rows = real_rows(frf.values.reshape(p.size, -1))
    # Columns of unit length: resonances and residual terms differ by many orders, and the cut-off is relative.
    values = np.linalg.lstsq(basis / scale, rows, rcond=1e-12)[0] / scale[:, None]
    misfit = rows - basis @ values
    shape = frf.values.shape[1:]
    count = poles.size
    residue_parts = values[:2 * count].reshape(count, 2, *shape)
    residual_terms = list(values[2 * count:].reshape(-1, *shape))
    zero = np.zeros(shape)
    power = np.maximum((rows**2).sum(axis=0), np.finfo(float).tiny)
    return Residues(np.moveaxis(residue_parts[:, 0] + 1j * residue_parts[:, 1], 0, -1), residual_terms.pop(0) if lower
                    else zero,
                    residual_terms.pop(0) if upper else zero, (1 - (misfit**2).sum(axis=0) / power).reshape(shape))


def fit_participation(frf: Frf, poles: ComplexArray) -> ComplexArray:
    """Return the participation (n_inputs, n_modes) that fits the residues of each pole best, for poles of the data."""
    values = residues(frf, poles + frf.decay).values
    return np.stack([factor_rank_one(values[:, :, r])[1] for r in range(poles.size)], axis=1)
