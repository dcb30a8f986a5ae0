r"""Eigensystem realization (ERA, in its data-correlation form) of impulse responses.

The left singular vectors of the block-Hankel matrix, by lag and reference, span the observability of the references;
shifted by one lag they give the state matrix, whose eigenvalues are the poles and whose first block row times the
eigenvectors is the participation. They come from the correlation matrix :math:`H H^T`, which stays small however many
outputs there are. Source: Juang, Pappa, J. Guidance 8 (1985) 620; Juang, Cooper, Wright, Control Theory 4 (1988) 5
(ERA/DC).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint.modal_identification.poles.lsce import drop_end_poles, impulse_responses, lag_products
from toolpoint.modal_identification.poles.selection import select_poles
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.modal_identification.poles.start import Start
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True)
class Realization:
    """ERA with model sizes `step`, 2 `step` .. `order` states and selection across them; needs evenly spaced lines."""

    order: int = 100
    step: int = 4
    lags: int = 80
    share: float = 0.35
    refine: bool = False
    name: str = "ERA"

    def start(self, frf: Frf) -> Start:
        """Return the poles selected across model sizes."""
        inputs = len(frf.inputs)
        responses, interval = impulse_responses(frf)
        lags = min(self.lags, responses.shape[0] // 3)
        size, vectors = np.linalg.eigh(lag_products(responses, lags))
        vectors = vectors[:, np.argsort(-size)]
        orders = []
        for states in range(self.step, min(self.order, lags * inputs) + 1, self.step):
            observed = vectors[:, :states]
            # The shift is solved backwards, which leaves the poles of the noise unstable (as in `lsce`).
            matrix = np.linalg.lstsq(observed[inputs:], observed[:-inputs], rcond=None)[0]
            roots, right = np.linalg.eig(matrix)
            # A root at nought is a delay of a sample: its logarithm would be a pole infinitely far to the left.
            keep = np.abs(roots) > 1e-8
            orders.append((states, -np.log(roots[keep].astype(complex)) / interval, (observed[:inputs] @ right)[:, keep]))
        diagram = Diagram.collected(orders, (frf.omega[0], frf.omega[-1]))
        return drop_end_poles(select_poles(diagram, self.share), diagram, frf)
