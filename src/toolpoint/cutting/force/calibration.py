r"""Calibration: cutting coefficients and run-out from measured forces, with confidence intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import stdtrit

from toolpoint._check import FloatArray, fail, floats, nonnegative
from toolpoint._doubt import Doubt, status_of
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.coefficients import CuttingCoefficients
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.force.phase import record_phases
from toolpoint.cutting.force.unit_forces import NAMES, forces_per_coefficient, names_of
from toolpoint.vibration import Record

MODEL_STEPS_PER_SAMPLE = 4  # steps of the model's revolution for each sample, where angles are fitted
RUNOUT_SCALE = 10e-6  # m: scale of a run-out component in the fit
ACCEPTED_RUNOUT_DEVIATION = 0.1  # of RUNOUT_SCALE: up to it a run-out is well determined, however small it is
MIN_INFORMATION_RATIO = 1e-13  # of the largest eigenvalue of scaled information: smaller ones are rounding


@dataclass(frozen=True, eq=False)
class Calibration(NotebookText):
    """Fitted coefficients (and run-out) with their uncertainty.

    Parameters
    ----------
    names : sequence of str
        Fitted parameters: kt, kn, ka (Pa), edge_t, edge_n, edge_a (N/m), runout (m), runout_angle, phase (rad) or
        phase_1, phase_2 .. of every record.
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
        """95 % confidence interval of every parameter, shape (p, 2); an offset is not below zero."""
        half = stdtrit(self.freedom, 0.975) * np.sqrt(np.diag(self.covariance))
        ends = np.stack([self.values - half, self.values + half], axis=1)
        if "runout" in self.names:
            index = self.names.index("runout")
            ends[index, 0] = max(ends[index, 0], 0.0)
        return ends

    @property
    def coefficients(self) -> CuttingCoefficients:
        """The fitted coefficients (values below zero, within their error of it, are set to zero)."""
        numbers = dict(zip(self.names, self.values))
        return CuttingCoefficients(**{n: max(float(numbers.get(n, 0.0)), 0.0) for n in NAMES}, source="calibrated")

    def table(self) -> str:
        """Return parameters, values and 95 % intervals as text."""
        rows = [f"{'parameter':<14}{'value':>14}   95 % interval"]
        for name, value, (lower, upper) in zip(self.names, self.values, self.interval):
            rows.append(f"{name:<14}{value:14.6g}   {lower:.6g} .. {upper:.6g}")
        return "\n".join([*rows, f"residual {self.residual:.4g} N, {self.status}"])

    def __repr__(self) -> str:
        parts = ", ".join(f"{n} {v:.4g}" for n, v in zip(self.names, self.values))
        return f"Calibration({parts}; residual {self.residual:.3g} N, {self.status})"


def average_force(problem: MillingProblem, feeds: FloatArray, mean_forces: FloatArray, *, depth: float,
                  errors: FloatArray | None = None, freedom: int | None = None) -> Calibration:
    r"""Return coefficients from mean forces at several feeds per tooth (linear regression).

    Parameters
    ----------
    problem : MillingProblem
        Tool (with its run-out, where it has one) and engagement; its coefficients and feed are not used.
    feeds : (n,) floats
        Feed per tooth, m; at least two different ones.
    mean_forces : (n, 2 or 3) floats
        Mean force on the tool along x, y (and z) over whole revolutions, N.
    depth : float
        m.
    errors : (n, 2 or 3) floats, optional
        Standard deviations of the mean forces, N, from the scatter between revolutions. Without them the residual of the line
        over the feeds is taken for it; two feeds leave none, and then no interval is known.
    freedom : int, optional
        Degrees of freedom of the errors.

    A rounded edge (corner radius, ball) is integrated along its meridian, slice by slice.

    Source: Budak, Altintas, Armarego, J. Manufacturing Science Engineering 118 (1996) 216; Altintas, section 2.7.1.
    """
    f = nonnegative("feeds", floats("feeds", feeds))
    mean = floats("mean_forces", mean_forces, (f.size, None))
    if np.unique(np.round(f, 12)).size < 2:
        fail("feeds", f"{np.unique(f).size} different feed", "must be at least two", remedy="cut at several feeds")
    names = names_of(mean.shape[1])
    arc, teeth = problem.engagement, problem.tool.teeth
    if problem.tool.corner_radius > 0 or problem.tool.runout > 0:
        rows = [_mean_of_slices(problem, float(x), depth, mean.shape[1]) for x in f]
    else:
        rows = [_mean_row(arc.entry, arc.exit, teeth, depth, x, names)[:mean.shape[1]] for x in f]
    matrix, right = np.concatenate(rows), mean.ravel()
    weight = np.ones(right.size) if errors is None else 1 / np.maximum(floats("errors", errors, mean.shape).ravel(), 1e-12)
    scale = np.linalg.norm(matrix * weight[:, None], axis=0)
    scaled = matrix * weight[:, None] / scale
    solution, _, rank, _ = np.linalg.lstsq(scaled, right * weight, rcond=None)
    if rank < len(names):
        fail("mean_forces", f"rank {rank}", f"must determine {len(names)} coefficients",
             remedy="use more feeds or another width")
    residuals, spare = right - matrix / scale @ solution, right.size - len(names)
    residual = float(np.sqrt(np.sum(residuals**2) / max(spare, 1)))
    covariance, doubts = np.linalg.inv(scaled.T @ scaled) / np.outer(scale, scale), []
    chi2 = float(np.sum((residuals * weight)**2)) / max(spare, 1)
    if errors is not None:
        covariance = covariance * max(chi2, 1.0)
    elif spare > 0:
        covariance = covariance * chi2
    else:  # a residual of zero would be an interval of zero
        covariance = np.diag(np.full(len(names), np.inf))
        doubts = [Doubt("mean forces", "they are as many as coefficients: no interval is known", "cut at a third feed")]
    return Calibration(names, solution / scale, covariance, max(spare if errors is None else freedom or spare, 1), residual,
                       status_of(doubts, "converged"))


