r"""Calibration: cutting coefficients and run-out from measured forces, with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from toolpoint._check import FloatArray, fail, floats, nonnegative
from toolpoint.cutting.coefficients import CuttingCoefficients
from toolpoint.cutting.forces import chip_field
from toolpoint.cutting.problem import MillingProblem
from toolpoint.vibration import Record

UNIT = 10e-6  # m: scale of a run-out component in the fit
NAMES = ("kt", "kn", "ka", "edge_t", "edge_n", "edge_a")


@dataclass(frozen=True, eq=False)
class Calibration:
    """Fitted coefficients (and run-out) with their uncertainty.

    Parameters
    ----------
    names : sequence of str
        Fitted parameters: kt, kn, ka (Pa), edge_t, edge_n, edge_a (N/m), runout (m), runout_angle, phase (rad).
    values : (p,) floats
    covariance : (p, p) floats
    freedom : int
        Degrees of freedom of the residual.
    residual : float
        Standard deviation of the residual, N.
    status : str
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    freedom: int
    residual: float
    status: str = "converged"

    @property
    def interval(self) -> FloatArray:
        """95 % confidence interval of every parameter, shape (p, 2)."""
        half = student.ppf(0.975, self.freedom) * np.sqrt(np.diag(self.covariance))
        return np.stack([self.values - half, self.values + half], axis=1)

    @property
    def coefficients(self) -> CuttingCoefficients:
        """The fitted coefficients (values below zero, within their error of it, are set to zero)."""
        found = dict(zip(self.names, self.values))
        return CuttingCoefficients(**{n: max(float(found.get(n, 0.0)), 0.0) for n in NAMES}, source="calibrated")

    def table(self) -> str:
        """Return parameters, values and 95 % intervals as text."""
        rows = [f"{'parameter':<14}{'value':>14}   95 % interval"]
        for name, value, (low, high) in zip(self.names, self.values, self.interval):
            rows.append(f"{name:<14}{value:14.6g}   {low:.6g} .. {high:.6g}")
        return "\n".join([*rows, f"residual {self.residual:.4g} N, {self.status}"])

    def __repr__(self) -> str:
        parts = ", ".join(f"{n} {v:.4g}" for n, v in zip(self.names, self.values))
        return f"Calibration({parts}; residual {self.residual:.3g} N, {self.status})"


def average_force(problem: MillingProblem, feeds: FloatArray, mean_forces: FloatArray, depth: float) -> Calibration:
    r"""Return coefficients from mean forces at several feeds per tooth (linear regression).

    Parameters
    ----------
    problem : MillingProblem
        Tool and engagement; its coefficients and feed are not used.
    feeds : (n,) floats
        Feed per tooth, m; at least two different ones.
    mean_forces : (n, 2 or 3) floats
        Mean force on the tool along x, y (and z) over whole revolutions, N.
    depth : float
        m.

    Source: Budak, Altintas, Armarego, J. Manufacturing Science Engineering 118 (1996) 216; Altintas, section 2.7.1.
    """
    f = nonnegative("feeds", floats("feeds", feeds))
    mean = floats("mean_forces", mean_forces, (f.size, None))
    if np.unique(np.round(f, 12)).size < 2:
        fail("feeds", f"{np.unique(f).size} different feed", "must be at least two", "cut at several feeds")
    names = NAMES if mean.shape[1] == 3 else ("kt", "kn", "edge_t", "edge_n")
    arc, teeth = problem.engagement, problem.tool.teeth
    rows = [_mean_row(arc.entry, arc.exit, teeth, depth, x, names)[:mean.shape[1]] for x in f]
    matrix, right = np.concatenate(rows), mean.ravel()
    scale = np.linalg.norm(matrix, axis=0)
    solution, _, rank, _ = np.linalg.lstsq(matrix / scale, right, rcond=None)
    if rank < len(names):
        fail("mean_forces", f"rank {rank}", f"must determine {len(names)} coefficients", "use more feeds or another width")
    freedom = max(right.size - len(names), 1)
    sigma2 = float(np.sum((right - matrix / scale @ solution) ** 2)) / freedom
    covariance = sigma2 * np.linalg.inv((matrix / scale).T @ (matrix / scale)) / np.outer(scale, scale)
    return Calibration(names, solution / scale, covariance, freedom, float(np.sqrt(sigma2)))


