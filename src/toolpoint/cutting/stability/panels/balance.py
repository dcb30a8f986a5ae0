r"""Diagonal balance of the one-period map, for speeds so low that a cut lasts many vibrations.

A cut of many vibrations amplifies along itself (each tooth's waves grow from entry to exit over those of the tooth before), and
the free vibration after it decays by as much: at the stability limit one is the inverse of the other. The map of the plain
vibration is then extremely non-normal: rounding of 1e-16, amplified by the cut, looks like a multiplier of its own, and at a
decay of exp(-37) nothing else is left. With the vibration counted in units that grow along the cut by the decay outside it,
:math:`W^{-1} U W`, :math:`W = \mathrm{diag}(e^{\sigma g(t)})`, the same multipliers belong to a map that is nearly normal. They
do not depend on sigma; what of them does is rounding, which `PanelSearch` adds to the stated error.

Source: Trefethen, Embree, Spectra and Pseudospectra, 2005, chapters 7 and 24 (Volterra-like operators, similarity).
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, FloatArray

MAX_UNBALANCED_DECAY = 3.0  # decay between cuts, as an exponent, below which the map is taken as it is
MAX_BALANCE_EXPONENT = 600.0  # as an exponent: double precision ends at 709


def decay_between_cuts(cutting: Array, border: FloatArray, slowest: float) -> float:
    """Return the exponent by which the least damped mode decays within one period while no edge cuts.

    cutting (p,): panels that cut; border (p + 1,): their ends, s; slowest: the mode's decay, rad/s.
    """
    free = float((border[1:] - border[:-1])[~cutting].sum())
    return min(MAX_BALANCE_EXPONENT, free * slowest)


def balance(cutting: Array, border: FloatArray, time: FloatArray, *, exponent: float, size: int, states: int) -> FloatArray:
    """Return the diagonal of W: for every node (time, s; `size` directions each) and the `states` at the end of the period.

    cutting (p,) : panels that cut; border (p + 1,) : their ends, s; exponent : of the growth over all of the cut.

    It grows by `exponent` over the time in cut, and stays as it is between cuts.
    """
    lengths = np.where(cutting, np.diff(border), 0.0)
    # W grows in cut alone: between cuts the free decay is what the growth is to make up for.
    share = np.concatenate([[0.0], np.cumsum(lengths)]) / max(lengths.sum(), 1e-300)
    nodes = np.exp(exponent * np.interp(time, border, share))
    return np.concatenate([np.repeat(nodes, size), np.full(states, np.exp(exponent))])
