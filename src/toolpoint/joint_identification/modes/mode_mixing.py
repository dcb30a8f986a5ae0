r"""What errors of poles do to the shapes of modes that overlap: each takes up a part of the others, at all points alike.

Residues are fitted to responses at the poles that were identified. Where these are off by :math:`\delta_s`, the best residues
on the wrong curves :math:`g_r = 1 / (i \omega - \lambda_r)` are, as :math:`g_s` at the right pole is
:math:`g_s - g_s^2 \delta_s` to first order,

.. math:: \hat A_r = A_r - \sum_s (\Gamma^{-1} B)_{rs} \delta_s A_s, \quad
          \Gamma_{rs} = \int g_r^* g_s\, d\omega = -\frac{2 \pi}{\lambda_r^* + \lambda_s}, \quad
          B_{rs} = \int g_r^* g_s^2\, d\omega = \frac{2 \pi}{(\lambda_r^* + \lambda_s)^2}

(Parseval, with :math:`e^{\lambda t}` and :math:`t e^{\lambda t}`). A mixed shape is as rigid a motion as the true one and the
same at every point: neither the residual of a component nor any number of points tells of it. A machine that says where the
poles are says the mixing too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray
from toolpoint.joint_identification.modes.modal_data import ModalData
from toolpoint.vibration import Modes

# Distance of two poles, in the sum of their half-widths, up to which they mix.
_OVERLAP = 1.5
# Part of the mixing that the integrals miss: they know neither the ends of the band nor the weights of the lines.
_MISSED = 0.5


def shape_mixing(modes: Modes) -> ComplexArray | None:
    """Return the mixing (k, k) by which measured shapes (turned by `phases`) are set right: shape r gains its entries times
    the errors of the poles (measured less true, rad/s) times the shapes s; None for real shapes or unknown participation."""
    if modes.participation is None or not np.iscomplexobj(modes.shape):
        return None
    omega, ratio = modes.omega, modes.damping_ratio
    poles = omega * (-ratio + 1j * np.sqrt(np.maximum(1 - ratio**2, 0.0)))
    total = poles.conj()[:, None] + poles[None]
    mixed = np.linalg.solve(-1 / total, 1 / total**2)
    # Shapes are residues over participations: the part along the participation of mode r stays in its shape.
    given = np.asarray(modes.participation)
    power = (np.abs(given) ** 2).sum(axis=0)
    along = np.einsum("ds,dr->rs", given, given.conj()) / np.maximum(power, 1e-300)[:, None]
    mixed = mixed * along
    # Farther apart the residual terms and the ends of the band rule what little is mixed (seen in tests, not in the integrals).
    apart = np.abs(poles.imag[:, None] - poles.imag) / -total.real
    mixed[apart > _OVERLAP] = 0.0
    np.fill_diagonal(mixed, 0.0)  # of its own scale, which is free
    return np.asarray(mixed, complex)


def with_mixing(data: ModalData, mixing: ComplexArray) -> ModalData:
    """Return the data with this mixing, and with what it misses as shares of other shapes that stay open."""
    covariance = np.linalg.inv(np.einsum("kji,kjl->kil", data.spread, data.spread))
    # Of (ln f, ratio): a pole moves by its size times either.
    size = 2 * np.pi * data.frequency * np.sqrt(np.einsum("kii->k", covariance))
    return replace(data, mixing=mixing, unsure=np.asarray(_MISSED * np.abs(mixing) * size))