def _mean_row(entry: float, leave: float, teeth: int, depth: float, feed: float, names: tuple[str, ...]) -> FloatArray:
    """Mean force (3) per unit of each coefficient."""
    def integral(function: object) -> float:
        x, w = np.polynomial.legendre.leggauss(24)
        phi = entry + (leave - entry) * (1 + x) / 2
        return float(w @ function(phi)) * (leave - entry) / 2  # type: ignore[operator]

    c = depth * teeth / (2 * np.pi)
    cos, sin = integral(np.cos), integral(np.sin)
    sc, ss = integral(lambda p: np.sin(p) * np.cos(p)), integral(lambda p: np.sin(p) ** 2)
    columns = {"kt": (-feed * sc, feed * ss, 0), "kn": (-feed * ss, -feed * sc, 0), "ka": (0, 0, feed * sin),
               "edge_t": (-cos, sin, 0), "edge_n": (-sin, -cos, 0), "edge_a": (0, 0, leave - entry)}
    return c * np.array([columns[name] for name in names], float).T


def instantaneous(problem: MillingProblem, feeds: FloatArray, angle: FloatArray, forces: FloatArray, depth: float,
                  runout: bool = True, phase: bool = False, slices: int = 20) -> Calibration:
    r"""Return coefficients and run-out from forces over rotation (nonlinear least squares).

    Parameters
    ----------
    problem : MillingProblem
        Tool (its run-out is the start) and engagement.
    feeds : (n,) floats
        Feed per tooth of each record, m.
    angle : (n_angle,) floats
        Rotation of tooth 0 of the samples, rad; the same for all records.
    forces : (n, n_angle, 2 or 3) floats
        Force on the tool, N.
    depth : float
        m.
    runout : bool
        Fit offset and direction of the run-out (needs at least two teeth).
    phase : bool
        Fit the angle of tooth 0 at the first sample as well.
    slices : int
        Axial slices of a helical tool.

    Notes
    -----
    The residual is taken as white; the covariance is s^2 (J^T J)^-1. The offset enters through its two components, so
    that an offset of zero is no singular point; offset and angle are reported with propagated covariance.
    """
    f = floats("feeds", np.atleast_1d(feeds))
    data = floats("forces", forces, (f.size, np.size(angle), None))
    names = list(NAMES if data.shape[2] == 3 else ("kt", "kn", "edge_t", "edge_n"))
    linear = len(names)
    runout = runout and problem.tool.teeth > 1
    start = average_force(problem, f, data.mean(1), depth).values if np.unique(f).size > 1 else \
        np.array([getattr(problem.coefficients, n) for n in names])
    scale = np.maximum(np.abs(start), 1e-3 * np.abs(start).max())
    turn = np.asarray(angle, float)

    def matrix(offset: complex, shift: float) -> FloatArray:
        tool = problem.tool.with_runout(abs(offset), float(np.angle(offset)), problem.tool.tilt)
        return np.concatenate([_linear_model(replace(problem, tool=tool, feed_per_tooth=float(x)), depth, turn + shift,
                                             data.shape[2], slices) for x in f])

    def residual(p: FloatArray) -> FloatArray:
        offset = complex(p[linear], p[linear + 1]) * UNIT if runout else 0j
        return matrix(offset, p[-1] if phase else 0.0) @ (p[:linear] * scale) - data.ravel()

    first = np.concatenate([start / scale, *_first_runout(matrix, data.ravel(), runout), [0.0] if phase else []])
    fit = least_squares(residual, first, method="lm")
    return _reported(fit, names, scale, runout, phase, data.size)


