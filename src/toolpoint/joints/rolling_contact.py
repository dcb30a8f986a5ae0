r"""Load and deflection of rolling elements between raceways, and the stiffness at a load.

Palmgren's fits for hardened steel, approach of both raceways together, in mm and N: balls in grooves
:math:`\delta = 4.36 \times 10^{-4} Q^{2/3} / D^{1/3}`, rollers :math:`\delta = 7.68 \times 10^{-5} Q^{0.9} / l^{0.8}`.
Source: Harris, Rolling Bearing Analysis, 4th ed., section 8.6.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, one_of, positive

# p of delta = c Q^p.
LOAD_EXPONENTS = {"ball": 2 / 3, "roller": 0.9}


def compliance_constant(element: str, diameter: float, length: float = 0.0) -> float:
    """Return c of delta = c Q^p, m/N^p: p is 2/3 for balls (diameter, m), 0.9 for rollers (effective length, m)."""
    one_of("element", element, LOAD_EXPONENTS)
    if element == "ball":
        # Palmgren's constant is for millimetres and newtons: the factors of a thousand make it SI.
        return 1e-3 * 4.36e-4 / (1e3 * positive("diameter", diameter)) ** (1 / 3)
    return 1e-3 * 7.68e-5 / (1e3 * positive("length", length)) ** 0.8


def contact_stiffness(element: str, load: float, constant: float) -> float:
    """Return dQ/d delta at a load (N), N/m: Q/(p delta)."""
    exponent = LOAD_EXPONENTS[element]
    return positive("load", load) ** (1 - exponent) / (exponent * constant)


def spring_matrix(place: FloatArray, direction: FloatArray, stiffness: float) -> FloatArray:
    """Return the stiffness (6, 6) about the origin of a spring at a place (m) along a direction: k l l^T, l = (u, p x u)."""
    unit = np.asarray(direction, float) / np.linalg.norm(direction)
    line = np.concatenate([unit, np.cross(place, unit)])
    return stiffness * np.outer(line, line)
