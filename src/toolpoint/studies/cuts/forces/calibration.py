"""Cutting coefficients and run-out from measured forces: both fits, their intervals, and doubts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail, one_of, positive
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint._rounding import number_text
from toolpoint.cutting import CuttingCoefficients, MillingProblem
from toolpoint.cutting.build import engagement_of, tool_of
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.description import CuttingDescription, TotalEnergyDescription
from toolpoint.cutting.force.calibration import Calibration, average_force, forces_of_fit, instantaneous
from toolpoint.cutting.force.energy_fit import EnergyAtFeeds, energy_at_feeds, fit_total_energy, forces_of_law, law_of_fit
from toolpoint.cutting.force.turned_fit import fit_turns
from toolpoint.cutting.force.turned_forces import TurnedForces, turn_forces
from toolpoint.studies.cuts.forces.force_doubts import (
    MAX_FORCE_MISFIT,
    NEGLIGIBLE_RESIDUAL_RATIO,
    find_better_tool,
    resample_courses,
    speed_doubts,
    widen_intervals,
)
from toolpoint.studies.cuts.forces.force_records import fold, question_repetition, split_by_feed
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Record

HEADER = ("parameter", "value", "95 % interval", "unit")
PRINTED_PARAMETERS = {"kt": ("K_t", 1e-6, "N/mm^2"), "kn": ("K_n", 1e-6, "N/mm^2"), "ka": ("K_a", 1e-6, "N/mm^2"),
                      "edge_t": ("K_te", 1e-3, "N/mm"), "edge_n": ("K_ne", 1e-3, "N/mm"), "edge_a": ("K_ae", 1e-3, "N/mm"),
                      "energy": ("energy at 1 mm", 1e-6, "N/mm^2"), "exponent": ("exponent", 1.0, ""),
                      "normal_ratio": ("normal ratio", 1.0, ""), "axial_ratio": ("axial ratio", 1.0, ""),
                      "runout": ("run-out", 1e6, "µm"), "runout_angle": ("run-out angle", 180 / np.pi, "deg")}
FIELDS = {"kt": "tangential", "kn": "normal", "ka": "axial", "edge_t": "edge_tangential", "edge_n": "edge_normal",
          "edge_a": "edge_axial"}
MEAN_FORCE_REMARK = ("Mean forces know no run-out, which lifts thin ends of the chip out of the work: what the fitted run-out "
                     "would change "
                     "is in their intervals.")
TOOTH_REMARK = "Tooth 0 is named by the fit: the run-out angle is known up to whole pitches of the teeth."
FIT_SLICES = 40  # of the tool along its axis
TRIAL_ANGLES, TRIAL_SLICES = 90, 12  # angles and slices of trial fits
FIRST_FIT_ANGLES = 120  # of a helical tool's revolution
FORCE_LAWS = ("linear-edge", "total-energy")
MIN_USUAL_KT = 2e7  # Pa: no work material has a smaller K_t, forces in kN or V do


@dataclass(frozen=True)
class CuttingTest:
    """Conditions of a cutting test.

    cut : fields of a CuttingDescription (tool, arc); speed : rev/min; depth : m; feeds : feed per tooth of each file, m;
    force_on : what the forces act on (tool or work); angle : of tooth 0 at the first sample, degrees, None where unknown;
    runout : whether it is fitted; law : one of `FORCE_LAWS`, that of the description.

    Examples
    --------
    >>> test = CuttingTest({"diameter": "10 mm", "teeth": 2}, speed=3000.0, depth=1e-3, feeds=(0.05e-3, 0.1e-3))
    >>> test.force_on
    'tool'
    """

    cut: Mapping[str, Any]
    speed: float
    depth: float
    feeds: tuple[float, ...] | None = None
    force_on: str = "tool"
    angle: float | None = None
    runout: bool = True
    law: str = "linear-edge"


@dataclass(frozen=True, eq=False)
class CalibrationStudy(NotebookText):
    """Both fits of a cutting test, and the course of the forces over a revolution.

    energy : fit of the total-energy law, where it was asked for or the linear-edge law does not explain the forces.
    """

    test: CuttingTest
    description: CuttingDescription
    average: Calibration | None
    fit: Calibration
    feeds: FloatArray
    angle: FloatArray
    measured: FloatArray
    fitted: FloatArray
    names: tuple[str, ...]
    doubts: tuple[Doubt, ...] = ()
    energy: Calibration | None = None

    @cached_property
    def energies(self) -> EnergyAtFeeds | None:
        """Energy per volume and force ratios of each feed by itself, where the total-energy law was fitted."""
        if self.energy is None:
            return None
        angle = self.angle + (0.0 if self.test.angle is None else float(np.radians(self.test.angle)))
        return energy_at_feeds(_problem(self.test)[0], self.energy, self.feeds, angle=angle, measured=self.measured,
                               depth=self.test.depth)

    def to_dict(self) -> dict[str, Any]:
        """Return values and 95 % intervals in SI, for JSON."""
        def numbers(fit: Calibration | None) -> dict[str, Any] | None:
            return None if fit is None else {
                "parameters": {name: {"value": float(v), "interval": ends.tolist() if np.isfinite(ends).all() else None}
                               for name, v, ends in zip(fit.names, fit.values, fit.interval, strict=True)},
                "residual_n": fit.residual, "status": fit.status}
        return {"instantaneous": numbers(self.fit), "average": numbers(self.average),
                "total_energy": numbers(self.energy), "energy_at_feeds": _plain(self.energies), "law": self.test.law,
                "feeds_m": self.feeds.tolist(),
                "doubts": list(self.doubts)}

    @property
    def is_named_by_fit(self) -> bool:
        """Whether the fit alone decides which tooth is tooth 0."""
        return self.test.angle is None and "runout" in self.fit.names and tool_of(self.description).is_regular

    def table(self) -> str:
        """Return both fits as text."""
        lines = [text_table("Forces over rotation", HEADER, fit_rows(self.fit)),
                 f"residual {self.fit.residual:.4g} N, {self.fit.status}"]
        if self.is_named_by_fit:
            lines.append(f"note: {TOOTH_REMARK}")
        if self.energy is not None:
            lines += [text_table("Total energy and force ratios", HEADER, fit_rows(self.energy)),
                      f"residual {self.energy.residual:.4g} N, {self.energy.status}"]
        if self.average is None:
            return "\n".join([*lines, "note: one feed only: no fit of average forces"])
        residual_line = f"residual {self.average.residual:.4g} N, {self.average.status}"
        return "\n".join([*lines, text_table("Average forces", HEADER, fit_rows(self.average)), residual_line,
                          f"note: {MEAN_FORCE_REMARK}"])


def _plain(energies: EnergyAtFeeds | None) -> dict[str, Any] | None:
    """Return energies of feeds as plain data: chip (m), energy (Pa) and the ratios of the other forces to it."""
    if energies is None:
        return None
    ratios = {"normal_ratio": energies.normal_ratio.tolist()}
    if np.isfinite(energies.axial_ratio).all():
        ratios["axial_ratio"] = energies.axial_ratio.tolist()
    return {"chip_m": energies.chip.tolist(), "energy_pa": energies.energy.tolist(), **ratios}


def calibrate(records: Sequence[tuple[str, Record]], test: CuttingTest) -> CalibrationStudy:
    """Fit cutting coefficients and run-out to measured forces.

    records : name and Record of each file, channels Fx, Fy and Fz in N; one feed per tooth each, or with a column ``feed``.

    Examples
    --------
    Runs in ``examples/calibrate_cutting_coefficients.py``.
    """
    check_test(test)
    problem, cut = _problem(test)
    forces = [(feed, part if test.force_on == "tool" else _reverse_forces(part), name)
              for feed, part, name in split_by_feed(records, test.feeds)]
    if test.law == "total-energy" and len({feed for feed, _, _ in forces}) < 2:
        fail("`feed`", "one feed", "must be at least two for the total-energy law, whose exponent is that of the feeds")
    doubts = question_repetition(forces, test.speed, problem.tool.teeth)
    drifting = [] if doubts else speed_doubts(forces, test.speed, problem.tool.teeth)
    result, misfit = _fit_forces(problem, cut, test, forces)
    result, energy_misfit = _with_energy(result, problem, forces, misfit)
    result = replace(result, doubts=(*doubts, *drifting, *_question_signs(result.fit)))
    is_negligible = result.fit.residual < NEGLIGIBLE_RESIDUAL_RATIO * float(np.sqrt(np.mean(result.measured**2)))
    changes_with_chip = not drifting and not is_negligible and misfit > MAX_FORCE_MISFIT >= energy_misfit
    if test.law == "total-energy":
        return _judge_energy(_name_law(result, misfit, is_main=False) if changes_with_chip else result, energy_misfit)
    return _name_law(result, misfit) if changes_with_chip else _judge_fit(result, misfit, bool(drifting))


def _with_energy(result: CalibrationStudy, problem: MillingProblem, records: Sequence[tuple[float, Record, str]],
                 misfit: float) -> tuple[CalibrationStudy, float]:
    """Return the study with its total-energy law where that is asked for or may explain what the linear-edge law does not."""
    test, is_asked = result.test, result.test.law == "total-energy"
    if not is_asked and (not misfit > MAX_FORCE_MISFIT or np.unique(result.feeds).size < 2):
        return result, float("nan")
    turned = [turn_forces(part, test.speed) for _, part, _ in records]
    angle = None if test.angle is None else float(np.radians(test.angle))
    if not is_asked:  # a coarse fit first: most misfits are those of a wrong tool, which no law explains
        trial = fit_total_energy(problem, result.feeds, turned, depth=test.depth, start=result.fit, angle=angle,
                                 slices=TRIAL_SLICES)
        if not trial[1] < misfit:
            return result, trial[1]
    energy, energy_misfit = fit_total_energy(problem, result.feeds, turned, depth=test.depth, start=result.fit, angle=angle,
                                             slices=FIT_SLICES)
    if not is_asked:
        return (replace(result, energy=energy) if energy_misfit < misfit else result), energy_misfit
    fitted = forces_of_law(problem, energy, result.feeds, angle=result.angle + (angle or 0.0), depth=test.depth,
                           directions=result.measured.shape[2])
    return replace(result, energy=energy, fitted=fitted, description=_described_law(result, energy)), energy_misfit


def _described_law(result: CalibrationStudy, energy: Calibration) -> CuttingDescription:
    """Return the description of the cut with the fitted total-energy law in it."""
    law = law_of_fit(energy)
    described = TotalEnergyDescription(law.energy, law.exponent, law.normal_ratio, law.axial_ratio)
    words = f"total-energy law of {result.feeds.size} force records, residual {energy.residual:.3g} N"
    return result.description.with_values({"total_energy": described}).replaced(source=words)


def _judge_energy(result: CalibrationStudy, misfit: float) -> CalibrationStudy:
    """Return the study by the total-energy law, marked and widened where the forces contradict it."""
    assert result.energy is not None
    if not misfit > MAX_FORCE_MISFIT:
        no_scatter = Doubt("residual", "too few revolutions: without a scatter between turns it cannot be judged")
        return replace(result, doubts=(*result.doubts, no_scatter)) if np.isnan(misfit) else result
    doubt = Doubt("residual", f"the total-energy law leaves {misfit:.3g} times the scatter between turns: tool, arc, angles or "
                  "law are not as stated", "the intervals are widened, and may still be too narrow", figure=misfit)
    return replace(result, energy=widen_intervals(result.energy, None, misfit, cause=doubt), doubts=(*result.doubts, doubt))


def _name_law(result: CalibrationStudy, misfit: float, is_main: bool = True) -> CalibrationStudy:
    """Return the study with the doubt that its coefficients change with the chip: the total-energy law explains the forces.

    is_main : whether the doubt is one of the study too, not of the linear-edge fits alone.
    """
    doubt = Doubt("force law", f"the linear-edge law leaves {misfit:.3g} times the scatter between turns, the total-energy law "
                  "explains the forces", "the coefficients hold near these feeds only: take the `law` total-energy",
                  figure=misfit)
    fit = widen_intervals(result.fit, result.average, misfit, cause=doubt)
    means = None if result.average is None else widen_intervals(result.average, result.fit, 1.0, cause=doubt)
    return replace(result, fit=fit, average=means, doubts=(*result.doubts, *([doubt] if is_main else [])))


def _reverse_forces(part: Record) -> Record:
    """Return the forces on the tool from those on the work."""
    return Record(-part.samples, part.sample_rate, part.channels, part.quantities, part.units)


def _judge_fit(result: CalibrationStudy, misfit: float, drifting: bool) -> CalibrationStudy:
    """Return the study with its fit marked and widened where the forces contradict the stated cut."""
    if np.isnan(misfit):
        no_scatter = Doubt("residual", "too few revolutions: without a scatter between turns it cannot be judged")
        return replace(result, doubts=(*result.doubts, no_scatter))
    is_negligible = result.fit.residual < NEGLIGIBLE_RESIDUAL_RATIO * float(np.sqrt(np.mean(result.measured**2)))
    if not drifting and (misfit <= MAX_FORCE_MISFIT or is_negligible):
        return result
    widened = "the intervals are widened, and may still be too narrow"
    doubt = Doubt("spindle speed", "the records say another one", widened, figure=misfit)
    if not drifting:
        alternative = find_better_tool(result.test.cut, lambda cut: _coarse_residual(result, cut),
                                       target_ratio=1.5 * MAX_FORCE_MISFIT / misfit)
        doubt = Doubt("residual", f"it is {misfit:.3g} times the scatter between turns: tool, arc or angles are not as stated",
                      "; ".join([*([alternative] if alternative else []), widened]), figure=misfit)
    fit = widen_intervals(result.fit, result.average, misfit, cause=doubt)
    # Mean forces know no course over the turn: any number of teeth gives them coefficients. They rest on what it refuses.
    means = None if result.average is None else widen_intervals(result.average, result.fit, 1.0, cause=doubt)
    return replace(result, fit=fit, average=means, doubts=(*result.doubts, doubt))


def _coarse_residual(result: CalibrationStudy, cut: Mapping[str, Any]) -> float:
    """Return the residual of the forces over rotation with another tool, N: two feeds, a coarse grid."""
    problem, _ = _problem(replace(result.test, cut=cut))
    ends = sorted({int(np.argmin(result.feeds)), int(np.argmax(result.feeds))})
    angle, forces = resample_courses(result.angle, result.measured[ends], TRIAL_ANGLES)
    begin = angle if result.test.angle is None else angle + np.radians(result.test.angle)
    fit = instantaneous(problem, result.feeds[ends], begin, forces=forces, depth=result.test.depth, runout=result.test.runout,
                        phase="each" if result.test.angle is None else False, slices=TRIAL_SLICES)
    return fit.residual


def check_test(test: CuttingTest) -> None:
    """Refuse a speed or a depth that no cut has, and a force law that is not known."""
    positive("`speed`", test.speed)
    one_of("`law`", test.law, FORCE_LAWS)
    if not 0 < test.depth <= 0.5:
        raise ToolpointError(f"`depth`: {1e3 * test.depth:g} mm; must be above zero and at most 500 mm")


def _problem(test: CuttingTest) -> tuple[MillingProblem, CuttingDescription]:
    """Return a rigid cut of the test's tool and arc, and its description; raises for a tool that is not given."""
    missing_names = [f"`{name}`" for name in ("diameter", "teeth") if name not in test.cut]
    if missing_names:
        raise ToolpointError(f"{' and '.join(missing_names)}: missing; a calibration needs the tool")
    cut = CuttingDescription.of(**test.cut)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    start = CuttingCoefficients(1e9, 3e8)  # not used by the fits; the problem needs one
    return MillingProblem(tool_of(cut), engagement_of(cut), start, rigid), cut