def _first_runout(matrix: Callable[[complex, float], FloatArray], data: FloatArray, runout: bool) -> list[FloatArray]:
    """Start of the run-out's components: of a few directions the one whose best coefficients fit best."""
    if not runout:
        return []
    guesses = [0.5 * UNIT * np.exp(2j * np.pi * k / 6) for k in range(6)]
    cost = []
    for guess in guesses:
        m = matrix(complex(guess), 0.0)
        cost.append(np.sum((m @ np.linalg.lstsq(m, data, rcond=None)[0] - data) ** 2))
    best = guesses[int(np.argmin(cost))] / UNIT
    return [np.array([best.real, best.imag])]


def _linear_model(problem: MillingProblem, depth: float, turn: FloatArray, directions: int, slices: int) -> FloatArray:
    """Forces per unit of each coefficient at given run-out, shape (n_angle * n_directions, n_names)."""
    phi, h, share = chip_field(problem, depth, turn, slices)
    s, c = np.sin(phi), np.cos(phi)
    chip, edge = np.maximum(h, 0.0) * share, (h > 0) * share
    zero = np.zeros(turn.size)

    def over(field: FloatArray) -> FloatArray:
        return field.sum((1, 2))

    columns = []
    for g in (chip, edge):
        columns += [np.stack([-over(g * c), over(g * s), zero]), np.stack([-over(g * s), -over(g * c), zero]),
                    np.stack([zero, zero, over(g)])]
    every = np.stack(columns)[:, :directions]  # (name, direction, angle)
    keep = every if directions == 3 else every[[0, 1, 3, 4]]
    return keep.transpose(2, 1, 0).reshape(-1, keep.shape[0])


def _reported(fit: object, names: list[str], scale: FloatArray, runout: bool, phase: bool, size: int) -> Calibration:
    p, jacobian = fit.x, fit.jac  # type: ignore[attr-defined]
    linear, freedom = len(names), size - fit.x.size  # type: ignore[attr-defined]
    sigma2 = 2 * fit.cost / freedom  # type: ignore[attr-defined]
    covariance = sigma2 * np.linalg.pinv(jacobian.T @ jacobian)
    turn = np.eye(p.size)
    values = p.astype(float).copy()
    values[:linear] *= scale
    turn[range(linear), range(linear)] = scale
    if runout:
        x, y = p[linear], p[linear + 1]
        r = np.hypot(x, y)
        turn[linear:linear + 2, linear:linear + 2] = [[UNIT * x / r, UNIT * y / r], [-y / r**2, x / r**2]]
        values[linear], values[linear + 1] = UNIT * r, np.arctan2(y, x)
        names = [*names, "runout", "runout_angle"]
    if phase:
        names = [*names, "phase"]
    poor = runout and np.sqrt(covariance[linear:linear + 2, linear:linear + 2].trace()) > 0.1 * r
    status = "converged" if fit.success else f"not converged: {fit.message}; give a nearer start"  # type: ignore
    if fit.success and poor:  # type: ignore[attr-defined]
        status = ("converged; the run-out's two components are poorly determined (two teeth show only one of them): "
                  "its interval is too narrow; cut deeper or use a tool with more teeth")
    return Calibration(tuple(names), values, turn @ covariance @ turn.T, freedom, float(np.sqrt(sigma2)), status)


def revolution(record: Record, speed: float, revolutions: int | None = None) -> tuple[FloatArray, FloatArray]:
    """Return (angle, mean force over one revolution) from a force Record at constant spindle speed (rev/min).

    The samples of all whole revolutions are averaged at equal angles (linear between samples).

    Returns
    -------
    angle : (n,) floats, rad; force : (n, n_channels) floats
    """
    per = record.sample_rate * 60 / speed
    whole = int(record.samples.shape[0] // per) if revolutions is None else revolutions
    if whole < 1:
        fail("record", f"{record.samples.shape[0]} samples", f"must hold a revolution ({per:.0f} samples)")
    n = int(per)
    at = (np.arange(n)[None, :] / n + np.arange(whole)[:, None]) * per
    index = np.arange(record.samples.shape[0])
    values = np.stack([np.interp(at, index, record.samples[:, c]).mean(0) for c in range(record.samples.shape[1])], axis=1)
    return 2 * np.pi * np.arange(n) / n, values
