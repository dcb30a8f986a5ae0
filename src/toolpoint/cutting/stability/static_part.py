r"""Limit of the static part of a response (upper residual): the depth at which it would chatter by itself.

With :math:`r = G_u F` alone the cut is :math:`F(t) = -w A(t) G_u (F(t) - F(t - \tau))`: no differential equation but a
difference equation at every angle, whose multipliers are :math:`w \lambda/(1 + w \lambda)` with the eigenvalues of
:math:`G_u A(t)`. They are within the unit circle while :math:`w \operatorname{Re} \lambda > -1/2`; beyond, infinitely many
leave it at once, at -1 (the essential spectrum of a neutral equation). The modes that the static part stands for have inertia
and do not: no depth beyond has a limit that could be computed, and all of it is taken as unstable.

Source: Hale, Verduyn Lunel, Introduction to Functional Differential Equations, 1993, chapter 9 (neutral equations).
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.coefficients import edge_matrix
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart

ANGLES_PER_PITCH = 720  # of a pitch
STATIC_ROUNDING = 1e-9


def limit_static_part(problem: MillingProblem) -> float:
    """Return the depth (m) from which the static part alone is unstable, infinite where there is none.

    Straight edges: that depth, to the spacing of the angles. Helix, corner and ball: not more than it, for the sum along an
    edge is bounded by its steepest part.
    """
    plane = problem.plane
    size = float(np.abs(plane.static).max(initial=0.0)) if plane.is_modal else 0.0
    if size == 0:
        return float("inf")
    lowest = float(_eigenvalues(problem).min())
    steepest = size * float(np.linalg.norm(problem.coefficients.cutting))
    return -0.5 / lowest if lowest < -STATIC_ROUNDING * steepest else float("inf")


def _eigenvalues(problem: MillingProblem) -> FloatArray:
    """Return the least real part of the eigenvalues of G_u A at angles over one pitch; a lower bound where edges are not
    straight."""
    tool, arc, static = problem.tool, problem.engagement, problem.plane.static
    d = problem.plane.size
    start = np.concatenate([[0.0], np.cumsum(tool.pitch)[:-1]])
    angle = np.linspace(arc.entry, arc.exit, ANGLES_PER_PITCH)
    # Rounding must not wrap an edge at its very entry by a whole turn.
    phi = (angle[:, None] - start + 1e-12) % (2 * np.pi)
    inside = (phi >= arc.entry - 1e-9) & (phi <= arc.exit + 1e-9)
    matrix = edge_matrix(problem.coefficients, phi)[..., :d, :d]
    if not tool.has_helix and tool.corner_radius == 0:
        total = np.einsum("nj,njab->nab", inside, matrix)
        return np.asarray(np.linalg.eigvals(static @ total).real.min(axis=-1))
    values, vectors = np.linalg.eigh((static + static.T) / 2)
    together = max(int(inside.sum(axis=1).max()), 1) * (np.pi / 2 if tool.corner_radius > 0 else 1.0)
    if values.min() < -1e-9 * np.abs(values).max() or not np.allclose(static, static.T, atol=1e-6 * np.abs(static).max()):
        return np.array([-together * np.linalg.norm(static, 2) * np.linalg.norm(problem.coefficients.cutting)])
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    kappa = np.linspace(0.0, np.pi / 2, 30)[:, None, None] if tool.corner_radius > 0 else np.pi / 2
    part = root @ edge_matrix(problem.coefficients, phi, kappa)[..., :d, :d] @ root
    return together * np.linalg.eigvalsh((part + np.swapaxes(part, -1, -2)) / 2)[..., 0].ravel()


def end_at(chart: StabilityChart, problem: MillingProblem, limit: float, *, depth_max: float) -> StabilityChart:
    """Return a chart made up to the limit of the static part, continued to `depth_max` as unstable, with the reason."""
    speeds = chart.speeds
    flip = np.pi * np.ones(speeds.size)
    last = (np.arange(speeds.size), np.full(speeds.size, limit), flip, 0.5 / problem.tooth_period(speeds),
            np.full(speeds.size, 2), np.zeros(speeds.size))
    columns = [np.concatenate([getattr(chart, name), added]) for name, added in
               zip(("index", "depth", "theta", "frequency", "change", "error"), last, strict=True)]
    reason = (f"deeper than {1e3 * limit:.4g} mm the static part of the response (modes above the band) would chatter by "
              "itself: taken as unstable there; keep more modes to look deeper")
    search = reason if chart.search == "complete" else f"{chart.search}; {reason}"
    return assemble_chart(speeds, depth_max, columns, unstable_at_zero=chart.unstable_at_zero, method=chart.method,
                          notes=chart.notes, search=search)