def _mean_row(entry: float, leave: float, teeth: int, depth: float, feed: float, names: tuple[str, ...]) -> FloatArray:
    """Return the mean force (3,) per unit of each coefficient in closed form."""
    def integral(function: Callable[[FloatArray], FloatArray]) -> float:
        x, w = np.polynomial.legendre.leggauss(24)
        phi = entry + (leave - entry) * (1 + x) / 2
        return float(w @ function(phi)) * (leave - entry) / 2

    c = depth * teeth / (2 * np.pi)
    cos, sin = integral(np.cos), integral(np.sin)
    sc, ss = integral(lambda p: np.sin(p) * np.cos(p)), integral(lambda p: np.sin(p) ** 2)
    columns = {"kt": (-feed * sc, feed * ss, 0), "kn": (-feed * ss, -feed * sc, 0), "ka": (0, 0, feed * sin),
               "edge_t": (-cos, sin, 0), "edge_n": (-sin, -cos, 0), "edge_a": (0, 0, leave - entry)}
    return c * np.array([columns[name] for name in names], float).T


def _mean_of_slices(problem: MillingProblem, feed: float, depth: float, directions: int) -> FloatArray:
    """Return the mean force per unit of each coefficient over a revolution, by slices of the edge."""
    turn = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    model = forces_per_coefficient(replace(problem, feed_per_tooth=feed), depth, turn, directions=directions, slices=40)
    return np.asarray(model.reshape(turn.size, directions, -1).mean(0))


