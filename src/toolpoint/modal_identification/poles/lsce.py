r"""Poly-reference least-squares complex exponential poles (LSCE) of all orders, from impulse responses.

Impulse responses :math:`h_o(n) = \sum_r \phi_{or} z_r^n l_r^T` obey :math:`\sum_j h_o(n + j) B_j = 0`; the normal matrix
of the B_j over all outputs and samples is one for all orders (as in `plscf`, whose roots are used). Source: Brown,
Allemang, Zimmerman, Mergeay, SAE 790221 (1979); Vold, Kundrat, Rocklin, Russell, SAE 820194 (1982).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.modal_identification.band import line_spacing
from toolpoint.modal_identification.poles.plscf import cholesky, roots_of_order
from toolpoint.modal_identification.poles.selection import Selection, select_poles
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.modal_identification.poles.start import Start
from toolpoint.vibration.frf import Frf

BAND_END_FRACTION = 0.01  # of the band, at either end, whose poles are left out


@dataclass(frozen=True)
class ComplexExponential:
    """LSCE of all orders with selection across them; needs evenly spaced lines."""

    order: int = 60
    step: int = 2
    share: float = 0.35
    refine: bool = False
    name: str = "LSCE"

    def start(self, frf: Frf) -> Start:
        """Return the poles selected across orders."""
        order = min(self.order, frf.frequency.size // 3)
        responses, interval = impulse_responses(frf)
        # Lags are reversed, so that the past is predicted from the future: the roots are 1/z, and those of the noise
        # come out unstable and drop away, as in pLSCF (Kumaresan, Tufts, IEEE Trans. ASSP 30 (1982) 833).
        inputs = len(frf.inputs)
        normal = lag_products(responses, order).reshape(order + 1, inputs, order + 1, inputs)[::-1, :, ::-1]
        normal = normal.reshape((order + 1) * inputs, -1)
        factor = cholesky(normal, float(np.diagonal(normal).mean()))
        orders = []
        for m in range(self.step, order + 1, self.step):
            roots, vectors = roots_of_order(factor, m, inputs)
            orders.append((m, -np.log(roots) / interval, vectors))
        diagram = Diagram.collected(orders, (frf.omega[0], frf.omega[-1]))
        return drop_end_poles(select_poles(diagram, self.share), diagram, frf)


def drop_end_poles(choice: Selection, diagram: Diagram, frf: Frf) -> Start:
    """Return the selection without poles within a hundredth of the band of its ends.

    The transform of a band that is cut sharply rings at the two cuts; such a pole cannot be told from a mode there.
    """
    margin = BAND_END_FRACTION * (frf.omega[-1] - frf.omega[0])
    size = np.abs(choice.poles)
    keep = (size > frf.omega[0] + margin) & (size < frf.omega[-1] - margin)
    notes = [f"a pole at {s / (2 * np.pi):.4g} Hz, at the cut of the band, is left out: it may be an artefact of the cut"
             for s in size[~keep]]
    return Start(choice.poles[keep], choice.participation[:, keep], diagram, choice.support[keep], tuple(notes))


def impulse_responses(frf: Frf) -> tuple[FloatArray, float]:
    """Return the impulse responses of the band (n, n_outputs, n_inputs), each over its rms, and their time step, s.

    The first samples hold the direct term of the modes above the band and are left out, as is the last quarter, where
    the response of a band cut sharply wraps around.
    """
    step = line_spacing(frf)
    first, last = round(frf.frequency[0] / step), round(frf.frequency[-1] / step)
    if abs(frf.frequency[0] - first * step) > 1e-3 * step:
        fail("frf.frequency", f"a start of {frf.frequency[0]:g} Hz with lines {step:g} Hz apart",
             "must be a whole number of spacings for impulse responses", remedy="use method='refined' or interpolate")
    spectrum = np.zeros((last + 1, *frf.values.shape[1:]), complex)
    rms = np.sqrt((np.abs(frf.values) ** 2).mean(axis=0))
    spectrum[first:] = frf.values / np.where(rms > 0, rms, 1.0)
    n = 2 * last
    responses = np.fft.irfft(spectrum, n, axis=0)
    return np.ascontiguousarray(responses[2:n // 2]), 1 / (n * step)


def lag_products(responses: FloatArray, order: int) -> FloatArray:
    """Return sums over outputs and samples of h(n + j)^T h(n + k), ((order + 1) n_inputs, same), by lag then input."""
    n, _, inputs = responses.shape
    samples = n - order
    if samples < order:
        fail("order", f"{order} with {n} samples of impulse response", "must be at most half of them",
             remedy="lower the order or measure with a finer line spacing")
    result = np.empty((order + 1, inputs, order + 1, inputs))
    for j in range(order + 1):
        first = responses[j:j + samples].reshape(-1, inputs)
        for k in range(j, order + 1):
            if j == 0:
                result[j, :, k] = first.T @ responses[k:k + samples].reshape(-1, inputs)
            else:  # a product one sample later differs by its two ends only
                result[j, :, k] = (result[j - 1, :, k - 1] - responses[j - 1].T @ responses[k - 1]
                                   + responses[j - 1 + samples].T @ responses[k - 1 + samples])
            result[k, :, j] = result[j, :, k].T
    return result.reshape((order + 1) * inputs, -1)
