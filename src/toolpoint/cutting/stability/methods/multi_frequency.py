r"""MultiFrequency: the harmonic-balance stability solution with several tooth-passing harmonics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from toolpoint._check import FloatArray, count
from toolpoint.cutting.cut.arc import straight_nodes
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.floquet.method import FloquetDeterminant, chatter_frequency, refusal
from toolpoint.cutting.stability.floquet.records import ArcSet, HillLines
from toolpoint.cutting.stability.method import Problem, require_milling
from toolpoint.cutting.stability.result import StabilityChart, assemble_chart
from toolpoint.cutting.stability.warm_start import WarmStart


@dataclass(frozen=True)
class MultiFrequency:
    r"""Eigenvalues of the truncated Hill matrix :math:`W_{p-q} G(i(\theta/T + q \omega_T))` at fixed theta.

    :math:`\det(I + w (1 - e^{-i\theta}) W)` is a polynomial in w; boundary points are found as by `FloquetDeterminant`, from
    the count of encirclements and refined in theta and w (islands and flips included). Needs the harmonics to reach
    beyond the highest mode; the error falls with the order as the response falls off.

    Parameters
    ----------
    harmonics : int
        Tooth-passing harmonics beyond the highest mode.
    steps : int
        Theta intervals over [0, pi] before refinement.

    Source: Budak, Altintas, J. Dynamic Systems Measurement Control 120 (1998) 22; Merdol, Altintas, J. Manufacturing
    Science Engineering 126 (2004) 459.

    Examples
    --------
    >>> str(MultiFrequency(harmonics=4))
    'MultiFrequency(harmonics=4)'
    """

    name: ClassVar[str] = "multi-frequency"
    needs_modes: ClassVar[bool] = True
    takes_response: ClassVar[bool] = False
    uses_warm: ClassVar[bool] = False
    harmonics: int = 6
    steps: int = 16

    def __post_init__(self) -> None:
        count("MultiFrequency.harmonics", self.harmonics, 0)
        count("MultiFrequency.steps", self.steps, 16)

    def __str__(self) -> str:
        return f"MultiFrequency(harmonics={self.harmonics})"

    def refuses(self, problem: Problem) -> str | None:
        """Return why not: what the determinant refuses, a measured FRF, and a helix."""
        reason = refusal(problem)
        if reason is not None or not isinstance(problem, MillingProblem):
            return reason
        if not problem.plane.is_modal:
            return "a measured FRF; must be modes (use HillDeterminant(): it takes every harmonic in the band)"
        if problem.tool.has_helix:
            return "a helical tool; must have straight teeth (use FloquetDeterminant())"
        return None

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart; see `stability.chart`. It always begins cold."""
        problem = require_milling(self, problem)
        rows, engine = [], FloquetDeterminant(base=self.steps)
        for i, speed in enumerate(speeds):
            plane = problem.plane_at(float(speed))
            lines = hill_set(problem, plane, float(speed), harmonics=self.harmonics)
            points, number, _ = engine.scan(problem, plane, np.array([speed]), sets=(lines, lines), depth_max=depth_max)
            rows += [(i, p["s"] * depth_max, p["theta"], p["change"]) for p in points[0, :number[0]]]
        table = np.array(rows, float).reshape(-1, 4)
        frequency = chatter_frequency(problem, speeds[table[:, 0].astype(int)], table[:, 2])
        note = f"{self.harmonics} harmonics beyond the highest mode: the truncation's own error is not in `error`"
        return assemble_chart(speeds, depth_max, (table[:, 0], table[:, 1], table[:, 2], frequency, table[:, 3],
                                             1e-9 * table[:, 1]), method=str(self), notes=(*problem.notes, note))


def hill_set(problem: MillingProblem, plane: PlaneDynamics, speed: float, *, harmonics: int) -> ArcSet:
    """Return what the kernels need of the truncated Hill matrix, in the form of `floquet.green_set`."""
    from toolpoint.cutting.stability.floquet.kernels import node_address

    period, pitch = float(problem.tooth_period(speed)), 2 * np.pi / problem.tool.teeth
    order_max = int(np.ceil(plane.span[1] * period)) + harmonics
    nodes = straight_nodes(problem.coefficients, problem.engagement, problem.tool.teeth, density=4.0 * order_max, nodes_min=20,
                           second_direction=True, size=plane.size)
    moves_in_y = np.any(plane.residues[:, 1:]) or np.any(plane.static[1:])
    ways = plane.size if moves_in_y else 1
    order = np.arange(-2 * order_max, 2 * order_max + 1)
    wave = np.exp(-2j * np.pi * order[:, None] * nodes.angle / pitch) * nodes.weight / pitch
    fourier = np.einsum("kq,qa,qb->kab", wave, nodes.force[:, :ways], nodes.chip[:, :ways])
    poles = np.stack([plane.poles.real, plane.poles.imag], axis=1).ravel()
    lines = HillLines(poles, np.ascontiguousarray(plane.residues[:, :ways, :ways]), np.ascontiguousarray(fourier))
    empty = np.zeros((plane.poles.size, ways, ways), complex)
    return ArcSet(empty, np.zeros(ways), np.zeros((ways, ways)), np.zeros(ways), plane.static[:ways, :ways].copy(), lines,
                  node_address(hill=True))
