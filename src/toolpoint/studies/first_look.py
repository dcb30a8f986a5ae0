"""First look at a machine, at measured responses, or at both: the machine's modes and lobes, the lobes of the data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.machine import Machine
from toolpoint.studies.cuts.measured_response import MeasuredResponse, study_responses
from toolpoint.studies.machines.machine_report import MachineReport, study_machine
from toolpoint.vibration import Frf


@dataclass(frozen=True, eq=False)
class FirstLook(NotebookText):
    """The study of a machine, that of measured responses, or both; None where there is none."""

    machine: MachineReport | None
    measured: MeasuredResponse | None

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions on the measured responses, and results that could not be computed of them."""
        return () if self.measured is None else self.measured.notes

    def table(self) -> str:
        """Return the tables of both as text."""
        return "\n".join(part.table() for part in (self.machine, self.measured) if part is not None)

    def to_dict(self) -> dict[str, Any]:
        """Return both as plain data, None where there is none."""
        return {"machine": None if self.machine is None else self.machine.to_dict(),
                "measured": None if self.measured is None else self.measured.to_dict()}


def study_machine_and_responses(machine: Machine | None = None, frf: Frf | None = None, *,
                                pose: Mapping[str, float] | None = None, band: tuple[float, float] | None = None,
                                method: StabilityMethod | None = None,
                                step: Callable[[str], None] = lambda name: None) -> FirstLook:
    """Return modes, responses and lobes of a machine, and modes and lobes of measured responses in the machine's cut.

    pose : of the machine (m, rad); its described poses where left out; band : Hz, of the measured lines; method : of the
    machine's lobes, the exact engine where left out.
    Raises ToolpointError where neither is given.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7, "z": 4e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> look = study_machine_and_responses(build(MachineDescription("slide", {"head": head}, {"slide": joint})))
    >>> look.machine.frequency.round(2).tolist(), look.machine.gaps  # sqrt(k/m)/(2 pi)
    ([50.33, 71.18, 100.66], ("No tool-point FRFs: the machine file names no 'tool' point.",))
    """
    if machine is None and frf is None:
        raise ToolpointError("first look: neither a machine nor responses given; needs at least one of them")
    studied = None if machine is None else study_machine(machine, pose, step=step, method=method)
    if frf is None:
        return FirstLook(studied, None)
    step("measured responses")
    return FirstLook(studied, study_responses(frf, None if machine is None else machine.description.cutting, band))