def instantaneous(problem: MillingProblem, feeds: FloatArray, angle: FloatArray, *, forces: FloatArray, depth: float,
                  runout: bool = True, phase: bool | str = False, slices: int = 20) -> Calibration:
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
    phase : bool or "each"
        Fit the angle of tooth 0 at the first sample as well: one for all records, or with ``"each"`` one for each record,
        found without a start; then `angle` must be equal steps over one revolution. The teeth are then named by the fit:
        of a regular tool tooth 0 is the one nearest to angle zero in the first record.
    slices : int
        Axial slices of a helical tool.

    Notes
    -----
    The residual is taken as white; the covariance is s^2 (J^T J)^-1. The offset enters through its two components, so
    that an offset of zero is no singular point; offset and angle are reported with propagated covariance.
    """
    f = floats("feeds", np.atleast_1d(feeds))
    data = floats("forces", forces, (f.size, np.size(angle), None))
    ways = data.shape[-1]
    if ways not in (2, 3):
        fail("forces", f"{ways} directions", "must be x, y or x, y, z")
    names = list(names_of(ways))
    if phase not in (False, True, "each"):
        fail("phase", repr(phase), "must be False, True or 'each'")
    linear, shifts = len(names), f.size if phase == "each" else int(phase)
    runout = runout and problem.tool.teeth > 1
    turn = floats("angle", np.atleast_1d(angle))
    if phase == "each" and (turn.size < 3 or np.abs(np.diff(turn) - 2 * np.pi / turn.size).max() > 1e-6):
        fail("angle", f"{turn.size} values from {turn[0]:g} to {turn[-1]:g} rad",
             "must be equal steps over one revolution where the angle of each record is to be found",
             remedy="fold the records with `revolution`")

    courses = _UnitForces(problem, f, depth, ways, slices, turn, interpolated=shifts > 0)
    matrix = courses.matrix
    begin: FloatArray = np.zeros(f.size)
    if phase == "each":
        unit_forces = matrix(0j, begin).reshape(*data.shape, linear)
        begin = record_phases(unit_forces, data, problem.tool, reference=int(np.argmax(f)))
    start = average_force(problem, f, data.mean(1), depth=depth).values if np.unique(f).size > 1 else \
        np.linalg.lstsq(matrix(0j, begin), data.ravel(), rcond=None)[0]
    scale = np.maximum(np.abs(start), 1e-3 * np.abs(start).max())

    def residual(p: FloatArray) -> FloatArray:
        offset = complex(p[linear], p[linear + 1]) * RUNOUT_SCALE if runout else 0j
        shift = np.broadcast_to(p[p.size - shifts:], f.shape) if shifts else begin
        return matrix(offset, shift) @ (p[:linear] * scale) - data.ravel()

    first = np.concatenate([start / scale, *_first_runout(lambda offset: matrix(offset, begin), data.ravel(), runout),
                            begin[:shifts]])
    fit = least_squares(residual, first, method="lm")
    return _report_fit(fit, names, scale, runout, shifts, data.size)


class _UnitForces:
    """Forces per unit of each coefficient of all records, at a run-out and at shifts of their angles.

    Entry and exit of the slices make the model jump from sample to sample; where angles are fitted it is computed on a finer
    grid of the revolution and taken linearly between, so that its slope against the angle knows the jumps.
    """

    def __init__(self, problem: MillingProblem, feeds: FloatArray, depth: float, directions: int, slices: int,
                 turn: FloatArray, interpolated: bool) -> None:
        self.problem, self.feeds, self.depth, self.directions, self.slices, self.turn = (
            problem, feeds, depth, directions, slices, turn)
        self.fine = max(MODEL_STEPS_PER_SAMPLE * turn.size, 720) if interpolated else 0
        self._last: tuple[complex, FloatArray] | None = None

    def at(self, offset: complex, turn: FloatArray) -> FloatArray:
        """Return (n, n_turn, d, p) at these angles."""
        tool = self.problem.tool.with_runout(abs(offset), float(np.angle(offset)), self.problem.tool.tilt)
        parts = [forces_per_coefficient(replace(self.problem, tool=tool, feed_per_tooth=float(x)), self.depth, turn,
                                        directions=self.directions, slices=self.slices) for x in self.feeds]
        return np.stack(parts).reshape(self.feeds.size, turn.size, self.directions, -1)

    def matrix(self, offset: complex, shift: FloatArray) -> FloatArray:
        """Return the matrix (n * n_angle * d, p) of all samples; `shift` (n,) rad is not used where no angle is fitted."""
        if not self.fine:
            numbers = self.at(offset, self.turn)
            return numbers.reshape(-1, numbers.shape[-1])
        if self._last is None or self._last[0] != offset:
            self._last = offset, self.at(offset, 2 * np.pi * np.arange(self.fine) / self.fine)
        place = (self.turn + np.asarray(shift)[:, None]) / (2 * np.pi) * self.fine
        lower_index = np.floor(place).astype(int)
        part, record = (place - lower_index)[..., None, None], np.arange(self.feeds.size)[:, None]
        table = self._last[1]
        numbers = table[record, lower_index % self.fine] * (1 - part) + table[record, (lower_index + 1) % self.fine] * part
        return numbers.reshape(-1, numbers.shape[-1])


def forces_of_fit(problem: MillingProblem, fit: Calibration, feeds: FloatArray, *, angle: FloatArray, depth: float,
                  directions: int = 3, slices: int = 20) -> FloatArray:
    """Return the forces (n, n_angle, directions) of the fitted model at the same feeds and angles, N; see `instantaneous`."""
    numbers, f = dict(zip(fit.names, fit.values)), floats("feeds", np.atleast_1d(feeds))
    tool = problem.tool.with_runout(numbers.get("runout", problem.tool.runout),
                                    numbers.get("runout_angle", problem.tool.runout_angle), problem.tool.tilt)
    linear = fit.values[:len(NAMES) if directions == 3 else 4]
    common = numbers.get("phase", 0.0)
    parts = [forces_per_coefficient(replace(problem, tool=tool, feed_per_tooth=float(x)), depth,
                                    np.asarray(angle) + numbers.get(f"phase_{i + 1}", common), directions=directions,
                                    slices=slices) @ linear
             for i, x in enumerate(f)]
    return np.stack(parts).reshape(f.size, np.size(angle), directions)


def _first_runout(matrix: Callable[[complex], FloatArray], data: FloatArray, runout: bool) -> list[FloatArray]:
    """Return the start of the run-out's components: of a few directions, the one whose best coefficients fit best."""
    if not runout:
        return []
    guesses = [0.5 * RUNOUT_SCALE * np.exp(2j * np.pi * k / 6) for k in range(6)]
    cost = []
    for guess in guesses:
        m = matrix(complex(guess))
        cost.append(np.sum((m @ np.linalg.lstsq(m, data, rcond=None)[0] - data) ** 2))
    best = guesses[int(np.argmin(cost))] / RUNOUT_SCALE
    return [np.array([best.real, best.imag])]


