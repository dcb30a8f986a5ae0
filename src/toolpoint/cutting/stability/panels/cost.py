"""What a speed of PanelArnoldi will cost, before it is begun: very low speeds ask for more nodes than anyone waits for."""

from __future__ import annotations

import numpy as np

from toolpoint._check import fail
from toolpoint.cutting.cut.modal_state import plane_with_static
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.methods.search import mean_period
from toolpoint.cutting.stability.panels.balance import PLAIN
from toolpoint.cutting.stability.panels.search import waves_of

LONGEST = 120.0  # s a speed beyond which nothing is begun
LOOKS = 40  # depths at which multipliers are computed
VECTORS, MOST_VECTORS = 50, 160  # of the Arnoldi basis: usual, and where a cut lasts many vibrations
PANEL = 12  # nodes of a panel
RATE = 1.5e9  # additions and multiplications a second, one core of 2024


def estimate_seconds(problem: MillingProblem, speed: float) -> float:
    """Estimate the time of PanelArnoldi at a speed (rev/min), s, within a factor of about three."""
    plane = plane_with_static(problem, speed)
    tool, size, modes = problem.tool, plane.size, plane.poles.size
    omega, period = 2 * np.pi * speed / 60, mean_period(problem, speed)
    arc = min(omega * period, 2 * problem.engagement.arc * (tool.teeth if not tool.is_regular else 1))
    free = period - problem.engagement.arc / omega
    vectors = MOST_VECTORS if free * float((-plane.poles.real).min()) > 2 * PLAIN else VECTORS
    pieces = (1 + 2 * tool.has_helix) * (1 + 4 * (tool.corner_radius > 0))
    unknowns = waves_of(plane, problem, speed) * arc * size
    each = 3 * vectors + 2 * pieces * PANEL * size + 8 * modes
    return float(LOOKS * vectors * unknowns * each / RATE)


def check_affordable(problem: MillingProblem, speed: float) -> None:
    """Refuse a speed that would take minutes, with the estimate and the remedy."""
    seconds = estimate_seconds(problem, speed)
    if seconds > LONGEST:
        fail("speeds", f"{speed:g} rev/min takes about {seconds / 60:.0f} min (a tooth cuts through "
             f"{plane_with_static(problem).span[1] * mean_period(problem, speed):.0f} vibrations of the highest mode a period)",
             f"must be at most {LONGEST / 60:.0f} min a speed",
             remedy="raise the least speed, leave out the modes far above the chatter band, or use ZeroOrder()")
