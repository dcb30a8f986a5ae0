r"""Motion of a body averaged over its orders: how far it turns and bends is a choice, and belongs to the interval.

Whitened measurements y = D T theta + e over three groups of coefficients: translation (without a prior), and turn, stretch and
bending, each absent or normal about zero with a deviation that is a share of the body's motion, all shares as likely. For every
combination of shares the posterior is normal and its evidence

.. math:: -\tfrac12 \ln |I + S G S / s^2| - \tfrac{1}{2 s^2} (y^T y - y^T D T \hat\theta)

for each of the two columns, with :math:`G = T^T D^T D T`, S the priors' deviations and :math:`s^2 \ge 1` the misfit of the
largest order (no model is quite right). The result is the mixture of them all: mean, and covariance within and between.
Source: Hoeting, Madigan, Raftery, Volinsky, Statistical Science 14 (1999) 382 (model averaging).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from toolpoint._check import FloatArray

ORDERS = ("translation", "rigid", "affine", "quadratic")
# Deviations of a group's coefficients over the body's motion; the first ones of turns, which are as large as translations.
TURNS, STRAINS = (0.03, 0.1, 0.3, 1.0, 3.0), (0.002, 0.006, 0.02, 0.06, 0.2, 0.6)
# Deviation of a translation over the motion: so wide that it does not count.
FREE = 1e3
# Degrees of freedom of the largest order from which its misfit tells the noise.
ENOUGH_FREEDOM = 6
_GROUPS = (0, 0, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3)


def _directions() -> FloatArray:
    """Return the coefficients (12, 12) of two translations, a turn, three strains and six bendings, as columns."""
    whole = np.eye(12)
    strains = [whole[1], whole[8], (whole[2] + whole[7]) / np.sqrt(2)]
    return np.stack([whole[0], whole[6], whole[7] - whole[2], *strains, *whole[[3, 4, 5, 9, 10, 11]]], axis=1)


DIRECTIONS = _directions()


@dataclass(frozen=True, eq=False)
class AveragedMotion:
    """Mean and covariance over the orders.

    order : the likeliest of `ORDERS`; coefficients : (12, 2) whitened real and imaginary part; covariance : (12, 12) of each;
    misfit : chi-squared per degree of freedom; left, power : chi-squared beyond the noise that is left, and that of the motion.
    """

    order: str
    coefficients: FloatArray
    covariance: FloatArray
    misfit: float
    left: float
    power: float


def average_orders(design: FloatArray, seen: FloatArray, orders: tuple[str, ...] = ORDERS) -> AveragedMotion | None:
    """Return the motion averaged over its orders, None where the rows do not determine a translation.

    design : (m, 12) whitened rows over the coefficients; seen : (m, 2) whitened values.
    """
    if len(design) < 2 or np.linalg.matrix_rank(design @ DIRECTIONS[:, :2]) < 2:
        return None
    low, high = (f([ORDERS.index(order) for order in orders]) for f in (min, max))
    turned = design @ DIRECTIONS
    gram, moment, power = turned.T @ turned, turned.T @ seen, float((seen**2).sum())
    size = _motion(design, seen)
    noise = _noise(turned, seen, high)
    shares = _shares(low, high)
    spread = np.array(shares)[:, _GROUPS] * size  # (k, 12)
    scaled = spread[:, :, None] * gram * spread[:, None, :] / noise
    inner = np.eye(12) + scaled
    inverse = np.linalg.inv(inner)
    each = spread[:, :, None] * inverse * spread[:, None, :] / noise
    theta = each @ moment
    left = power - np.einsum("ij,kij->k", moment, theta)
    evidence = -np.linalg.slogdet(inner)[1] - left / (2 * noise)
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    mean = np.einsum("k,kij->ij", weight, theta)
    apart = theta - mean
    # Both columns have one covariance: what the orders differ by is halved between them.
    covariance = np.einsum("k,kij->ij", weight, each * noise) + np.einsum("k,kic,kjc->ij", weight, apart, apart) / 2
    used = float(np.einsum("k,kii->", weight, np.eye(12) - inverse))
    misfit, freedom = float(((seen - turned @ mean) ** 2).sum()), max(2 * (len(seen) - used), 1.0)
    return AveragedMotion(_likeliest(shares, weight), DIRECTIONS @ mean, DIRECTIONS @ covariance @ DIRECTIONS.T,
                          misfit / freedom, max(0.0, misfit - freedom), max(power, 1e-300))


def _motion(design: FloatArray, seen: FloatArray) -> float:
    """Return the motion's size (pixels, whitened): the root mean square that stands out of the noise, at least the noise."""
    weight = (design[:, [0, 6]] ** 2).sum()
    return float(np.sqrt(max((seen**2).sum() - seen.size, 2.0) / weight))


def _noise(turned: FloatArray, seen: FloatArray, high: int) -> float:
    """Return the misfit per degree of freedom of the largest order, at least one."""
    at = [k for k, group in enumerate(_GROUPS) if group <= high]
    solution, _, rank, _ = np.linalg.lstsq(turned[:, at], seen, rcond=1e-9)
    freedom = 2 * (len(seen) - int(rank))
    if freedom < ENOUGH_FREEDOM:
        return 1.0
    return max(1.0, float(((seen - turned[:, at] @ solution) ** 2).sum()) / freedom)


def _shares(low: int, high: int) -> list[tuple[float, ...]]:
    """Return the deviations of the four groups over the motion, of every combination."""
    groups = []
    for group, values in enumerate((TURNS, STRAINS, STRAINS), start=1):
        groups.append((0.0,) if group > high else values if group <= low else (0.0, *values))
    return [(FREE, *parts) for parts in product(*groups)]


def _likeliest(shares: list[tuple[float, ...]], weight: FloatArray) -> str:
    """Return the highest order that the data make likelier than it was: its shares against its absence are as many to one."""
    there = [k for k, values in ((1, TURNS), (2, STRAINS), (3, STRAINS))
             if float(weight[[row[k] > 0 for row in shares]].sum()) > len(values) / (len(values) + 1)]
    return ORDERS[max(there, default=0)]
