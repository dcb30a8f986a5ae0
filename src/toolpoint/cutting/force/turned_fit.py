r"""Coefficients fitted to every sample of force records at its own angle of the revolution.

Laid on equal angles by lines between samples, the jumps of edges that enter and leave are rounded and neighbours share their
noise: coefficients of such a mean revolution are off by several of its intervals. Here samples keep their own angle (means of
narrow bins), and two errors are told apart:

- noise, from the scatter of samples that share a bin, turn by turn: :math:`\Sigma = H^{-1} (\sum_t g_t g_t^T) H^{-1}` with
  the gradients g of single turns, so that noise which neighbouring samples share is in it;
- what a sample beside a jump can tell: the model's second difference over a sample's spacing, as an error of its own in the
  weight. Where the edge stood between two samples is then told by the course of the forces, not by one lucky sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import Array, FloatArray, floats
from toolpoint._doubt import Doubt
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.force.calibration import RUNOUT_SCALE, Calibration, invert_information, report_fit
from toolpoint.cutting.force.turned_forces import TurnedForces
from toolpoint.cutting.force.unit_forces import forces_per_coefficient, names_of

MODEL_TABLE_ANGLES = 1440  # angles of the model's table
SMOOTH_JUMP_QUANTILE = 0.7  # of the jumps: bins below it show the noise alone
JUMP_DEVIATION_RATIO = 0.5  # of a jump: standard deviation of a sample beside it
RUNOUT_PRIOR_DEVIATION = 5.0  # of RUNOUT_SCALE (50 um): prior standard deviation of a run-out component
RUNOUT_SLOPE_STEP = 0.1  # of RUNOUT_SCALE: slices leave the cut one by one, a smaller step would see single ones
MAX_FIT_STEPS, CHI_SQUARED_TOLERANCE = 40, 0.01  # Gauss-Newton steps; change of chi-squared that ends them
MIN_FIT_STEPS, REWEIGHTED_STEPS = 2, 8  # least steps; steps after which the weights stay as they are
MIN_RENAMING_GAIN = 0.2  # of chi-squared: fall of a record's by which its teeth are named otherwise
MAX_ACCEPTED_MISFIT = 1.3  # from a larger misfit another offset is tried
RUNOUT_GUESSES = np.outer([0.3, 1.0], np.exp(2j * np.pi * np.arange(6) / 6)).ravel()  # over RUNOUT_SCALE
MIN_TURN_FREEDOM = 4  # turns beyond the first of each record, from which their scatter gives the covariance


def fit_turns(problem: MillingProblem, feeds: FloatArray, records: Sequence[TurnedForces], *, depth: float,
              start: Calibration, angle: float | None = None, slices: int = 40) -> tuple[Calibration, float]:
    """Return coefficients, run-out and phases from all samples of records, and the misfit.

    Parameters
    ----------
    problem : MillingProblem
        Tool and engagement.
    feeds : (n,) floats
        Feed per tooth of each record, m.
    records : sequence of TurnedForces
    depth : float
        m.
    start : Calibration
        A fit of the mean revolution; says whether run-out and a phase of each record are fitted.
    angle : float, optional
        Rotation of tooth 0 at the first sample, rad, where `start` has no phases; otherwise they are fitted.
    slices : int
        Axial slices of a helical tool.

    Returns
    -------
    fit : Calibration
    misfit : float
        Residual of the bins over what the scatter of the samples explains: 1 where the model is right, NaN where no bin holds
        two samples. The intervals grow with it.
    """
    return TurnsFit(problem, floats("feeds", np.atleast_1d(feeds)), records, depth, start, angle or 0.0, slices).solve()


class TurnsFit:
    """Weighted Gauss-Newton fit; numbers are coefficients over their scale, offset over RUNOUT_SCALE, phases.

    Between coefficients and offset a law may have numbers of its own (`TotalEnergyFit`).
    """

    def __init__(self, problem: MillingProblem, feeds: FloatArray, records: Sequence[TurnedForces], depth: float,
                 start: Calibration, angle: float, slices: int) -> None:
        self.problem, self.feeds, self.records, self.depth, self.slices = problem, feeds, records, depth, slices
        self.ways = records[0].force.shape[1]
        self.names = self.reported_names = names_of(self.ways)
        numbers = dict(zip(start.names, start.values.tolist(), strict=True))
        self.linear = self.first_offset = len(self.names)
        self.runout = "runout" in numbers
        self.shifts = len(records) if "phase_1" in numbers else 0
        self.begin = np.full(len(records), angle)
        values = np.array([numbers[name] for name in self.names])
        self.scale = np.maximum(np.abs(values), 1e-3 * np.abs(values).max())
        offset = numbers["runout"] * np.exp(1j * numbers["runout_angle"]) / RUNOUT_SCALE if self.runout else 0j
        phases = [numbers[f"phase_{i + 1}"] for i in range(self.shifts)]
        self.first = np.array([*values / self.scale, *([offset.real, offset.imag] if self.runout else []), *phases])
        self.noise = np.full(self.ways, np.nan)
        self._tables: dict[tuple[float, ...], FloatArray] = {}

    def solve(self) -> tuple[Calibration, float]:
        """Return the Calibration and the misfit; where that is large another offset is tried."""
        result, converged = self.converge_named(self.first)
        if self.misfit(result) > MAX_ACCEPTED_MISFIT and self.runout:
            other = self.converge_named(self.guess_offset(result))
            result, converged = min((result, converged), other, key=lambda each: self.misfit(each[0]))
        return self.reported(result, converged)

    def converge_named(self, first: FloatArray) -> tuple[FloatArray, bool]:
        """Return the converged numbers, their teeth named as they fit best."""
        result, converged = self.converge(first)
        for _ in self.records:
            named = self._name_teeth(result, self._weights(result), MIN_RENAMING_GAIN)
            if np.array_equal(named, result):
                break
            result, converged = self.converge(named)
        return result, converged

    def guess_offset(self, p: FloatArray) -> FloatArray:
        """Return the numbers with another offset, of a few, with which they fit best; its teeth named anew."""
        weights, guesses = self._weights(p), []
        for offset in RUNOUT_GUESSES:
            guess = p.copy()
            guess[self.first_offset:self.first_offset + 2] = offset.real, offset.imag
            guesses.append(self._name_teeth(guess, weights, 0.0))
        return min(guesses, key=lambda guess: self._cost(guess, weights))

    def misfit(self, p: FloatArray) -> float:
        """Return the root mean square residual over the deviation that noise and jumps explain."""
        weights = self._weights(p)
        return float(np.sqrt(np.sum((self._residual(p) * weights)**2) / max(weights.size - p.size, 1)))

    def _name_teeth(self, p: FloatArray, weights: FloatArray, min_gain: float) -> FloatArray:
        """Return the numbers with each record's phase moved by the whole pitches that fit its forces best.

        Teeth of a regular tool differ by run-out alone: which of them is tooth 0 in a record is easily taken wrongly at first.
        """
        tool = self.problem.tool
        if not (self.shifts and self.runout and tool.is_regular):
            return p
        named = p.copy()
        ends = np.cumsum([record.angle.size * self.ways for record in self.records])[:-1]
        costs = np.empty((tool.teeth, len(self.records)))
        for k in range(tool.teeth):
            moved = p.copy()
            moved[p.size - self.shifts:] += 2 * np.pi * k / tool.teeth
            costs[k] = [float(np.sum(part**2)) for part in np.split(self._residual(moved) * weights, ends)]
        best_pitches = costs.argmin(axis=0)
        best_pitches[costs[0] - costs.min(axis=0) <= min_gain * costs.min(axis=0)] = 0
        named[p.size - self.shifts:] += 2 * np.pi * best_pitches / tool.teeth
        return named

    def converge(self, first: FloatArray) -> tuple[FloatArray, bool]:
        """Return the numbers, and whether the last step changed chi-squared by next to nothing."""
        p, weights = first, self._weights(first)
        for turn in range(MAX_FIT_STEPS):
            if turn < REWEIGHTED_STEPS:
                weights = self._weights(p)
            jacobian, residual = self._jacobian(p) * weights[:, None], self._residual(p) * weights
            information, pull = self._with_prior(jacobian.T @ jacobian, jacobian.T @ residual, p)
            inverse = invert_information(information)
            step = -inverse @ pull
            cost = lower = self._cost(p, weights)
            for _ in range(6):
                lower = self._cost(p + step, weights)
                if lower <= cost:
                    break
                step = step / 2
            # Less change of chi-squared is samples beside jumps that change sides, which says nothing any more.
            if cost - lower < CHI_SQUARED_TOLERANCE and turn >= MIN_FIT_STEPS:
                return (p + step if lower < cost else p), True
            p = p + step if lower < cost else p
        return p, False

    def reported(self, p: FloatArray, converged: bool) -> tuple[Calibration, float]:
        """Return the Calibration of fitted numbers and the misfit."""
        weights = self._weights(p)
        jacobian, residual = self._jacobian(p), self._residual(p)
        weighted = jacobian * weights[:, None]
        inverse = invert_information(self._with_prior(weighted.T @ weighted, np.zeros(p.size), p)[0])
        freedom, misfit = weights.size - p.size, self.misfit(p)
        turns = sum(record.turns - 1 for record in self.records)
        judged = bool(np.isfinite(self._scatter(p)).all())
        covariance = inverse
        if turns >= MIN_TURN_FREEDOM:
            spread = self._spread(p, jacobian, weights)
            covariance, freedom = inverse @ spread @ inverse + self._prior_share(inverse), turns
        doubts = [] if converged else [Doubt("fit", f"not converged in {MAX_FIT_STEPS} steps", "check tool, arc and angles")]
        count = np.concatenate([np.repeat(record.count, self.ways) for record in self.records])
        rms = float(np.sqrt(np.sum(count * residual**2) / np.sum(count)))
        factor = max(misfit, 1.0)**2 if judged else misfit**2
        covariance = covariance * factor + np.diag(self._slicing_error(p, weights, inverse @ weighted.T)**2)
        scale = np.append(self.scale, np.ones(len(self.reported_names) - self.linear))
        return report_fit(p, covariance, self.reported_names, scale=scale, runout=self.runout, shifts=self.shifts,
                          freedom=max(freedom, 1), residual=rms, doubts=doubts), misfit if judged else float("nan")

    def _slicing_error(self, p: FloatArray, weights: FloatArray, gain: FloatArray) -> FloatArray:
        """Return the change of the numbers (p,) when the edge is cut into half as many slices, a bound of the slicing error."""
        slices, tables, residual = self.slices, self._tables, self._residual(p)
        self.slices, self._tables = max(slices // 2, 1), {}
        coarse = self._residual(p)
        self.slices, self._tables = slices, tables
        return np.asarray(gain @ ((coarse - residual) * weights))

    def _offset(self, p: FloatArray) -> complex:
        return complex(*p[self.first_offset:self.first_offset + 2]) * RUNOUT_SCALE if self.runout else 0j

    def _table(self, p: FloatArray) -> FloatArray:
        """Return forces per unit of each coefficient (n, angles, d, p) over the revolution; the latest few tables are kept."""
        key = tuple(p[self.linear:p.size - self.shifts].tolist())
        if key not in self._tables:
            if len(self._tables) > 6:
                self._tables.clear()
            offset = self._offset(p)
            tool = self.problem.tool.with_runout(abs(offset), float(np.angle(offset)), self.problem.tool.tilt)
            parts = [self._per_unit(replace(self.problem, tool=tool, feed_per_tooth=float(x)), p) for x in self.feeds]
            self._tables[key] = np.stack(parts).reshape(self.feeds.size, MODEL_TABLE_ANGLES, self.ways, -1)
        return self._tables[key]

    def _per_unit(self, problem: MillingProblem, p: FloatArray) -> FloatArray:
        """Return forces per unit of each coefficient (angles * d, p) of one feed over the revolution."""
        turn = 2 * np.pi * np.arange(MODEL_TABLE_ANGLES) / MODEL_TABLE_ANGLES
        return forces_per_coefficient(problem, self.depth, turn, directions=self.ways, slices=self.slices)

    def _unit_forces(self, p: FloatArray, record: int, offset: float = 0.0) -> FloatArray:
        """Return forces per unit (n, d, p) at the angles of a record's bins, plus an offset in rad."""
        shift = p[p.size - self.shifts + record] if self.shifts else self.begin[record]
        place = (self.records[record].angle + shift + offset) / (2 * np.pi) * MODEL_TABLE_ANGLES
        lower_index = np.floor(place).astype(int)
        part, table = (place - lower_index)[:, None, None], self._table(p)[record]
        return np.asarray(table[lower_index % MODEL_TABLE_ANGLES] * (1 - part) + table[(lower_index + 1) % MODEL_TABLE_ANGLES]
                          * part)

    def _forces(self, p: FloatArray, offset: float = 0.0) -> list[FloatArray]:
        """Return the forces (n, d) of every record's bins; `offset` in sample spacings."""
        values = p[:self.linear] * self.scale
        return [self._unit_forces(p, i, offset * record.spacing) @ values for i, record in enumerate(self.records)]

    def _residual(self, p: FloatArray) -> FloatArray:
        return np.concatenate([(force - record.force).ravel() for force, record in zip(self._forces(p), self.records)])

    def _cost(self, p: FloatArray, weights: FloatArray) -> float:
        offset = p[self.first_offset:self.first_offset + 2] if self.runout else np.zeros(2)
        return float(np.sum((self._residual(p) * weights)**2) + np.sum((offset / RUNOUT_PRIOR_DEVIATION)**2))

    def _with_prior(self, information: FloatArray, pull: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Add the prior that an offset is some tens of micrometres: two teeth do not show its component across them."""
        if self.runout:
            components = [self.first_offset, self.first_offset + 1]
            information[components, components] += 1 / RUNOUT_PRIOR_DEVIATION**2
            pull[components] += p[components] / RUNOUT_PRIOR_DEVIATION**2
        return information, pull

    def _prior_share(self, inverse: FloatArray) -> FloatArray:
        """Return the part of the covariance that comes from the prior of the offset, not from the samples."""
        if not self.runout:
            return np.zeros_like(inverse)
        columns = inverse[:, self.first_offset:self.first_offset + 2]
        return np.asarray(columns @ columns.T / RUNOUT_PRIOR_DEVIATION**2)

    def _jacobian(self, p: FloatArray) -> FloatArray:
        """Return the slopes (rows, p) of the forces by the numbers; by a phase over a sample's spacing, as jumps are
        weighed."""
        rows = []
        for i, record in enumerate(self.records):
            part = np.zeros((record.angle.size, self.ways, p.size))
            part[..., :self.linear] = self._unit_forces(p, i) * self.scale
            if self.shifts:
                h, values = record.spacing / 2, p[:self.linear] * self.scale
                part[..., p.size - self.shifts + i] = (self._unit_forces(p, i, h) - self._unit_forces(p, i,
                                                                                                      -h)) @ values / (2 * h)
            rows.append(part.reshape(-1, p.size))
        jacobian = np.concatenate(rows)
        for k in range(self.linear, self.first_offset + 2 * self.runout):
            forward, backward = p.copy(), p.copy()
            forward[k], backward[k] = p[k] + RUNOUT_SLOPE_STEP, p[k] - RUNOUT_SLOPE_STEP
            jacobian[:, k] = (self._residual(forward) - self._residual(backward)) / (2 * RUNOUT_SLOPE_STEP)
        return jacobian

    def _jumps(self, p: FloatArray) -> list[FloatArray]:
        """Return the second differences (n, d) of the forces within a sample's spacing: the height of a jump that lies in it.

        Three of quarter steps and one of half a step: a jump right at a sample has none about the sample itself.
        """
        courses = [np.stack(parts) for parts in zip(*(self._forces(p, offset) for offset in (-0.5, -0.25, 0.0, 0.25, 0.5)))]
        differences = [np.concatenate([np.diff(each, 2, axis=0), np.diff(each[::2], 2, axis=0)]) for each in courses]
        return [np.abs(each).max(axis=0) for each in differences]

    def _weights(self, p: FloatArray) -> FloatArray:
        """Return 1 over the deviation of every bin's force: noise over its samples, and half a jump that lies beside it."""
        noise = self._scatter(p)
        if not np.isfinite(noise).all():
            noise = self._residual_noise(p)
        noise = np.maximum(noise, 1e-9 * max(float(np.abs(r.force).max()) for r in self.records))
        return np.concatenate([(1 / np.sqrt(noise**2 / record.count[:, None] + (JUMP_DEVIATION_RATIO * jump)**2)).ravel()
                               for record, jump in zip(self.records, self._jumps(p))])

    def _smooth_bins(self, p: FloatArray) -> list[Array]:
        """Whether each bin (n,) of every record lies beside no jump."""
        sizes = [jump.max(axis=1) for jump in self._jumps(p)]
        return [size <= np.quantile(size, SMOOTH_JUMP_QUANTILE) for size in sizes]

    def _scatter(self, p: FloatArray) -> FloatArray:
        """Return the deviation (d,) of a sample's noise from samples that share a smooth bin, N; NaN where too few do."""
        total, freedom = np.zeros(self.ways), 0.0
        for record, force, smooth in zip(self.records, self._forces(p), self._smooth_bins(p)):
            residual = record.samples - force[record.bin]
            residual = residual - record.mean(residual)[record.bin]
            within = smooth[record.bin]
            total += (residual[within]**2).sum(axis=0)
            freedom += float(np.sum(record.count[smooth] - 1))
        return np.sqrt(total / freedom) if freedom >= 20 else np.full(self.ways, np.nan)

    def _residual_noise(self, p: FloatArray) -> FloatArray:
        """Return the deviation (d,) of a sample's noise from the residual itself, where no two samples share a bin, N."""
        residual = np.concatenate([(np.sqrt(record.count)[:, None] * (force - record.force))[smooth]
                                   for record, force, smooth in zip(self.records, self._forces(p), self._smooth_bins(p))])
        return np.asarray(np.sqrt(np.mean(residual**2, axis=0)))

    def _spread(self, p: FloatArray, jacobian: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the covariance (p, p) of the gradient from its scatter between turns."""
        total, first = np.zeros((p.size, p.size)), 0
        for record, force in zip(self.records, self._forces(p)):
            rows = slice(first, first + record.angle.size * self.ways)
            first = rows.stop
            if record.turns < 2:
                continue
            slope = (jacobian[rows] * weights[rows, None]**2).reshape(record.angle.size, self.ways, -1)
            slope = slope / record.count[:, None, None]
            score = np.einsum("md,mdp->mp", force[record.bin] - record.samples, slope[record.bin])
            turns = np.stack([np.bincount(record.turn, column, record.turns) for column in score.T], axis=1)
            turns = turns - turns.mean(axis=0)
            total += turns.T @ turns * record.turns / (record.turns - 1)
        return total
