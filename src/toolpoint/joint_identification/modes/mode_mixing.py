r"""Mixing of the shapes of overlapping modes by errors of their poles: each takes up a part of the others, at all points alike.

Residues are fitted to responses at the poles that were identified. Where these are off by :math:`\delta_s`, the best residues
on the wrong curves :math:`g_r = 1 / (i \omega - \lambda_r)` are, as :math:`g_s` at the right pole is
:math:`g_s - g_s^2 \delta_s` to first order,

.. math:: \hat A_r = A_r - \sum_s (\Gamma^{-1} B)_{rs} \delta_s A_s, \quad
          \Gamma_{rs} = \int g_r^* g_s\, d\omega = -\frac{2 \pi}{\lambda_r^* + \lambda_s}, \quad
          B_{rs} = \int g_r^* g_s^2\, d\omega = \frac{2 \pi}{(\lambda_r^* + \lambda_s)^2}

(Parseval, with :math:`e^{\lambda t}` and :math:`t e^{\lambda t}`). A mixed shape is as rigid a motion as the true one and the
same at every point: neither the residual of a component nor any number of points shows it. A machine that determines the poles
determines the mixing too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray
from toolpoint.joint_identification.modes.modal_data import ModalData
from toolpoint.vibration import Modes

_MAX_MIXING_DISTANCE = 1.5  # of two poles, over the sum of their half-power half widths: farther ones do not mix
# Relative standard deviation of the mixing: the integrals know neither the ends of the band nor the weights of the lines.
_MIXING_ERROR = 0.5


def shape_mixing(modes: Modes) -> ComplexArray | None:
    """Return the mixing (k, k) by which the measured shapes are corrected; None for real shapes or unknown participation.

    Shape r gains the sum over s of entry (r, s), times the error of pole s (measured less true, rad/s), times shape s. The
    entries belong to the shapes with the phases that they have in `modes`.
    """
    if modes.participation is None or not np.iscomplexobj(modes.shape):
        return None
    omega, ratio = modes.omega, modes.damping_ratio
    poles = omega * (-ratio + 1j * np.sqrt(np.maximum(1 - ratio**2, 0.0)))
    total = poles.conj()[:, None] + poles[None]
    mixed = np.linalg.solve(-1 / total, 1 / total**2)
    # Shapes are residues over participations: the part along the participation of mode r stays in its shape.
    participation = np.asarray(modes.participation)
    power = (np.abs(participation) ** 2).sum(axis=0)
    projection = np.einsum("ds,dr->rs", participation, participation.conj()) / np.maximum(power, 1e-300)[:, None]
    mixed = mixed * projection
    # Farther apart the residual terms and the ends of the band rule what little is mixed (seen in tests, not in the integrals).
    distance = np.abs(poles.imag[:, None] - poles.imag) / -total.real
    mixed[distance > _MAX_MIXING_DISTANCE] = 0.0
    np.fill_diagonal(mixed, 0.0)  # of its own scale, which is free
    return np.asarray(mixed, complex)


def with_mixing(data: ModalData, mixing: ComplexArray) -> ModalData:
    """Return the data with this mixing (k, k), and with its error as undetermined shares of other shapes.

    The error is `_MIXING_ERROR` times the mixing, for a pole error of one standard deviation.
    """
    covariance = np.linalg.inv(np.einsum("kji,kjl->kil", data.spread, data.spread))
    # The spread is of (ln f, ratio): a pole moves by its modulus times either.
    size = 2 * np.pi * data.frequency * np.sqrt(np.einsum("kii->k", covariance))
    return replace(data, mixing=mixing, mixing_deviation=np.asarray(_MIXING_ERROR * np.abs(mixing) * size))


def mixing_in_phase(modes: Modes) -> ComplexArray | None:
    """Return the mixing (k, k) for shapes turned to the phase of largest real parts; None as of `shape_mixing`."""
    mixing = shape_mixing(modes)
    if mixing is None:
        return None
    phase = np.exp(-0.5j * np.angle((modes.shape**2).sum(axis=0)))
    return np.asarray(mixing * phase[:, None] / phase)