def _report_fit(fit: OptimizeResult, names: list[str], scale: FloatArray, runout: bool, shifts: int, size: int) -> Calibration:
    freedom = size - fit.x.size
    sigma2 = 2 * fit.cost / freedom
    doubts = [] if fit.success else [Doubt("fit", f"not converged: {fit.message}", "give a nearer start")]
    return report_fit(fit.x, sigma2 * invert_information(fit.jac.T @ fit.jac), tuple(names), scale=scale, runout=runout,
                      shifts=shifts, freedom=freedom, residual=float(np.sqrt(sigma2)), doubts=doubts)


def invert_information(information: FloatArray) -> FloatArray:
    """Return the inverse of a normal matrix whose weak directions keep their large variance.

    A pseudo-inverse gives a direction that the data do not tell no variance at all, and so the smallest of intervals.
    """
    # Parameters in Pa and N/m differ by ten orders: scaled to a diagonal of one, what is singular shows as such.
    size = np.sqrt(np.maximum(np.diag(information), 1e-30 * np.diag(information).max()))
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    values = np.maximum(values, MIN_INFORMATION_RATIO)
    return np.asarray((vectors / values) @ vectors.T / np.outer(size, size))


def report_fit(p: FloatArray, covariance: FloatArray, names: tuple[str, ...], *, scale: FloatArray, runout: bool, shifts: int,
               freedom: int, residual: float, doubts: list[Doubt]) -> Calibration:
    """Return a Calibration of fitted numbers: coefficients over `scale`, the offset's two components over RUNOUT_SCALE, angles.

    p : (p,); covariance : (p, p) of them; doubts : of the fit so far. Offset and direction follow with their covariance.
    """
    linear = len(names)
    turn = np.eye(p.size)
    values = p.astype(float).copy()
    values[:linear] *= scale
    turn[range(linear), range(linear)] = scale
    if runout:
        x, y = p[linear], p[linear + 1]
        r = max(float(np.hypot(x, y)), np.finfo(float).tiny)
        turn[linear:linear + 2, linear:linear + 2] = [[RUNOUT_SCALE * x / r, RUNOUT_SCALE * y / r], [-y / r**2, x / r**2]]
        values[linear], values[linear + 1] = RUNOUT_SCALE * r, np.arctan2(y, x)
        names = (*names, "runout", "runout_angle")
    names = (*names, *(["phase"] if shifts == 1 else [f"phase_{i + 1}" for i in range(shifts)]))
    reported = turn @ covariance @ turn.T
    if runout and (weak := float(covariance[linear:linear + 2, linear:linear + 2].trace())) > max(0.1 * r,
                                                                                                  ACCEPTED_RUNOUT_DEVIATION)**2:
        # To first order the offset does not know its component across: its interval is that of the weaker one.
        reported[linear, linear] = RUNOUT_SCALE**2 * weak
        reported[linear + 1, linear + 1] = weak / r**2 if weak < r**2 else np.inf
        doubts = doubts or [Doubt("run-out", "its two components are poorly determined: two teeth show only one of them",
                                  "cut deeper or use a tool with more teeth")]
    return Calibration(names, values, reported, freedom, residual, status_of(doubts, "converged"))


def revolution(record: Record, speed: float, revolutions: int | None = None) -> tuple[FloatArray, FloatArray]:
    """Return (angle, mean force over one revolution) from a force Record at constant spindle speed (rev/min).

    The samples of all whole revolutions are averaged at equal angles (linear between samples).

    Returns
    -------
    angle : (n,) floats, rad; force : (n, n_channels) floats
    """
    per = record.sample_rate * 60 / speed
    turn_count = int(record.samples.shape[0] // per) if revolutions is None else revolutions
    if turn_count < 1:
        fail("record", f"{record.samples.shape[0]} samples", f"must hold a revolution ({per:.0f} samples)")
    n = int(per)
    positions = (np.arange(n)[None, :] / n + np.arange(turn_count)[:, None]) * per
    index = np.arange(record.samples.shape[0])
    values = np.stack([np.interp(positions, index, record.samples[:, c]).mean(0) for c in range(record.samples.shape[1])],
                      axis=1)
    return 2 * np.pi * np.arange(n) / n, values
