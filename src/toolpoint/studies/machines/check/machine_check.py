"""Check of a machine: the machine in words, its assumptions, and doubts about its numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.cutting.build import words
from toolpoint.machine import Machine
from toolpoint.machine.frequencies.measured_reference import question_reference
from toolpoint.studies.machines.check.cut_doubts import question_cut
from toolpoint.studies.machines.check.machine_beliefs import question_units
from toolpoint.studies.machines.check.machine_doubts import question_machine
from toolpoint.studies.machines.check.machine_drawing import describe_assumed, describe_travel, draw_chain
from toolpoint.studies.machines.check.machine_words import describe_motion
from toolpoint.studies.machines.check.place_doubts import question_places
from toolpoint.studies.machines.check.ratio_doubts import question_ratios
from toolpoint.studies.machines.check.reduced_bodies import question_reduction
from toolpoint.studies.machines.check.robot_doubts import question_arm
from toolpoint.studies.machines.check.size_doubts import question_sizes
from toolpoint.studies.machines.check.spring_doubts import question_springs
from toolpoint.studies.machines.check.travel_doubts import describe_signs, question_travel


@dataclass(frozen=True)
class CheckedMachine(NotebookText):
    """Checked machine: doubts first, then the machine in words, then its assumptions.

    chain, travel, motion : in words; cutting : the described cut, None without one; reduction : its errors.
    """

    machine: str
    coordinates: int
    doubts: tuple[Doubt, ...]
    chain: tuple[str, ...]
    travel: tuple[str, ...]
    motion: tuple[str, ...]
    cutting: str | None
    assumed: tuple[str, ...]
    reduction: tuple[str, ...] = ()

    def table(self) -> str:
        """Return all of it as lines."""
        lines = mark_notes(self.doubts)
        lines += [*self.chain, *self.travel, *self.motion]
        lines += self.reduction
        lines += [] if self.cutting is None else [f"cutting: {self.cutting}"]
        count = len(self.doubts)
        lines += [*self.assumed, f"{count or 'no'} {'doubt' if count == 1 else 'doubts'}, no faults"]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {"ok": True, "kind": "machine", "doubts": list(self.doubts), "coordinates": self.coordinates,
                "cutting": self.cutting, "motion": list(self.motion), "chain": list(self.chain), "travel": list(self.travel),
                "assumed": list(self.assumed), "reduction": list(self.reduction)}


def check_machine(machine: Machine, further: tuple[Doubt, ...] = ()) -> CheckedMachine:
    """Return the machine in words with all doubts.

    Doubts that its file states come first, then `further` (a robot's inertias).

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> joint = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 2e7, "z": 4e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}))
    >>> check_machine(machine).coordinates
    3
    """
    cut = machine.description.cutting
    reduction_doubts, reduction = question_reduction(machine)
    stated = dict.fromkeys((*machine.description.doubts, *question_reference(machine)))
    file_doubts = (*stated, *further, *question_machine(machine), *question_units(machine))
    said = {doubt.what for doubt in file_doubts}
    number_doubts = (*question_springs(machine), *question_sizes(machine), *question_travel(machine),
                     *(() if cut is None else question_cut(cut)))
    # the plainer one of two about a part
    coarse_doubts = (*file_doubts, *(doubt for doubt in number_doubts if doubt.what not in said))
    said |= {doubt.what for doubt in coarse_doubts}
    fine_doubts = (*question_ratios(machine), *question_places(machine), *(() if coarse_doubts else question_arm(machine)))
    doubts = (*coarse_doubts, *(doubt for doubt in fine_doubts if doubt.what not in said), *reduction_doubts)
    return CheckedMachine(machine.name, machine.size, doubts,
                        draw_chain(machine), describe_travel(machine), (*describe_motion(machine), *describe_signs(machine)),
                        None if cut is None else words(cut), describe_assumed(machine), reduction)
