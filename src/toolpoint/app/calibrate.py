"""Cutting coefficients and run-out from measured forces: the table, the page, the section of a machine file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, positive
from toolpoint.app import console, force_records
from toolpoint.cutting import CuttingCoefficients, MillingProblem
from toolpoint.cutting.build import engagement_of, tool_of
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.calibration import Calibration, average_force, fitted_forces, instantaneous
from toolpoint.io.yaml import machine_file
from toolpoint.plot import Chart, Notes, Report, Table
from toolpoint.plot.figures.calibration import fitted_forces as fitted_chart
from toolpoint.plot.figures.calibration import mean_forces

SHOWN = {"kt": ("K_t", 1e-6, "N/mm^2"), "kn": ("K_n", 1e-6, "N/mm^2"), "ka": ("K_a", 1e-6, "N/mm^2"),
         "edge_t": ("K_te", 1e-3, "N/mm"), "edge_n": ("K_ne", 1e-3, "N/mm"), "edge_a": ("K_ae", 1e-3, "N/mm"),
         "runout": ("run-out", 1e6, "um"), "runout_angle": ("run-out angle", 180 / np.pi, "deg")}
FIELDS = {"kt": "tangential", "kn": "normal", "ka": "axial", "edge_t": "edge_tangential", "edge_n": "edge_normal",
          "edge_a": "edge_axial"}
BLIND = "Mean forces know no run-out: where it lifts an edge out of the work, they are off by more than their intervals."
NAMED = "Tooth 0 is named by the fit: the run-out angle is known up to whole pitches of the teeth."
CHARTS = 8
SLICES = 40
LEAST = 2e7  # Pa, of K_t


@dataclass(frozen=True)
class CuttingTest:
    """What was cut: fields of a CuttingDescription (tool, arc), speed (rev/min), depth (m), feed per tooth of each file (m),
    what the forces act on (tool or work), angle of tooth 0 at the first sample (degrees, None: unknown), run-out fitted."""

    cut: Mapping[str, Any]
    speed: float
    depth: float
    feeds: tuple[float, ...] | None = None
    force_on: str = "tool"
    angle: float | None = None
    runout: bool = True


@dataclass(frozen=True, eq=False)
class Calibrated:
    """Both fits of a cutting test, and the course of the forces over a revolution."""

    description: CuttingDescription
    average: Calibration | None
    fit: Calibration
    feeds: FloatArray
    angle: FloatArray
    measured: FloatArray
    fitted: FloatArray
    names: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return values and 95 % intervals in SI, for JSON."""
        def one(fit: Calibration | None) -> dict[str, Any] | None:
            return None if fit is None else {
                "parameters": {name: {"value": float(v), "interval": list(map(float, ends))}
                               for name, v, ends in zip(fit.names, fit.values, fit.interval, strict=True)},
                "residual_n": fit.residual, "status": fit.status}
        return {"instantaneous": one(self.fit), "average": one(self.average), "feeds_m": self.feeds.tolist()}


def calibrate(files: Sequence[Path], test: CuttingTest, output: str | Path = "toolpoint-report",
              yaml_file: Path | None = None, quiet: bool = False) -> Calibrated:
    """Fit coefficients and run-out to measured forces, print them, and write the page and the section of a machine file."""
    positive("--speed", test.speed)
    if not 0 < test.depth <= 0.5:
        raise ToolpointError(f"--depth: {1e3 * test.depth:g} mm; must be above zero and at most 500 mm")
    if yaml_file is not None and not Path(yaml_file).parent.is_dir():
        raise ToolpointError(f"--yaml {yaml_file}: the folder {Path(yaml_file).parent} does not exist; create it first")
    with console.collected_warnings() as warnings, console.steps(3, quiet) as step:
        step("forces")
        problem, cut = _problem(test)
        records = force_records.by_feed(files, test.feeds)
        step("fit")
        warnings += force_records.doubts(records, test.speed, problem.tool.teeth)
        found = _fitted(problem, cut, test, records)
        warnings += _negative(found.fit)
        step("page")
        page = _page(found, test)
        path = (page if not warnings else page.with_section("Remarks", Notes(warnings, "warning"))).save(output)
    if yaml_file is not None:
        machine_file.write_cutting(found.description, yaml_file)
    if not quiet:
        _print(found, test, yaml_file)
        for text in warnings:
            console.ERR.print("warning: " + text, markup=False, style="yellow")
        console.OUT.print(f"Page written: {path}", markup=False)
    return found


def _problem(test: CuttingTest) -> tuple[MillingProblem, CuttingDescription]:
    missing = [f"--{name}" for name in ("diameter", "teeth") if name not in test.cut]
    if missing:
        raise ToolpointError(f"{' and '.join(missing)}: missing; a calibration needs the tool")
    cut = CuttingDescription.of(**test.cut)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    start = CuttingCoefficients(1e9, 3e8)  # not used by the fits; the problem needs one
    return MillingProblem(tool_of(cut), engagement_of(cut), start, rigid), cut


