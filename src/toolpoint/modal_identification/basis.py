r"""Real-linear basis functions of poles and of modes outside the band, for any measured quantity.

With :math:`p = i \omega + a` (a: decay of an exponential window, which shifts the whole response) a pole s with complex
residue :math:`A = \alpha + i \beta` gives the receptance

.. math:: \frac{A}{p - s} + \frac{A^*}{p - s^*} = \alpha\,u + \beta\,v,

linear in two real numbers. Mobility and accelerance are the same times :math:`p` and :math:`p^2`. Modes outside the
band are represented by rational terms :math:`(a + b p) / (p^2 + c^2)` with fixed c below and above the band: their sum
approximates any set of modes outside it; 1/p^2 and a constant (lower and upper residual) are the limits far from the band.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.modal_identification.band import QUANTITY_POWERS
from toolpoint.vibration.frf import Frf

LOWER_CENTRES = (0.25, 0.5, 0.71, 0.83, 0.91, 0.96)  # c over the lowest line
UPPER_CENTRES = (1.04, 1.1, 1.2, 1.4, 2.0, 4.0)  # c over the highest line
# Power of a response over the largest: below, it is the rounding of a computation (planes that do not couple), no measurement.
MIN_RESPONSE_POWER = 1e-18
MIN_FULL_BASIS_LINES = 120  # below, half of the centres; below half of it, none but the residuals


def laplace(frf: Frf) -> ComplexArray:
    """Return p = i w + decay of every line, rad/s."""
    return np.asarray(1j * frf.omega + frf.decay, complex)


def factor(frf: Frf) -> ComplexArray:
    """Return p^0, p^1 or p^2: the measured quantity over the receptance."""
    return laplace(frf) ** QUANTITY_POWERS[frf.quantity]


def scale_powers(power: FloatArray) -> FloatArray:
    """Return powers of responses with those of rounding alone replaced by the smallest of the others.

    What does not respond is zero on the scale of what does: on its own scale rounding would be a response that no modes follow.
    """
    is_live = power > MIN_RESPONSE_POWER * power.max(initial=0.0)
    return np.where(is_live, power, power[is_live].min(initial=np.inf)) if is_live.any() else np.ones_like(power)


def pole_terms(p: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Return u and v of every pole, shape (n_f, n_poles, 2)."""
    first, second = 1 / (p[:, None] - poles), 1 / (p[:, None] - poles.conj())
    return np.stack([first + second, 1j * (first - second)], axis=-1)


def pole_slopes(p: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Return the same functions of 1/(p - s)^2, shape (n_f, n_poles, 2).

    The derivative of alpha u + beta v by Re s is alpha u2 + beta v2, by Im s it is -beta u2 + alpha v2.
    """
    first, second = 1 / (p[:, None] - poles) ** 2, 1 / (p[:, None] - poles.conj()) ** 2
    return np.stack([first + second, 1j * (first - second)], axis=-1)


def outside_terms(frf: Frf) -> ComplexArray:
    """Return the receptance terms of the modes outside the band, shape (n_f, n_terms), each of unit size."""
    p, omega_min, omega_max = laplace(frf), float(frf.omega[0]), float(frf.omega[-1])
    stride = (1 if frf.frequency.size >= MIN_FULL_BASIS_LINES else 2 if frf.frequency.size >= MIN_FULL_BASIS_LINES / 2
              else len(UPPER_CENTRES))
    centres = [0.0, *(omega_min * c for c in LOWER_CENTRES[1::stride]),
               *(omega_max * c for c in UPPER_CENTRES[1::stride])] if stride > 1 else [
        0.0, *(omega_min * c for c in LOWER_CENTRES), *(omega_max * c for c in UPPER_CENTRES)]
    terms = [term for c in centres for term in (1 / (p**2 + c**2), p / (p**2 + c**2))]
    terms += [np.ones_like(p), p]
    basis = np.stack(terms, axis=1)
    # Terms run over many powers of p: without a common size the smallest would count as rounding of the largest.
    return basis / np.sqrt((np.abs(basis * factor(frf)[:, None]) ** 2).mean(axis=0))


def real_rows(values: ComplexArray) -> FloatArray:
    """Return complex rows as twice as many real ones: real parts first, then imaginary parts."""
    return np.concatenate([values.real, values.imag])
