r"""Mode indicator functions: complex (CMIF) and multivariate (MvMIF).

Sources: Shih, Tsuei, Allemang, Brown, MSSP 2 (1988) 367 (CMIF); Williams, Crowley, Vold, IMAC 3 (1985) (MvMIF).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.band import cut, noise_level
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True, eq=False)
class Indicator:
    """Values (n_f, n_references) on `frequency` (Hz), largest (CMIF) or smallest (MvMIF) first.

    For the CMIF `shape` (n_f, n_outputs, n) and `participation` (n_f, n_inputs, n) are the singular vectors: shape and
    participation of the mode that dominates a line.

    >>> two_references = Indicator(np.array([10.0, 20.0]), np.array([[5.0, 0.1], [4.0, 3.5]]))
    >>> two_references.frequency[two_references.values[:, 1].argmax()].item()  # the second value is high at a repeated mode
    20.0
    """

    frequency: FloatArray
    values: FloatArray
    shape: ComplexArray | None = None
    participation: ComplexArray | None = None


def cmif(frf: Frf, band: tuple[float, float] | None = None) -> Indicator:
    """Return the singular values of the response matrix on every line; a peak is a mode, a second high value a repeated one.

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> indicator = cmif(frf)
    >>> indicator.frequency[indicator.values[:, 0].argmax()].item()
    100.0
    """
    inside = cut(frf, band, 1)
    left, values, right = np.linalg.svd(inside.values, full_matrices=False)
    return Indicator(inside.frequency, values, left, np.swapaxes(right, -1, -2))


def mvmif(frf: Frf, band: tuple[float, float] | None = None) -> Indicator:
    r"""Return the multivariate mode indicator, 0 .. 1: a dip of the first value is a mode, one of the second a repeated root.

    The force pattern f that leaves least in-phase response: :math:`(H_R^T H_R) f = \lambda (H_R^T H_R + H_I^T H_I) f`,
    H_R the part that vanishes at a resonance (real of receptance and accelerance, imaginary of mobility).

    >>> from toolpoint.vibration import Modes, frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 121.0), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> indicator = mvmif(frf)
    >>> indicator.frequency[indicator.values[:, 0].argmin()].item()
    100.0
    """
    inside = cut(frf, band, 1)
    values = inside.values * 1j if inside.quantity == "mobility" else inside.values
    real = np.swapaxes(values.real, -1, -2) @ values.real
    total = real + np.swapaxes(values.imag, -1, -2) @ values.imag
    eigenvalues, vectors = np.linalg.eigh(total)
    is_excited = eigenvalues > 1e-12 * eigenvalues[:, -1:]
    whiten = np.where(is_excited[:, None, :], vectors / np.sqrt(np.where(is_excited, eigenvalues, 1.0))[:, None, :], 0.0)
    indicators = np.linalg.eigvalsh(np.swapaxes(whiten, -1, -2) @ real @ whiten)
    # Directions without response carry a zero that is no mode: they count as one.
    indicators = np.sort(np.where(is_excited.sum(axis=1)[:, None] > np.arange(indicators.shape[1])[::-1], indicators, 1.0),
                         axis=1)
    return Indicator(inside.frequency, np.clip(indicators, 0.0, 1.0))


def peaks(indicator: Indicator, prominence: float = 2.0) -> FloatArray:
    """Return the frequencies (Hz) of the peaks of the first CMIF curve that stand out by a factor `prominence`."""
    level = np.log(np.maximum(indicator.values[:, 0], np.finfo(float).tiny))
    limit = max(float(np.log(prominence)), 8 * float(noise_level(level)))
    return indicator.frequency[find_peaks(level, prominence=limit)[0]]
