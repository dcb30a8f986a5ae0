"""Tools as shafts on the drawn machines of a project."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.cutting.description import CuttingDescription
from toolpoint.machine import Machine
from toolpoint.machine.attached_tool import attach_tool
from toolpoint.project.limits.systems import MachineDraws, Pose, log_peak, problem_of
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.machine_uncertainty import machine_uncertainty
from toolpoint.substructuring.receptance import is_uncertain_shaft
from toolpoint.substructuring.shaft import ShaftDescription

SHARE_DRAWS = 24  # shafts that are drawn for the tool's share of an interval
_SHAFT_STREAM = 1  # of the random numbers, beside those of the machines


@dataclass(frozen=True, eq=False)
class AttachedToolDraws:
    """Machines drawn from their covariance, each with a shaft drawn within its own deviations at one of its points.

    machine : without the shaft; stick_out : m, of the shaft, for the words.
    """

    machine: Machine
    count: int
    seed: int
    point: str
    shaft: ShaftDescription
    stick_out: float

    @cached_property
    def attached(self) -> Machine:
        """The likeliest machine with the shaft as its file says it."""
        return attach_tool(self.machine, self.point, self.shaft)

    @cached_property
    def samples(self) -> tuple[Machine, ...]:
        """The drawn machines with their shafts; the machines are those that `MachineDraws` of this seed gives."""
        if not is_uncertain_shaft(self.shaft) and machine_uncertainty(self.machine) is None:
            return (self.attached,) * self.count
        machines = MachineDraws(self.machine, self.count, self.seed).samples
        return tuple(attach_tool(machine, self.point, shaft)
                     for machine, shaft in zip(machines, self._shafts(self.count), strict=True))

    def _shafts(self, count: int) -> list[ShaftDescription]:
        generator = np.random.default_rng([self.seed, _SHAFT_STREAM])
        return [self.shaft.drawn(generator) if is_uncertain_shaft(self.shaft) else self.shaft for _ in range(count)]

    def nominal(self, pose: Pose) -> ToolDynamics:
        """Return the dynamics of the likeliest machine with the shaft."""
        return machine_dynamics(self.attached, pose)

    def drawn(self, pose: Pose) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws."""
        return [machine_dynamics(sample, pose) for sample in self.samples]

    def shares(self, pose: Pose, cut: CuttingDescription) -> dict[str, float]:
        """Return the shares of joints, bodies and the tool in the variance of the tool's greatest dynamic compliance."""
        variances = self._machine_variances(pose, cut)
        if is_uncertain_shaft(self.shaft):
            machines = [attach_tool(self.machine, self.point, shaft) for shaft in self._shafts(SHARE_DRAWS)]
            variances["tool"] = float(np.var([self._peak(machine, pose, cut) for machine in machines]))
        total = sum(variances.values())
        return {part: size / total for part, size in variances.items()} if total > 0 else {}

    def _machine_variances(self, pose: Pose, cut: CuttingDescription) -> dict[str, float]:
        uncertainty = machine_uncertainty(self.attached)
        if uncertainty is None:
            return {}
        spread = uncertainty.spread(lambda sample: self._peak(sample, pose, cut))
        return {part: max(float(share[0]), 0.0) for part, share in spread.shares.items()}

    @staticmethod
    def _peak(machine: Machine, pose: Pose, cut: CuttingDescription) -> FloatArray:
        return log_peak(problem_of(machine_dynamics(machine, pose), cut))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts of the machine's numbers, and that the tip is a prediction."""
        return (*MachineDraws(self.machine, self.count, self.seed).doubts, prediction_doubt(self.stick_out))


def prediction_doubt(stick_out: float) -> Doubt:
    """Return the doubt that a coupled tip was never struck; stick_out : m."""
    return Doubt(f"stick-out {1e3 * stick_out:.4g} mm", "the tip is coupled from the shaft file of the tool; no tool was "
                 "struck at this length", "tap it before the cut is relied on")