def _fit_forces(problem: MillingProblem, cut: CuttingDescription, test: CuttingTest,
                records: Sequence[tuple[float, Record, str]]) -> tuple[CalibrationStudy, float]:
    """Return both fits and the misfit: a first fit of the mean revolution, then one of every sample at its own angle."""
    feeds, angle, forces = fold(records, test.speed)
    turned = [turn_forces(part, test.speed) for _, part, _ in records]
    known_angle = None if test.angle is None else float(np.radians(test.angle))
    # A straight edge enters and leaves in jumps, which a coarse revolution would misplace; a helical one does not.
    coarse, courses = resample_courses(angle, forces, FIRST_FIT_ANGLES if problem.tool.has_helix else angle.size)
    start = instantaneous(problem, feeds, coarse + (known_angle or 0.0), forces=courses, depth=test.depth, runout=test.runout,
                          phase="each" if known_angle is None else False, slices=TRIAL_SLICES)
    _check_sign(start)
    fit, misfit = fit_turns(problem, feeds, turned, depth=test.depth, start=start, angle=known_angle, slices=FIT_SLICES)
    average = _fit_means(problem, test, feeds, turned, fit)
    for each in (average, fit):
        _check_sign(each)
    fitted = forces_of_fit(problem, fit, feeds, angle=angle + (known_angle or 0.0), depth=test.depth,
                           directions=forces.shape[2],
                           slices=FIT_SLICES)
    k, values_of = fit.coefficients, dict(zip(fit.names, fit.values.tolist(), strict=True))
    values: dict[str, Any] = {FIELDS[name]: getattr(k, name) for name in FIELDS if name in values_of}
    if "runout" in values_of:
        values |= {"runout": values_of["runout"], "runout_angle": values_of["runout_angle"]}
    words = f"calibrated from {feeds.size} force records, residual {fit.residual:.3g} N"
    described = cut.replaced(**values, source=words)
    names = tuple(name for _, _, name in records)
    return CalibrationStudy(test, described, average, fit, feeds, angle, forces, fitted, names), misfit


