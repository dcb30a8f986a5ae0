"""Least-squares complex frequency-domain poles (LSCF): one common denominator for all responses.

Source: Guillaume, Verboven, Vanlanduit, ISMA 23 (1998); the single-reference case of `plscf`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint.modal_identification.poles.plscf import poles_of_orders
from toolpoint.modal_identification.poles.selection import drop_repeated, select_poles
from toolpoint.modal_identification.poles.start import Start
from toolpoint.modal_identification.residues import fit_participation
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf


@dataclass(frozen=True)
class CommonDenominator:
    """LSCF of all orders with selection across them; cannot part repeated roots. `order` as in `PolyReference`."""

    order: int = 60
    step: int = 2
    share: float = 0.35
    refine: bool = False
    name: str = "LSCF"

    def start(self, frf: Frf) -> Start:
        """Return the poles selected across orders, with participation from their residues."""
        single = as_one_reference(frf)
        diagram = poles_of_orders(single, min(self.order, frf.frequency.size // 3), self.step)
        choice = drop_repeated(select_poles(diagram, self.share))
        if choice.poles.size == 0:
            return Start(choice.poles, np.zeros((len(frf.inputs), 0), complex), diagram, choice.support)
        return Start(choice.poles, fit_participation(frf, choice.poles), diagram, choice.support)


def as_one_reference(frf: Frf) -> Frf:
    """Return all responses as outputs of one nameless reference."""
    outputs = tuple(Dof(i + 1, "+x") for i in range(len(frf.outputs) * len(frf.inputs)))
    return replace(frf, values=frf.values.reshape(frf.frequency.size, -1, 1), outputs=outputs, inputs=(Dof(0, "+x"),),
                   coherence=None, variance=None, draws=None)
