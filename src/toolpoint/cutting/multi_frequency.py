r"""MultiFrequency: the harmonic-balance stability solution with several tooth-passing harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, count, fail
from toolpoint.cutting.arc import straight_nodes
from toolpoint.cutting.chart import StabilityChart, assembled
from toolpoint.cutting.floquet import chatter_frequency, checked
from toolpoint.cutting.plane import PlaneDynamics
from toolpoint.cutting.problem import MillingProblem, TurningProblem


@dataclass(frozen=True)
class MultiFrequency:
    r"""Eigenvalues of the truncated Hill matrix :math:`W_{p-q} G(i(\theta/T + q \omega_T))` at fixed theta.

    The eigenproblem is linear in 1/w; depths are where an eigenvalue locus crosses the positive real axis. Needs the
    harmonics to reach beyond the highest mode; the error falls with the order as the response falls off.

    Parameters
    ----------
    harmonics : int
        Tooth-passing harmonics beyond the highest mode.
    steps : int
        Theta values over [0, pi] before refinement at the poles.

    Source: Budak, Altintas, J. Dynamic Systems Measurement Control 120 (1998) 22; Merdol, Altintas, J. Manufacturing
    Science Engineering 126 (2004) 459.
    """

    harmonics: int = 6
    steps: int = 120

    def __post_init__(self) -> None:
        count("MultiFrequency.harmonics", self.harmonics, 0)
        count("MultiFrequency.steps", self.steps, 16)

    def __str__(self) -> str:
        return f"MultiFrequency(harmonics={self.harmonics})"

    def solve(self, problem: MillingProblem | TurningProblem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart; see `stability.chart`."""
        checked(problem)
        assert isinstance(problem, MillingProblem)
        if problem.tool.has_helix:
            fail("problem", "a helical tool", "must have straight teeth", "use FloquetDeterminant()")
        rows = []
        for i, speed in enumerate(speeds):
            hill = Hill(problem, problem.plane_at(float(speed)), float(speed), self.harmonics)
            rows += [(i, w, t, s) for w, t, s in _boundaries(hill, hill.thetas(self.steps), depth_max)]
        table = np.array(rows, float).reshape(-1, 4)
        frequency = chatter_frequency(problem, speeds[table[:, 0].astype(int)], table[:, 2])
        note = f"{self.harmonics} harmonics beyond the highest mode: the truncation's own error is not in `error`"
        return assembled(speeds, depth_max, (table[:, 0], table[:, 1], table[:, 2], frequency, table[:, 3],
                                             1e-9 * table[:, 1]), method=str(self), notes=(*problem.notes, note))


class Hill:
    """The truncated Hill matrix of one speed."""

    def __init__(self, problem: MillingProblem, plane: PlaneDynamics, speed: float, harmonics: int) -> None:
        self.period, self.plane = float(problem.tooth_period(speed)), plane
        self.top = int(np.ceil(plane.span[1] * self.period)) + harmonics
        nodes = straight_nodes(problem.coefficients, problem.engagement, problem.tool.teeth, 2.0 * self.top * 2, 20, True)
        pitch = 2 * np.pi / problem.tool.teeth
        order = np.arange(-2 * self.top, 2 * self.top + 1)
        wave = np.exp(-2j * np.pi * order[:, None] * nodes.angle / pitch) * nodes.weight / pitch
        fourier = np.einsum("kq,qa,qb->kab", wave, nodes.force, nodes.chip)
        q = np.arange(2 * self.top + 1)
        self.toeplitz = fourier[q[:, None] - q[None, :] + 2 * self.top]

    def thetas(self, steps: int) -> FloatArray:
        """Theta values, denser near those of the poles."""
        even = np.linspace(1e-4, np.pi, steps)
        if not self.plane.is_modal:
            return even
        centre, half = self.plane.poles.imag * self.period, -self.plane.poles.real * self.period
        near = (centre[:, None] + half[:, None] * np.array([-4, -2, -1, -0.5, 0, 0.5, 1, 2, 4])).ravel() % (2 * np.pi)
        return np.unique(np.concatenate([even, np.where(near > np.pi, 2 * np.pi - near, near)]))

    def eigenvalues(self, theta: FloatArray) -> ComplexArray:
        """Eigenvalues kappa of -(1 - nu) W G: 1/w on the boundary, shape (n_theta, 2 (2 top + 1))."""
        q = np.arange(-self.top, self.top + 1)
        f = (theta[:, None] / (2 * np.pi) + q) / self.period
        g = self.plane.response(np.abs(f))
        g = np.where((f < 0)[..., None, None], g.conj(), g)
        matrix = np.einsum("pqab,tqbc->tpaqc", self.toeplitz, g)
        size = 2 * q.size
        scale = -(1 - np.exp(-1j * theta))[:, None, None]
        return np.linalg.eigvals(scale * matrix.reshape(theta.size, size, size))


def _boundaries(hill: Hill, thetas: FloatArray, depth_max: float) -> list[tuple[float, float, int]]:
    values = hill.eigenvalues(thetas)
    rows = []
    for i in range(thetas.size - 1):
        large = values[i][np.abs(values[i]) > 0.3 / depth_max]
        for a in large:
            b = values[i + 1][np.argmin(np.abs(values[i + 1] - a))]
            at_end = i == thetas.size - 2 and abs(b.imag) < 1e-7 * abs(b)
            if a.imag * b.imag < 0 and max(a.real, b.real) > 0 and not at_end:
                rows += _crossing(hill, (thetas[i], thetas[i + 1]), (a, b), depth_max)
    flips = values[-1][np.abs(values[-1].imag) < 1e-7 * np.abs(values[-1])].real
    rows += [(float(1 / v), np.pi, 1) for v in flips[flips > 1 / depth_max]]
    return rows


def _crossing(hill: Hill, t: tuple[float, float], v: tuple[complex, complex],
              depth_max: float) -> list[tuple[float, float, int]]:
    (t0, t1), (v0, v1) = t, v
    for _ in range(40):
        new = float(np.clip(t1 - v1.imag * (t1 - t0) / (v1.imag - v0.imag), min(t0, t1), max(t0, t1)))
        every = hill.eigenvalues(np.array([new]))[0]
        guess = v0 + (v1 - v0) * (new - t0) / (t1 - t0)
        at = every[np.argmin(np.abs(every - guess))]
        if np.sign(at.imag) != np.sign(v1.imag):
            t0, v0 = t1, v1
        t1, v1 = new, at
        if abs(v1.imag) < 1e-12 * abs(v1) or t1 == t0:
            break
    if v1.real <= 1 / depth_max or abs(v1.imag) > 1e-6 * abs(v1):
        return []
    return [(1 / v1.real, t1, -2 if (v[1].imag - v[0].imag) > 0 else 2)]
