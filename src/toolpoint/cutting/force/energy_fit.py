r"""Total-energy law fitted to force records: energy per volume at a chip of 1 mm, its exponent, two force ratios.

Forces are linear in :math:`(u_0, u_0 r_1, u_0 r_2)` and not in the exponent m, which joins the run-out and the phases of
`turned_fit`: the same samples at their own angles, the same weights, the same scatter between turns.

Source: law and ratios as in `TotalEnergy`; the fit is this package's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._doubt import Doubt, status_of
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.cut.total_energy import REFERENCE_CHIP, TotalEnergy
from toolpoint.cutting.force.calibration import Calibration
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.cutting.force.turned_fit import MODEL_TABLE_ANGLES, TurnsFit
from toolpoint.cutting.force.turned_forces import TurnedForces
from toolpoint.cutting.force.unit_forces import forces_per_coefficient

_FORCES = ("energy", "normal", "axial")  # of the fit, Pa; ratios follow
_MAX_START_EXPONENT = 0.6  # of the start, whose edges may be those of a worn tool


def fit_total_energy(problem: MillingProblem, feeds: FloatArray, records: Sequence[TurnedForces], *, depth: float,
                     start: Calibration, angle: float | None = None, slices: int = 40) -> tuple[Calibration, float]:
    """Return the total-energy law of force records and its misfit; parameters as in `turned_fit.fit_turns`.

    Returns
    -------
    fit : Calibration
        Names energy (Pa at a chip of 1 mm), exponent, normal_ratio and axial_ratio (with forces along z), run-out, phases.
    misfit : float
        Residual over what the scatter of the samples explains, as in `fit_turns`.
    """
    f = floats("feeds", np.atleast_1d(feeds))
    if np.unique(np.round(f, 12)).size < 2:
        fail("feeds", f"{np.unique(f).size} different feed", "must be at least two", remedy="cut at several feeds")
    fit, misfit = TotalEnergyFit(problem, f, records, depth, start, angle or 0.0, slices).solve()
    return in_ratios(fit), misfit


class TotalEnergyFit(TurnsFit):
    """Weighted Gauss-Newton fit; numbers are energies over their scale, exponent, offset over RUNOUT_SCALE, phases."""

    def __init__(self, problem: MillingProblem, feeds: FloatArray, records: Sequence[TurnedForces], depth: float,
                 start: Calibration, angle: float, slices: int) -> None:
        super().__init__(problem, feeds, records, depth, start, angle, slices)
        offset_and_phases = self.first[self.linear:]
        numbers = dict(zip(start.names, start.values.tolist(), strict=True))
        self.names = _FORCES[:self.ways]
        self.linear, self.first_offset = self.ways, self.ways + 1
        self.reported_names = (*self.names, "exponent")
        exponent, energies = _start(numbers, self.ways, float(np.mean(feeds)) * _mean_sine(problem))
        self.scale = np.maximum(np.abs(energies), 1e-3 * np.abs(energies).max())
        self.first = np.array([*energies / self.scale, exponent, *offset_and_phases])

    def _per_unit(self, problem: MillingProblem, p: FloatArray) -> FloatArray:
        turn = 2 * np.pi * np.arange(MODEL_TABLE_ANGLES) / MODEL_TABLE_ANGLES
        forces = forces_per_coefficient(problem, self.depth, turn, directions=self.ways, slices=self.slices,
                                        exponent=float(p[self.linear]))
        return forces[:, :self.ways]  # no edge coefficients


def _mean_sine(problem: MillingProblem) -> float:
    arc = problem.engagement
    return float((np.cos(arc.entry) - np.cos(arc.exit)) / arc.arc)


def _start(numbers: dict[str, float], ways: int, chip: float) -> tuple[float, FloatArray]:
    """Return exponent and energies (ways,) whose tangent at a chip (m) the linear-edge fit is: K = (1 - m) u, K_e = m u h."""
    slope = np.array([numbers[name] for name in ("kt", "kn", "ka")[:ways]])
    edge = np.array([numbers[name] for name in ("edge_t", "edge_n", "edge_a")[:ways]]) / chip
    exponent = float(np.clip(edge[0] / max(slope[0] + edge[0], 1e-300), 0.0, _MAX_START_EXPONENT))
    return exponent, (slope + edge) * (chip / REFERENCE_CHIP) ** exponent


def in_ratios(fit: Calibration) -> Calibration:
    """Return the fit with ratios to the tangential force in place of normal and axial energies; covariances to first order."""
    values, ways = fit.values.copy(), fit.names.index("exponent")
    slope = np.eye(ways)
    for k in range(1, ways):
        values[k] = fit.values[k] / fit.values[0]
        slope[k, k], slope[k, 0] = 1 / fit.values[0], -values[k] / fit.values[0]
    covariance = fit.covariance.copy()  # that of a run-out's angle may be infinite: only the energies are turned
    covariance[:ways] = slope @ covariance[:ways]
    covariance[:, :ways] = covariance[:, :ways] @ slope.T
    order = [0, ways, *range(1, ways), *range(ways + 1, values.size)]
    names = ("energy", "exponent", *("normal_ratio", "axial_ratio")[:ways - 1], *fit.names[ways + 1:])
    covariance = covariance[np.ix_(order, order)]
    result = replace(fit, names=names, values=values[order], covariance=covariance)
    return _judged(result)


def _judged(fit: Calibration) -> Calibration:
    """Return the fit marked where its numbers are those of no cut."""
    numbers = dict(zip(fit.names, fit.values.tolist(), strict=True))
    lower, upper = fit.interval[fit.names.index("exponent")]
    if numbers["energy"] <= 0 or upper < 0 or lower > 1:
        doubt = Doubt("total energy", f"the exponent {numbers['exponent']:.3g} is that of no cut, which lies between 0 and 1",
                      "take the linear-edge coefficients")
        return replace(fit, status=status_of([doubt], "converged"))
    return fit


def law_of_fit(fit: Calibration) -> TotalEnergy:
    """Return the law of a fit by `fit_total_energy`; values below zero, within their error of it, are set to zero."""
    numbers = dict(zip(fit.names, fit.values.tolist(), strict=True))
    # An exponent of one would be a force that does not depend on the chip at all.
    return TotalEnergy(numbers["energy"], float(np.clip(numbers["exponent"], 0.0, 0.99)),
                       max(numbers["normal_ratio"], 0.0), max(numbers.get("axial_ratio", 0.0), 0.0))


def forces_of_law(problem: MillingProblem, fit: Calibration, feeds: FloatArray, *, angle: FloatArray, depth: float,
                  directions: int = 3, slices: int = 40) -> FloatArray:
    """Return the forces (n, n_angle, directions) of a fit by `fit_total_energy` at these feeds and angles, N."""
    numbers = dict(zip(fit.names, fit.values.tolist(), strict=True))
    tool = problem.tool.with_runout(numbers.get("runout", problem.tool.runout),
                                    numbers.get("runout_angle", problem.tool.runout_angle), problem.tool.tilt)
    law = law_of_fit(fit)
    courses = [rigid_forces(problem.changed(tool=tool, feed_per_tooth=float(x)), depth,
                            np.asarray(angle) + numbers.get(f"phase_{i + 1}", 0.0), law=law, slices=slices).force
               for i, x in enumerate(feeds)]
    return np.stack(courses)[..., :directions]


@dataclass(frozen=True, eq=False)
class EnergyAtFeeds:
    """Energy per volume and force ratios of each feed by itself, beside a fitted law.

    Parameters
    ----------
    chip : (n,) floats
        Mean chip thickness of each feed, m.
    energy, normal_ratio, axial_ratio : (n,) floats
        Pa at that chip; ratios to the tangential force, the axial one NaN without forces along z.
    """

    chip: FloatArray
    energy: FloatArray
    normal_ratio: FloatArray
    axial_ratio: FloatArray


def energy_at_feeds(problem: MillingProblem, fit: Calibration, feeds: FloatArray, *, angle: FloatArray, measured: FloatArray,
                    depth: float, slices: int = 40) -> EnergyAtFeeds:
    """Return the energies that each feed's own mean revolution gives with the exponent, run-out and phases of a fit.

    angle : (n_angle,) rad from the first sample; measured : (n, n_angle, d) N. A law that holds has all energies on its line.
    """
    numbers = dict(zip(fit.names, fit.values.tolist(), strict=True))
    tool = problem.tool.with_runout(numbers.get("runout", problem.tool.runout),
                                    numbers.get("runout_angle", problem.tool.runout_angle), problem.tool.tilt)
    ways, exponent = measured.shape[2], numbers["exponent"]
    rows = []
    for i, (feed, course) in enumerate(zip(feeds, measured, strict=True)):
        unit = forces_per_coefficient(problem.changed(tool=tool, feed_per_tooth=float(feed)), depth,
                                      angle + numbers.get(f"phase_{i + 1}", 0.0), directions=ways, slices=slices,
                                      exponent=exponent)[:, :ways]
        rows.append(np.linalg.lstsq(unit, course.ravel(), rcond=None)[0])
    chip = np.asarray(feeds) * _mean_sine(problem)
    energies = np.array(rows)
    ratios = energies[:, 1:] / energies[:, :1]
    axial = ratios[:, 1] if ways == 3 else np.full(chip.size, np.nan)
    return EnergyAtFeeds(chip, energies[:, 0] * (chip / REFERENCE_CHIP) ** -exponent, ratios[:, 0], axial)
