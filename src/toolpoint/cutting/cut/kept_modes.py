r"""Modes of a cut that may count by their static part alone: those that cannot chatter by themselves at any speed.

The force of a cut w deep on a vibration r is :math:`-w A(t) (r(t) - r(t - \tau))`, at most :math:`2 w |A|` times it,
whatever the speed. Modes left out answer with :math:`\Delta G`, their response less its static part; where
:math:`2 w |A| \sup_\omega |\Delta G(i \omega)| < 1` they are stable by themselves (small gain), and what they change of a
limit is of the order of that number where a harmonic of the cut meets their resonance, far below it elsewhere.
Source: Desoer, Vidyasagar, Feedback Systems: Input-Output Properties, 1975, chapter III (small gain).
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, positive
from toolpoint.cutting.cut.problem import MillingProblem

MAX_LEFT_OUT_GAIN = 0.5  # largest gain of the modes that go
MIN_KEPT_MODES = 12  # modes up to which none goes: little would be won
RESONANCE_OFFSETS = np.array([-3.0, -1.0, -0.4, 0.0, 0.4, 1.0, 3.0])  # lines beside a resonance, in half widths


def find_least_frequency(problem: MillingProblem, depth: float) -> tuple[float, float]:
    """Return the frequency (Hz) above which modes may count by their static part in cuts up to `depth` (m), and their gain.

    Infinite, with gain 0, where all are needed, and with process damping, whose force follows the velocity; the problem must
    be one of modes.

    Raises ToolpointError for a depth that is not above zero.
    """
    plane = problem.plane
    order = np.argsort(np.abs(plane.poles))
    if order.size <= MIN_KEPT_MODES or problem.process_damping > 0:
        return float("inf"), 0.0
    gains = 2 * positive("depth", depth) * steepest_force(problem) * _tail_norms(problem, order)
    free = np.flatnonzero(gains < MAX_LEFT_OUT_GAIN)  # how many modes stay; gains[k]: of those from the k-th on
    kept_count = max(int(free[0]), MIN_KEPT_MODES) if free.size else order.size
    while kept_count < order.size and gains[kept_count] >= MAX_LEFT_OUT_GAIN:
        kept_count += 1
    if kept_count >= order.size:
        return float("inf"), 0.0
    size = np.abs(plane.poles[order]) / (2 * np.pi)
    return float(np.sqrt(size[kept_count - 1] * size[kept_count])), float(gains[kept_count])


def steepest_force(problem: MillingProblem) -> float:
    """Return a bound of the norm of the directional matrix per depth, Pa: at every height as many teeth as fit into the arc,
    each at its steepest; along a corner or ball the edge is longer than its depth by half pi at most."""
    tool = problem.tool
    together = int(np.ceil(problem.engagement.arc / float(np.min(tool.pitch)) - 1e-9))
    longer = np.pi / 2 if tool.corner_radius > 0 else 1.0
    return float(longer * min(max(together, 1), tool.teeth) * np.linalg.norm(problem.coefficients.cutting))


def _tail_norms(problem: MillingProblem, order: np.ndarray) -> FloatArray:
    """Return the largest norm of the response, less its static part, of the modes from the k-th on, m/N, for every k."""
    plane = problem.plane
    poles, residues = plane.poles[order], plane.residues[order]
    lines = (np.abs(poles)[:, None] + np.abs(poles.real)[:, None] * RESONANCE_OFFSETS).ravel()
    s = 1j * np.unique(lines[lines > 0])[:, None]
    first, second = 1 / (s - poles) + 1 / poles, 1 / (s - poles.conj()) + 1 / poles.conj()
    each = first[..., None, None] * residues + second[..., None, None] * residues.conj()
    tails = np.cumsum(each[:, ::-1], axis=1)[:, ::-1]
    return np.asarray(np.linalg.norm(tails, ord=2, axis=(2, 3)).max(axis=0))
