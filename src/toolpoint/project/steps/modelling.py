"""Steps of models: modes to joints and a machine file, an update of a drawn machine, a look at the machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint import io, studies
from toolpoint._check import ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.io.faults import FileFaults
from toolpoint.machine import Machine
from toolpoint.machine.description import IdentifiedDescription
from toolpoint.machine.description.project_plan import ContourGoal
from toolpoint.project.engine.step import StepOutcome
from toolpoint.project.steps.plain_files import write_json
from toolpoint.studies.measured.measured_update import MeasuredUpdate
from toolpoint.studies.servos.circle_study import STRUCTURE_DOUBT

LISTED_CAUSES = 3  # doubts in the error of a machine that cannot be read back
POSE_TOLERANCE = 1e-6  # m or rad, between the pose of a test in two files
_EXACT_NUMBERS_DOUBT = Doubt(
    "interval of the limits", "masses, damping and all numbers that the update did not move count as exact",
    "identify the machine from its test (components, geometry) where their uncertainty matters")


def find_joints(folder: Path, modes: Path, geometry: Path, *, components: Path, pose: Mapping[str, float]) -> StepOutcome:
    """Write the joints of a machine (joints.json) and the machine of them (machine.yaml), read back and run beside its test.

    Raises ToolpointError where the test was made at another pose than the component file says.
    """
    described = io.read_components(components)
    for axis, position in pose.items():
        if axis not in described.axes:
            fail("pose of the test", axis, f"must be an axis of the component file: {', '.join(described.axes) or 'none'}")
        at_test = described.axes[axis].at_reference
        if abs(at_test - position) > POSE_TOLERANCE:
            fail("pose of the test", f"{axis} at {position:g}", f"the component file says at_test {at_test:g}",
                 remedy="a record of another pose? mend the pose in project.yaml, or at_test in the component file")
    result = studies.study_joints(io.read_modes(modes), io.read_geometry(geometry), described)
    if result.machine is None:
        raise ToolpointError(f"joints were found, a machine was not: {result.no_machine_reason}")
    io.write_machine(result.machine, folder / "machine.yaml")
    result = result.compared(_read_back(folder / "machine.yaml", result.doubts))
    write_json(folder / "joints.json", result.to_dict())
    return StepOutcome(result.status, result.doubts)


def _read_back(path: Path, doubts: Sequence[Doubt]) -> Machine:
    """Return the machine of identified joints from its file; raises ToolpointError, with what the joints doubt, where a number
    is none of a machine."""
    try:
        return io.read_machine(path)
    except FileFaults as error:
        faults = "; ".join(f"{fault.path}: {fault.message}" if fault.path else fault.message for fault in error.faults)
        causes = "; ".join(doubts[:LISTED_CAUSES]) or "none"
        raise ToolpointError(f"joints were found, but no machine can be made of them ({faults}): the test does not determine "
                             f"these numbers. Mend what the joints doubt first: {causes}") from None


def update_model(folder: Path, machine: Path, modes: Sequence[Path], *, poses: Sequence[Mapping[str, float]],
                 drift: Path | None = None) -> StepOutcome:
    """Write the machine file that agrees with measured modes at their poses (machine.yaml, update.json).

    drift : of the tests, whose doubts this step inherits.
    """
    built = io.read_machine_at(machine, *poses)
    measured = studies.pair_measurements([io.read_modes(path) for path in modes], [], poses)
    result = studies.update_machine(built, measured, what=", ".join(path.parent.name for path in modes))
    identified = _identified_numbers(result)
    io.write_machine(replace(result.machine.description, identified=identified), folder / "machine.yaml")
    write_json(folder / "update.json", result.to_dict())
    doubts = result.doubts if identified is None else (*result.doubts, _EXACT_NUMBERS_DOUBT)
    return StepOutcome(result.update.fit.status, doubts)


def _identified_numbers(result: MeasuredUpdate) -> IdentifiedDescription | None:
    """Return the numbers that the update moved with their covariance, None where it is not known."""
    fit = result.update.fit
    deviations = np.array([fit.standard_error.get(name, np.nan) for name in fit.free])
    if not fit.free or not np.isfinite(deviations).all() or not np.isfinite(fit.covariance).all():
        return None
    # The covariance is of the fit's coordinates; correlations are those of the numbers to first order.
    covariance = fit.correlations * np.outer(deviations, deviations)
    rows = tuple(tuple(float(f"{value:.9g}") for value in row[:number + 1]) for number, row in enumerate(covariance))
    return IdentifiedDescription(fit.free, rows, "update to measured modes")


def look_at_machine(folder: Path, machine: Path, drift: Path | None = None) -> StepOutcome:
    """Write what a machine file says and what looks odd in it (machine.json).

    drift : of its tests, whose doubts this step and all that rest on it inherit.
    """
    built = io.read_machine(machine)
    result = studies.check_machine(built, ())
    identified = built.description.identified
    data = {**result.to_dict(), "identified_numbers": 0 if identified is None else len(identified.parameters)}
    write_json(folder / "machine.json", data)
    return StepOutcome(f"{built.name}: {len(built.bodies)} bodies, {built.size} coordinates, axes "
                       f"{', '.join(axis.name for axis in built.chain.axes) or 'none'}", result.doubts)


def follow_circle(folder: Path, servo: Path, machine: Path | None = None, *, goal: Mapping[str, Any],
                  is_structure_known: bool = False) -> StepOutcome:
    """Write how a servo follows a circle (contour.json): the radial deviation beside the goal, and what would meet it.

    machine : whose structure the drives push against; is_structure_known : whether the project has a machine on which these
    drives do not end, which is doubted.
    """
    circle = ContourGoal(**{**goal, "axes": tuple(goal["axes"])})
    built = None if machine is None else io.read_machine_at(machine, circle.pose)
    result = studies.study_circle(io.read_drives(servo), circle, machine=built)
    write_json(folder / "contour.json", result.to_dict())
    return StepOutcome(result.status, (*result.doubts, *((STRUCTURE_DOUBT,) if is_structure_known and built is None else ())))
