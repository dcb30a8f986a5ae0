r"""Motion of a body averaged over its orders: how far it turns and bends is uncertain, and widens the interval.

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
TURN_DEVIATIONS, STRAIN_DEVIATIONS = (0.03, 0.1, 0.3, 1.0, 3.0), (0.002, 0.006, 0.02, 0.06, 0.2, 0.6)
# Deviation of a translation over the motion: so wide that it does not count.
TRANSLATION_DEVIATION = 1e3
# Degrees of freedom of the largest order from which its misfit tells the noise.
MIN_MISFIT_FREEDOM = 6
_COEFFICIENT_GROUPS = (0, 0, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3)


def _directions() -> FloatArray:
    """Return the coefficients (12, 12) of two translations, a turn, three strains and six bendings, as columns."""
    unit = np.eye(12)
    strains = [unit[1], unit[8], (unit[2] + unit[7]) / np.sqrt(2)]
    return np.stack([unit[0], unit[6], unit[7] - unit[2], *strains, *unit[[3, 4, 5, 9, 10, 11]]], axis=1)


DIRECTIONS = _directions()


@dataclass(frozen=True, eq=False)
class AveragedMotion:
    """Mean and covariance over the orders.

    order : the likeliest of `ORDERS`; coefficients : (12, 2) whitened real and imaginary part; covariance : (12, 12) of each;
    misfit : chi-squared per degree of freedom; residual_power, power : chi-squared beyond the noise that is left, and that of
    the motion.
    """

    order: str
    coefficients: FloatArray
    covariance: FloatArray
    misfit: float
    residual_power: float
    power: float


def average_orders(design: FloatArray, values: FloatArray, orders: tuple[str, ...] = ORDERS) -> AveragedMotion | None:
    """Return the motion averaged over its orders, None where the rows do not determine a translation.

    design : (m, 12) whitened rows over the coefficients; values : (m, 2) whitened measurements.
    """
    if len(design) < 2 or np.linalg.matrix_rank(design @ DIRECTIONS[:, :2]) < 2:
        return None
    min_order, max_order = (f([ORDERS.index(order) for order in orders]) for f in (min, max))
    rotated_design = design @ DIRECTIONS
    gram, moment, power = rotated_design.T @ rotated_design, rotated_design.T @ values, float((values**2).sum())
    motion_size = _motion_size(design, values)
    noise = _misfit_of_largest_order(rotated_design, values, max_order)
    shares = _shares(min_order, max_order)
    spread = np.array(shares)[:, _COEFFICIENT_GROUPS] * motion_size  # (k, 12)
    scaled = spread[:, :, None] * gram * spread[:, None, :] / noise
    scaled_gram = np.eye(12) + scaled
    inverse = np.linalg.inv(scaled_gram)
    posterior_covariance = spread[:, :, None] * inverse * spread[:, None, :] / noise
    theta = posterior_covariance @ moment
    residual_power = power - np.einsum("ij,kij->k", moment, theta)
    evidence = -np.linalg.slogdet(scaled_gram)[1] - residual_power / (2 * noise)
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    mean = np.einsum("k,kij->ij", weight, theta)
    deviation = theta - mean
    # Both columns have one covariance: what the orders differ by is halved between them.
    covariance = np.einsum("k,kij->ij", weight,
                           posterior_covariance * noise) + np.einsum("k,kic,kjc->ij", weight, deviation, deviation) / 2
    effective_parameters = float(np.einsum("k,kii->", weight, np.eye(12) - inverse))
    misfit, freedom = float(((values - rotated_design @ mean) ** 2).sum()), max(2 * (len(values) - effective_parameters), 1.0)
    return AveragedMotion(_likeliest(shares, weight), DIRECTIONS @ mean, DIRECTIONS @ covariance @ DIRECTIONS.T,
                          misfit / freedom, max(0.0, misfit - freedom), max(power, 1e-300))


def _motion_size(design: FloatArray, values: FloatArray) -> float:
    """Return the size of the motion (pixels, whitened): root mean square above the noise, at least the noise."""
    weight = (design[:, [0, 6]] ** 2).sum()
    return float(np.sqrt(max((values**2).sum() - values.size, 2.0) / weight))


def _misfit_of_largest_order(rotated_design: FloatArray, values: FloatArray, max_order: int) -> float:
    """Return the misfit per degree of freedom of the largest order, at least one."""
    columns = [k for k, group in enumerate(_COEFFICIENT_GROUPS) if group <= max_order]
    solution, _, rank, _ = np.linalg.lstsq(rotated_design[:, columns], values, rcond=1e-9)
    freedom = 2 * (len(values) - int(rank))
    if freedom < MIN_MISFIT_FREEDOM:
        return 1.0
    return max(1.0, float(((values - rotated_design[:, columns] @ solution) ** 2).sum()) / freedom)


def _shares(min_order: int, max_order: int) -> list[tuple[float, ...]]:
    """Return the deviations of the four groups over the motion, of every combination."""
    groups = []
    for group, values in enumerate((TURN_DEVIATIONS, STRAIN_DEVIATIONS, STRAIN_DEVIATIONS), start=1):
        groups.append((0.0,) if group > max_order else values if group <= min_order else (0.0, *values))
    return [(TRANSLATION_DEVIATION, *parts) for parts in product(*groups)]


def _likeliest(shares: list[tuple[float, ...]], weight: FloatArray) -> str:
    """Return the highest order that the data make likelier than it was: its shares against its absence are as many to one."""
    likely_groups = [k for k, values in ((1, TURN_DEVIATIONS), (2, STRAIN_DEVIATIONS), (3, STRAIN_DEVIATIONS))
                     if float(weight[[row[k] > 0 for row in shares]].sum()) > len(values) / (len(values) + 1)]
    return ORDERS[max(likely_groups, default=0)]
