r"""Answers at the tool point with their exact slopes to every change, for `improve`.

With :math:`Z = K + iD + i\omega C - \omega^2 M` and :math:`G = B^T Z^{-1} B` the slope to a change is
:math:`G' = -(Z^{-1}B)^T Z' (Z^{-1}B)`; at the frequency where an answer is worst its own slope is that of the response there
alone (envelope). Machines with a modal damping ratio have D = 2 zeta K here: the same at every resonance, and affine in the
changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.cutting.build import coefficients_of, engagement_of, tool_of
from toolpoint.cutting.cut.coefficients import mean_matrix
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.accuracy.cutting_table import cutting_problem, cutting_table
from toolpoint.vibration.eigen import mass_normalised

_FORCE_HARMONICS = 16  # of the tooth passing, in the force of a periodic cut
_MIN_CANDIDATE_RATIO = 0.4  # of the worst value: smaller peaks are no candidates
# Dense at the resonance and ever wider away from it, so that forty lines hold a peak and its flanks.
_WIDTHS = np.sinh(np.linspace(-4, 4, 41)) / 6


@dataclass(frozen=True, eq=False)
class TipSystem:
    """Matrices at a pose seen along the tool's x, y, z: mass, damping, loss, stiffness (n, n), map (n, 3)."""

    mass: FloatArray
    damping: FloatArray
    loss: FloatArray
    stiffness: FloatArray
    tip: FloatArray

    def dynamic(self, omega: FloatArray) -> ComplexArray:
        """Return Z at circular frequencies, (f, n, n)."""
        w = np.asarray(omega)[:, None, None]
        return self.stiffness + 1j * self.loss * (w != 0) + 1j * w * self.damping - w**2 * self.mass

    def motion(self, omega: FloatArray) -> ComplexArray:
        """Return Z^-1 B at circular frequencies, (f, n, 3)."""
        dynamic = self.dynamic(omega)
        return np.asarray(np.linalg.solve(dynamic, np.broadcast_to(self.tip.astype(complex), (len(dynamic), *self.tip.shape))))

    def lines(self) -> FloatArray:
        """Return circular frequencies, dense around every resonance (no damping ratio below 0.1 per cent is resolved)."""
        squares, vectors = mass_normalised(self.mass, self.stiffness)
        omega = np.sqrt(np.maximum(squares, 1e-12))
        ratio = 0.5 * np.einsum("ir,ij,jr->r", vectors, self.damping, vectors) / omega + 0.5 * np.einsum(
            "ir,ij,jr->r", vectors, self.loss, vectors) / omega**2
        # Lines are spaced by the half-power width: no peak lies between two of them unseen.
        resonance_lines = omega[:, None] * (1 + np.maximum(ratio, 1e-3)[:, None] * _WIDTHS)
        return np.unique(np.concatenate([np.geomspace(omega[0] / 3, 1.5 * omega[min(len(omega) - 1, 17)], 300),
                                         resonance_lines[resonance_lines > 0].ravel()]))


class Answer(Protocol):
    """Number of the tool point; larger is better where `rises`.

    It is the worst of several (peaks, directions). All that are near it count, for a change that helps the worst alone soon
    meets the next.
    """

    @property
    def name(self) -> str:
        """Name of the answer."""
        ...

    @property
    def unit(self) -> str:
        """Unit of the answer."""
        ...

    @property
    def rises(self) -> bool:
        """Whether larger is better."""
        ...

    def evaluate(self, system: TipSystem, slopes: TipSystem | None) -> tuple[FloatArray, FloatArray]:
        """Return the candidates (m,), and their slopes to all changes (m, n_p).

        slopes : arrays with a leading axis of changes; None for candidates alone, whose slopes are empty.
        """
        ...


def response_slopes(system: TipSystem, slopes: TipSystem, omega: FloatArray) -> ComplexArray:
    """Return dG/dp at circular frequencies, (f, n_p, 3, 3)."""
    x = system.motion(omega)
    w = np.asarray(omega)[:, None, None, None]
    # Structural damping does not act at rest.
    change = slopes.stiffness + 1j * slopes.loss * (w != 0) + 1j * w * slopes.damping - w**2 * slopes.mass
    return np.asarray(-np.einsum("fia,fpij,fjb->fpab", x, change, x))


def _peaks(score: Callable[[FloatArray], FloatArray], omega: FloatArray) -> FloatArray:
    """Return the frequencies of the local maxima of a score that are not far below the largest, refined."""
    rough = score(omega)
    maxima = np.flatnonzero((rough[1:-1] >= rough[:-2]) & (rough[1:-1] > rough[2:])) + 1
    candidates = maxima[rough[maxima] > _MIN_CANDIDATE_RATIO * rough.max()]
    # A score that has its maximum at an end has no inner one.
    candidates = candidates if candidates.size else np.array([int(rough.argmax())])
    result = []
    for k in candidates:
        lower, upper = float(omega[max(k - 1, 0)]), float(omega[min(k + 1, len(omega) - 1)])
        # Each round narrows the interval eightfold about the best of 17 lines.
        for _ in range(6):
            fine = np.linspace(lower, upper, 17)
            best = int(score(fine).argmax())
            lower, upper = float(fine[max(best - 1, 0)]), float(fine[min(best + 1, 16)])
        result.append((lower + upper) / 2)
    return np.array(result)


