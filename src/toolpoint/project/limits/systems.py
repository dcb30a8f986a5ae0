"""Systems that the tests allow: machines drawn from their covariance, or tips from the scatter of their hits."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.description import CuttingDescription, SpeedVariationDescription
from toolpoint.machine import Machine
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.machine_uncertainty import machine_uncertainty
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.testing.tap_dynamics import TappedTip

PEAK_SHARE_LINES = 400  # lines between half of the lowest and twice the highest frequency of the cutting plane
Pose = Mapping[str, float]


class DrawnSystems(Protocol):
    """Systems that a project's tests allow: the likeliest, and draws that are the same at every pose and for every cut."""

    @property
    def count(self) -> int:
        """Number of draws."""
        ...

    @property
    def seed(self) -> int:
        """Seed of the draws."""
        ...

    def nominal(self, pose: Pose) -> ToolDynamics:
        """Return the dynamics of the likeliest system."""
        ...

    def drawn(self, pose: Pose) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws."""
        ...

    def shares(self, pose: Pose, cut: CuttingDescription) -> dict[str, float]:
        """Return what share of the systems' part of an interval each source brings; they add up to 1, empty without any."""
        ...

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the spread of the draws."""
        ...


@dataclass(frozen=True, eq=False)
class MachineDraws:
    """Machines drawn from the covariance of identified numbers; all are the same machine where there is none."""

    machine: Machine
    count: int
    seed: int

    @cached_property
    def samples(self) -> tuple[Machine, ...]:
        """The drawn machines."""
        uncertainty = machine_uncertainty(self.machine)
        if uncertainty is None:
            return (self.machine,) * self.count
        return tuple(uncertainty.samples(self.count, np.random.default_rng(self.seed)))

    def nominal(self, pose: Pose) -> ToolDynamics:
        """Return the dynamics of the machine as its file says it."""
        return machine_dynamics(self.machine, pose)

    def drawn(self, pose: Pose) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws."""
        return [machine_dynamics(sample, pose) for sample in self.samples]

    def shares(self, pose: Pose, cut: CuttingDescription) -> dict[str, float]:
        """Return the shares of joints and bodies in the variance of the tool's greatest dynamic compliance, to first order."""
        uncertainty = machine_uncertainty(self.machine)
        if uncertainty is None:
            return {}
        spread = uncertainty.spread(lambda sample: log_peak(problem_of(machine_dynamics(sample, pose), cut)))
        sizes = {part: max(float(share[0]), 0.0) for part, share in spread.shares.items()}
        total = sum(sizes.values())
        return {part: size / total for part, size in sizes.items()} if total > 0 else {}

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubt where the machine's numbers have no stated uncertainty."""
        if machine_uncertainty(self.machine) is not None:
            return ()
        return (Doubt("interval of the limits", "the machine file states no uncertainty of its numbers: the interval is of the "
                      "cutting coefficients alone", "identify the machine from a test (tests, components, geometry)"),)


@dataclass(frozen=True, eq=False)
class TipDraws:
    """Tips drawn from the scatter of the hits; poses play no part."""

    tip: TappedTip
    count: int
    seed: int

    def nominal(self, pose: Pose) -> ToolDynamics:
        """Return the dynamics of the tip as measured."""
        return self.tip.dynamics()

    def drawn(self, pose: Pose) -> Sequence[ToolDynamics]:
        """Return the dynamics of all draws."""
        rng = np.random.default_rng(self.seed)
        return [self.tip.drawn(rng) for _ in range(self.count)]

    def shares(self, pose: Pose, cut: CuttingDescription) -> dict[str, float]:
        """Return the one source of draws."""
        return {"hits on the tip": 1.0}

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubt where the scatter of the hits is assumed."""
        if self.tip.is_known:
            return ()
        return (Doubt("interval of the limits", "no scatter of the responses is known, a usual one is assumed",
                      "give the records of the hits, at least three a direction"),)


def coefficient_factors(name: str, deviation: float, systems: DrawnSystems) -> FloatArray:
    """Return factors (n, 2) of K_t and K_n of a cut for every draw, lognormal; those of another cut are independent."""
    rng = np.random.default_rng([systems.seed, zlib.crc32(name.encode())])
    return np.asarray(np.exp(deviation * rng.standard_normal((systems.count, 2))))


def problem_of(dynamics: ToolDynamics, cut: CuttingDescription, factors: FloatArray | None = None) -> MillingProblem:
    """Return the milling problem of a cut on these dynamics, its coefficients K_t and K_n times two factors."""
    problem = milling_problem(cut, dynamics.response, dynamics.x, y=dynamics.y)
    if dynamics.at_speed is not None:
        problem = problem.changed(dynamics=dynamics.at_speed)
    if factors is None:
        return problem
    law = problem.coefficients
    return problem.changed(coefficients=replace(law, kt=law.kt * float(factors[0]), kn=law.kn * float(factors[1])))


def log_peak(problem: MillingProblem) -> FloatArray:
    """Return ln of the greatest negative real part of the response in the cutting plane, which limits cuts, shape (1,)."""
    frequency_min, frequency_max = problem.plane.span
    lines = np.linspace(0.5 * frequency_min, 2 * frequency_max, PEAK_SHARE_LINES)
    return np.log(np.maximum(-np.real(problem.plane.response(lines)), 1e-300).max(keepdims=True)).ravel()


def cut_of(values: Mapping[str, Any]) -> CuttingDescription:
    """Return the cut of flat values as plain data holds them."""
    variation = values.get("speed_variation")
    plain_values = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    return CuttingDescription.of(**{**plain_values, "speed_variation": None if variation is None
                                    else SpeedVariationDescription(**variation)})
