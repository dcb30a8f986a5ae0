"""Error of step and spacing of a run from three levels of each: observed order of convergence, with a factor of safety.

With changes d_1 (from twice the width) and d_2 (from four times to twice it) of one sign, the observed order is
p = log2(d_2 / d_1), and what the finest level still errs by is d_1 / (2^p - 1) (Richardson; Roache, J. Fluids Engineering
116 (1994)). Where the changes disagree in sign or do not fall, no order is seen: then the larger
one counts whole.
"""

from __future__ import annotations

import math

# on an error of an observed order; 1.25 (Roache) was passed by 1 of 28 means beside an independent integrator
ORDER_SAFETY_FACTOR = 1.5
MIN_ORDER, MAX_ORDER = 0.5, 2.0  # believed of observed orders: blends and steps err by the square at best
MIN_STATED_ERROR = 1e-4  # relative error to which runs are held against an independent integrator: less is not stated
LEVEL_ROUNDING = 1e-7  # relative change below which levels differ by rounding


def remaining_error(finest: float, middle: float, coarse: float) -> float:
    """Return the relative error of the finest of three values, widths 1, 2 and 4; not a number where one is missing."""
    if math.isnan(finest + middle + coarse):
        return float("nan")
    if finest == 0:
        return 0.0
    fine_change, coarse_change = (finest - middle) / finest, (middle - coarse) / finest
    if max(abs(fine_change), abs(coarse_change)) < LEVEL_ROUNDING:
        return abs(fine_change)
    ratio = coarse_change / fine_change if fine_change else math.inf
    if ratio < 2**MIN_ORDER:
        return ORDER_SAFETY_FACTOR * max(abs(fine_change), abs(coarse_change))
    # A ratio above that of the highest order may be chance: the far change, fallen twice at that order, is a floor.
    order = min(math.log2(ratio), MAX_ORDER) if math.isfinite(ratio) else MAX_ORDER
    return ORDER_SAFETY_FACTOR * max(abs(fine_change) / (2**order - 1), abs(coarse_change) / 4**MAX_ORDER)