def _fitted(problem: MillingProblem, cut: CuttingDescription, test: CuttingTest,
            records: Sequence[tuple[float, Any, str]]) -> Calibrated:
    feeds, angle, forces = force_records.folded(records, test.speed)
    forces = -forces if test.force_on == "work" else forces
    average = average_force(problem, feeds, forces.mean(1), test.depth) if np.unique(feeds).size > 1 else None
    _check_sign(average)
    begin = angle if test.angle is None else angle + np.radians(test.angle)
    fit = instantaneous(problem, feeds, begin, forces, test.depth, test.runout,
                        "each" if test.angle is None else False, SLICES)
    _check_sign(fit)
    fitted = fitted_forces(problem, fit, feeds, begin, test.depth, forces.shape[2], SLICES)
    k, found = fit.coefficients, dict(zip(fit.names, fit.values.tolist(), strict=True))
    values: dict[str, Any] = {FIELDS[name]: getattr(k, name) for name in FIELDS if name in found}
    if "runout" in found:
        values |= {"runout": found["runout"], "runout_angle": found["runout_angle"]}
    words = f"calibrated from {feeds.size} force records, residual {fit.residual:.3g} N"
    described = cut.replaced(**values, source=words)
    return Calibrated(described, average, fit, feeds, angle, forces, fitted, tuple(name for _, _, name in records))


def _check_sign(fit: Calibration | None) -> None:
    if fit is not None and fit.values[0] <= 0:
        raise ToolpointError(f"forces: the fitted K_t is {fit.values[0] / 1e6:.4g} N/mm^2; must be above zero; forces measured "
                             "on the workpiece need --force-on work; check the axes (x along the feed), --direction and --feed")


def _negative(fit: Calibration) -> list[str]:
    found = dict(zip(fit.names, fit.values.tolist(), strict=True))
    if found["kt"] < LEAST:
        return [f"K_t of {found['kt'] / 1e6:.3g} N/mm^2 is less than any work material has: forces must be in N (not kN or V), "
                "--depth and --feed in mm"]
    return ["K_n is below zero, which no usual edge has: check the directions of the forces (x along the feed), --direction, "
            "--immersion and --speed"] if found.get("kn", 0.0) < 0 else []


def rows(fit: Calibration) -> list[list[str]]:
    """Return rows (parameter, value, 95 % interval, unit) in shop units; the phases of the records are left out."""
    result = []
    for name, value, (low, high) in zip(fit.names, fit.values, fit.interval, strict=True):
        if name in SHOWN:
            label, factor, unit = SHOWN[name]
            result.append([label, f"{factor * value:.5g}", f"{factor * low:.5g} .. {factor * high:.5g}", unit])
    return result


_HEADER = ["parameter", "value", "95 % interval", "unit"]


def _is_named_by_fit(found: Calibrated, test: CuttingTest) -> bool:
    return test.angle is None and "runout" in found.fit.names and tool_of(found.description).is_regular


def _print(found: Calibrated, test: CuttingTest, yaml_file: Path | None) -> None:
    console.table("Forces over rotation", _HEADER, rows(found.fit))
    console.OUT.print(f"residual {found.fit.residual:.4g} N, {found.fit.status}", markup=False)
    if _is_named_by_fit(found, test):
        console.OUT.print(f"note: {NAMED}", markup=False)
    if found.average is not None:
        console.table("Average forces", _HEADER, rows(found.average))
        rest = f"residual {found.average.residual:.4g} N, {found.average.freedom} degrees of freedom"
        console.OUT.print(rest, markup=False)
        console.OUT.print(f"note: {BLIND}", markup=False)
    else:
        console.OUT.print("note: one feed only: no fit of average forces", markup=False)
    if yaml_file is not None:
        console.OUT.print(f"Section 'cutting' written: {yaml_file}", markup=False)


def _page(found: Calibrated, test: CuttingTest) -> Report:
    tool = tool_of(found.description)
    report = Report("Calibration of cutting coefficients", f"{tool!r}, {engagement_of(found.description)!r}",
                    subtitle=f"{test.speed:g} rev/min, depth {1e3 * test.depth:g} mm, {found.feeds.size} records")
    report = report.with_section(
        "Coefficients and run-out", f"Fit of the forces over rotation; residual {found.fit.residual:.4g} N, "
        f"{found.fit.status}." + (f" {NAMED}" if _is_named_by_fit(found, test) else ""), Table(_HEADER, rows(found.fit)))
    if found.average is not None:
        mean, model = found.measured.mean(1), found.fitted.mean(1)
        words = f"Fit of the mean forces over feed. {BLIND} The lines are those of the fit over rotation."
        report = report.with_section("Average forces", words, Table(_HEADER, rows(found.average)),
                                     Chart(mean_forces(found.feeds, mean, model), name="means"))
    charts = [Chart(fitted_chart(found.angle, found.measured[i], found.fitted[i], f"{name}, {1e3 * feed:g} mm a tooth"),
                    name=f"forces{i}")
              for i, (feed, name) in enumerate(zip(found.feeds[:CHARTS], found.names, strict=False))]
    return report.with_section("Measured and fitted forces", "Forces on the tool over one revolution, the mean of all whole "
                               "revolutions of the record.", *charts)