def _fit_means(problem: MillingProblem, test: CuttingTest, feeds: FloatArray, turned: Sequence[TurnedForces],
               fit: Calibration) -> Calibration | None:
    """Return the fit of mean forces of a tool without run-out; its intervals cover the effect of the fitted run-out."""
    if np.unique(feeds).size < 2:
        return None
    means = np.array([each.mean_turn()[0] for each in turned])
    errors = np.array([each.mean_turn()[1] for each in turned])
    scatter: dict[str, Any] = {"errors": errors, "freedom": sum(each.turns - 1 for each in turned)}
    if not np.isfinite(errors).all():
        scatter = {}
    without_runout = replace(problem, tool=problem.tool.with_runout(0.0))
    average = average_force(without_runout, feeds, means, depth=test.depth, **scatter)
    offset = dict(zip(fit.names, fit.values.tolist(), strict=True))
    if "runout" not in offset:
        return average
    with_runout = replace(problem, tool=problem.tool.with_runout(offset["runout"], offset["runout_angle"]))
    change = average_force(with_runout, feeds, means, depth=test.depth, **scatter).values - average.values
    return replace(average, covariance=average.covariance + np.diag(change**2))


def _check_sign(fit: Calibration | None) -> None:
    """Raise ToolpointError for a fitted K_t (Pa) that is not positive: forces or axes are turned round."""
    if fit is not None and fit.values[0] <= 0:
        raise ToolpointError(f"forces: the fitted K_t is {fit.values[0] / 1e6:.4g} N/mm^2; must be above zero; forces measured "
                             "on the workpiece need `force_on` work; check the axes (x along the feed), `direction` and `feed`")


