"""Tips of the tools of a program: those that were struck or coupled by themselves, and shafts on the spindle of the machine."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, place_note
from toolpoint.machine import Machine
from toolpoint.machine.attached_tool import attach_tool
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.vibration import Frf


@dataclass(frozen=True, eq=False)
class ToolTips:
    """Responses of tools, by their number, that are not the tool of the machine or the tap.

    struck : tips that were measured or coupled elsewhere, the same at every pose; shafts : of tools that begin at `point` of
    the machine, as beams of it at every pose.

    Raises ToolpointError for a tool in both, and for shafts without a point.

    Examples
    --------
    >>> from toolpoint.substructuring import SegmentDescription
    >>> ToolTips(shafts={3: ShaftDescription({"rod": SegmentDescription(0.1, 0.02)})}, point="nose").numbers
    (3,)
    """

    struck: Mapping[int, ToolDynamics] = field(default_factory=dict)
    shafts: Mapping[int, ShaftDescription] = field(default_factory=dict)
    point: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "_machines", {})
        twice = sorted(set(self.struck) & set(self.shafts))
        if twice:
            raise ToolpointError(f"tool {twice[0]}: has a response and a shaft; must be one of them")
        if self.shafts and not self.point:
            raise ToolpointError("shafts: need the point of the machine where a tool begins")

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the tools that have a tip of their own."""
        return tuple(sorted({*self.struck, *self.shafts}))

    def dynamics_of(self, tool: int, stand: ToolDynamics) -> ToolDynamics:
        """Return the dynamics of a tool; stand : those of the machine at a pose, or of the tap.

        Raises ToolpointError for a shaft where no machine is known.
        """
        if tool in self.struck:
            return self.struck[tool]
        if tool not in self.shafts:
            return stand
        if stand.machine is None:
            raise ToolpointError(f"tool {tool}: its shaft needs a machine to be coupled to; give one, or couple it to a struck "
                                 "gauge (toolpoint rcsa) and give its response")
        return machine_dynamics(self._attached(stand.machine, tool), stand.pose)

    def _attached(self, machine: Machine, tool: int) -> Machine:
        """Return the machine with a tool, made once."""
        machines: dict[tuple[int, int], tuple[Machine, Machine]] = vars(self)["_machines"]
        key = id(machine), tool
        if key not in machines:  # the machine is kept beside it: its number is not given to another one then
            machines[key] = machine, attach_tool(machine, self.point, self.shafts[tool])
        return machines[key][1]

    def notes(self, poses: Sequence[ToolDynamics], numbers: Sequence[int]) -> list[str]:
        """Return the notes of the tips of those tools at the first pose, each with its tool."""
        return [place_note(note, f"tool {tool}") for tool in self.numbers if tool in numbers
                for note in self.dynamics_of(tool, poses[0]).notes]

    def doubts(self, setup: MachiningSetup, numbers: Sequence[int], stand: ToolDynamics) -> list[Doubt]:
        """Return the doubts that one response stands for several tools, and that a struck tip stands at every pose.

        numbers : of the tools that cut; stand : the response that stands for those without a tip of their own.
        """
        foreign = [n for n in numbers if n not in self.numbers and _is_foreign(n, setup, numbers, stand)]
        doubts = []
        if foreign:
            doubts.append(Doubt("response of the tips", f"tools {', '.join(map(str, foreign))} are given the response of the "
                                "tool that the machine or the tap describes", "give each its own: its struck tip, or its shaft "
                                "on the machine's spindle"))
        fixed = [n for n in numbers if n in self.struck]
        if fixed and stand.machine is not None:
            doubts.append(Doubt("pose of the tips", f"tools {', '.join(map(str, fixed))} have one response all along the "
                                "program, that of the pose where it was taken", "give their shafts, to be coupled at every "
                                "pose"))
        return doubts

    @property
    def identity(self) -> str:
        """Key of these tips among others."""
        digest = hashlib.sha256(repr((self.point, sorted((n, repr(s.segments)) for n, s in self.shafts.items()))).encode())
        for number, tip in sorted(self.struck.items()):
            digest.update(repr((number, tip.x, tip.y)).encode())
            values = tip.response.values if isinstance(tip.response, Frf) else tip.response.shape
            digest.update(np.ascontiguousarray(tip.response.frequency).tobytes() + np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()


def _is_foreign(tool: int, setup: MachiningSetup, numbers: Sequence[int], stand: ToolDynamics) -> bool:
    """Whether a tool that is described by its number may be another one than that of the response."""
    if tool not in setup.cuts:
        return False
    described = None if stand.machine is None else stand.machine.description.cutting
    return len(numbers) > 1 or (described is not None and described.tool != setup.cuts[tool].tool)