@dataclass(frozen=True)
class ResponsePeak:
    """Largest response of the tip to a unit force of any direction over all frequencies, m/N; `static`: at rest alone.

    Examples
    --------
    >>> ResponsePeak(static=True).name
    'static compliance'
    """

    static: bool = False
    unit: str = "m/N"
    rises: bool = False

    @property
    def name(self) -> str:
        """Name of the answer."""
        return "static compliance" if self.static else "response peak"

    def evaluate(self, system: TipSystem, slopes: TipSystem | None) -> tuple[FloatArray, FloatArray]:
        """See `Answer.evaluate`."""
        def size(omega: FloatArray) -> FloatArray:
            return np.asarray(np.linalg.norm(system.tip.T @ system.motion(omega), 2, axis=(1, 2)))

        omega = np.zeros(1) if self.static else _peaks(size, system.lines())
        u, s, vh = np.linalg.svd(system.tip.T @ system.motion(omega))
        candidates = np.flatnonzero(s.ravel() > _MIN_CANDIDATE_RATIO * s.max())
        if slopes is None:
            return s.ravel()[candidates], np.zeros((0, 0))
        change = response_slopes(system, slopes, omega)
        return s.ravel()[candidates], np.real(np.einsum("fak,fpab,fkb->fkp", u.conj(), change,
                                                        vh.conj())).reshape(s.size, -1)[candidates]


@dataclass(frozen=True)
class DepthLimit:
    """Lowest stable depth over all speeds by the mean directional matrix (zero order), m.

    Examples
    --------
    >>> from toolpoint.studies.cuts.described_cut import cut_on
    >>> DepthLimit(cut_on(None, {})[0]).rises  # a larger depth is better
    True
    """

    cut: CuttingDescription
    name: str = "depth limit"
    unit: str = "m"
    rises: bool = True

    def evaluate(self, system: TipSystem, slopes: TipSystem | None) -> tuple[FloatArray, FloatArray]:
        """See `Answer.evaluate`: with eigenvalues l of A G the limit is -1/(2 min Re l)."""
        arc = engagement_of(self.cut)
        mean = mean_matrix(coefficients_of(self.cut), arc.entry, arc.exit, teeth=tool_of(self.cut).teeth)
        def score(omega: FloatArray) -> FloatArray:
            oriented = mean @ (system.tip.T @ system.motion(omega))[:, :2, :2]
            return np.asarray(-np.linalg.eigvals(oriented).real.min(axis=1))

        omega = _peaks(score, system.lines())
        oriented = mean @ (system.tip.T @ system.motion(omega))[:, :2, :2]
        values, right = np.linalg.eig(oriented)
        rows, k = np.arange(len(omega)), values.real.argmin(axis=1)
        least_real = values[rows, k].real
        if least_real.min() >= 0:
            fail("depth limit", "none: the cut is stable at any depth", "must have a limit to be improved")
        keep = least_real < 0
        limit = -1 / (2 * least_real[keep])
        if slopes is None:
            return limit, np.zeros((0, 0))
        # Rows of the inverse are left eigenvectors of unit product with the right ones.
        left = np.linalg.inv(right)[rows, k]
        change = mean @ response_slopes(system, slopes, omega)[:, :, :2, :2]
        rate = np.einsum("fa,fpab,fb->fp", left, change, right[rows, :, k]).real
        return limit, rate[keep] / (2 * least_real[keep] ** 2)[:, None]


@dataclass(frozen=True)
class PeriodicError:
    """Mean radius of the position sphere of a periodic cut at a pose, m.

    Equations 21, 23 and 26 of the source, in closed form.

    Examples
    --------
    >>> from toolpoint.studies.cuts.described_cut import cut_on
    >>> PeriodicError(cut_on(None, {})[0], speed=6000.0, depth=2e-3).unit
    'm'
    """

    cut: CuttingDescription
    speed: float
    depth: float
    name: str = "position error"
    unit: str = "m"
    rises: bool = False

    def evaluate(self, system: TipSystem, slopes: TipSystem | None) -> tuple[FloatArray, FloatArray]:
        """See `Answer.evaluate`."""
        if self.cut.feed_per_tooth <= 0:
            fail("cut.feed_per_tooth", "0", "must be above zero", remedy="the error hangs on the chip")
        table = cutting_table(cutting_problem(self.cut), speed=self.speed, depth=self.depth,
                              largest_feed=self.cut.feed_per_tooth,
                              steps=256)
        force = np.fft.rfft(table.table[-1], axis=0)[:_FORCE_HARMONICS * tool_of(self.cut).teeth + 1] / len(table.table[-1])
        lines = np.flatnonzero(np.abs(force).max(axis=1) > 1e-9 * np.abs(force).max())
        # The mean deflection is no error: it is taken out.
        lines = lines[lines > 0]
        omega = 2 * np.pi * self.speed / 60 * lines
        turn = np.exp(1j * np.outer(np.arange(512) * 2 * np.pi / 512, lines))
        error = 2 * np.real(turn @ np.einsum("fab,fb->fa", system.tip.T @ system.motion(omega), force[lines]))
        radius = np.linalg.norm(error, axis=1)
        if slopes is None:
            return np.array([radius.mean()]), np.zeros((0, 0))
        change = 2 * np.real(np.einsum("tf,fpab,fb->tpa", turn, response_slopes(system, slopes, omega), force[lines]))
        slope = (np.einsum("ta,tpa->tp", error, change) / np.maximum(radius, 1e-300)[:, None]).mean(axis=0)
        return np.array([radius.mean()]), slope[None]