def _question_signs(fit: Calibration) -> list[Doubt]:
    """Return the doubt that a K_t is too small for any material, or that K_n (Pa) is negative."""
    values = dict(zip(fit.names, fit.values.tolist(), strict=True))
    if values["kt"] < MIN_USUAL_KT:
        return [Doubt("K_t", f"{values['kt'] / 1e6:.3g} N/mm^2 is less than any work material has", "forces must be in N (not "
                      "kN or V), `depth` and `feed` in mm")]
    return [Doubt("K_n", "is below zero, which no usual edge has", "check the directions of the forces (x along the feed), "
                  "`direction`, `immersion` and `speed`")] if values.get("kn", 0.0) < 0 else []


def fit_rows(fit: Calibration) -> list[list[str]]:
    """Return rows (parameter, value, 95 % interval, unit) in shop units; the phases of the records are left out."""
    result = []
    for name, value, (lower, upper) in zip(fit.names, fit.values, fit.interval, strict=True):
        if name in PRINTED_PARAMETERS:
            label, factor, unit = PRINTED_PARAMETERS[name]
            half_width = factor * (upper - lower) / 2
            ends = f"{number_text(factor * lower, half_width)} .. {number_text(factor * upper, half_width)}"
            result.append([label, number_text(factor * value, half_width), ends if np.isfinite(half_width) else "not known",
                           unit])
    return result
