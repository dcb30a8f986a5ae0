"""Cost of a speed of PanelArnoldi, estimated before it begins: very low speeds need too many nodes."""

from __future__ import annotations

import numpy as np

from toolpoint._check import fail
from toolpoint.cutting.cut.modal_state import plane_with_static
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.methods.search import mean_period
from toolpoint.cutting.stability.panels.balance import MAX_UNBALANCED_DECAY
from toolpoint.cutting.stability.panels.search import MAX_BASIS_SIZE, waves_of

MAX_SECONDS_PER_SPEED = 120.0  # s a speed beyond which nothing is begun
DEPTHS_PER_SPEED = 40  # depths at which multipliers are computed
USUAL_BASIS_SIZE = 50  # vectors of the Arnoldi basis; `MAX_BASIS_SIZE` where a cut lasts many vibrations
PANEL_NODE_COUNT = 12  # nodes of a panel
OPERATION_RATE = 1.5e9  # additions and multiplications a second, one core of 2024


def estimate_seconds(problem: MillingProblem, speed: float) -> float:
    """Estimate the time of PanelArnoldi at a speed (rev/min), s, within a factor of about three."""
    plane = plane_with_static(problem, speed)
    tool, size, modes = problem.tool, plane.size, plane.poles.size
    omega, period = 2 * np.pi * speed / 60, mean_period(problem, speed)
    arc = min(omega * period, 2 * problem.engagement.arc * (tool.teeth if not tool.is_regular else 1))
    free = period - problem.engagement.arc / omega
    vectors = MAX_BASIS_SIZE if free * float((-plane.poles.real).min()) > 2 * MAX_UNBALANCED_DECAY else USUAL_BASIS_SIZE
    pieces = (1 + 2 * tool.has_helix) * (1 + 4 * (tool.corner_radius > 0))
    unknowns = waves_of(plane, problem, speed) * arc * size
    # A vector costs each unknown: Gram-Schmidt against the vectors before it, the delayed vibration and the panel's inverse
    # by pieces of the edge, and the modes' state.
    each = 3 * vectors + 2 * pieces * PANEL_NODE_COUNT * size + 8 * modes
    return float(DEPTHS_PER_SPEED * vectors * unknowns * each / OPERATION_RATE)


def check_affordable(problem: MillingProblem, speed: float) -> None:
    """Refuse a speed that would take minutes, with the estimate and the remedy."""
    seconds = estimate_seconds(problem, speed)
    if seconds > MAX_SECONDS_PER_SPEED:
        fail("speeds", f"{speed:g} rev/min takes about {seconds / 60:.0f} min (a tooth cuts through "
             f"{plane_with_static(problem).span[1] * mean_period(problem, speed):.0f} vibrations of the highest mode a period)",
             f"must be at most {MAX_SECONDS_PER_SPEED / 60:.0f} min a speed",
             remedy="raise the least speed, leave out the modes far above the chatter band, or use ZeroOrder()")
