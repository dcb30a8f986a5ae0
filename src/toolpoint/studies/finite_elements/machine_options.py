"""Options against a machine's vibration, each judged by the lobes of a cut: other sizes, layers, dampers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.finite_elements.active_damper import ActiveDamper, ProofMassActuator, loop_lines, tune_gain
from toolpoint.studies.finite_elements.attached import fitting_place
from toolpoint.studies.finite_elements.machine_cut import (
    CutLimit,
    cut_limit,
    face_problem,
    mean_factors,
    plane_response,
)
from toolpoint.studies.finite_elements.material_losses import solve_losses
from toolpoint.studies.finite_elements.tuned_damper import TunedDamper, tune_damper_for_cut
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.vibration import Frf, Modes

# Columns of `option_rows`; ratios are to the machine as it is.
HEADER = ("option", "kg", "mode 1 Hz", "mode 2 Hz", "mode 3 Hz", "mode 1 mHz/kg", "peak, ratio", "least depth mm",
          "least depth, ratio", "mean depth, ratio", "chatter Hz")


@dataclass(frozen=True, eq=False)
class MachineOption(NotebookText):
    """Option of a machine: name, mass (kg), frequencies, response of the tool against the work, limits of the cut.

    frequency : (n_modes,) Hz, empty where the modes were not solved again.
    """

    name: str
    mass: float
    frequency: FloatArray
    response: Frf
    limit: CutLimit

    @property
    def peak(self) -> float:
        """Largest response in the plane over all directions and lines, m/N: spectral norm of its matrix."""
        return float(np.linalg.norm(self.response.values, ord=2, axis=(1, 2)).max())

    def __repr__(self) -> str:
        return f"MachineOption({self.name}, {self.mass:.1f} kg, {self.limit!r})"


def option_rows(base: MachineOption, options: Sequence[MachineOption]) -> list[list[str]]:
    """Return a row of text for the machine as it is, then for every option; see `HEADER`.

    The first row holds mass and frequencies, the others their changes (kg, Hz). Depths are in mm in all.
    """
    rows = [[base.name, f"{base.mass:.0f}", *(f"{f:.2f}" for f in base.frequency[:3]), "", "1", f"{1e3 * base.limit.depth:.3f}",
             "1", "1", f"{base.limit.frequency:.1f}"]]
    for option in options:
        change = [f - g for f, g in zip(option.frequency[:3], base.frequency[:3], strict=False)]
        # A change per kilogram needs a change of mass, and modes that were solved again.
        kilograms = option.mass - base.mass
        each = f"{1e3 * change[0] / kilograms:+.2f}" if change and abs(kilograms) > 1e-6 else ""
        rows.append([option.name, f"{kilograms:+.1f}", *([f"{c:+.2f}" for c in change] or [""] * 3), each,
                     f"{option.peak / base.peak:.2f}", f"{1e3 * option.limit.depth:.3f}",
                     f"{option.limit.depth / base.limit.depth:.2f}", f"{option.limit.mean / base.limit.mean:.2f}",
                     f"{option.limit.frequency:.1f}"])
    return rows


def judge_machine(name: str, machine: FiniteElementMachine, modes: Modes, *, cut: CuttingDescription, lines: FloatArray,
                  depth: float | None = None) -> MachineOption:
    """Return a machine as an option, by its modes with damping at tool and work.

    lines : (n_f,) Hz of the response; depth : largest of the chart, m, from the response where left out.
    """
    response = plane_response(modes, lines)
    limit = cut_limit(response, cut, depth=depth)
    return MachineOption(name, sum(machine.part_mass.values()), modes.frequency, response, limit)


def solve_with_damping(machine: FiniteElementMachine, number: int, joints: float) -> Modes:
    """Return the lowest modes (`number` of them), damped by joints and by the losses of materials, which couple modes.

    joints : damping ratio of every mode by the joints.
    """
    return solve_losses(machine, machine.solve(number), joints)


@dataclass(frozen=True, eq=False)
class FittedDampers(NotebookText):
    """A tuned damper and an actuator at one place, each tuned for the depth of the cut, with their options."""

    tuned: TunedDamper
    active: ActiveDamper
    options: tuple[MachineOption, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return both as plain data."""
        return {"tuned": self.tuned.to_dict(), "active": self.active.to_dict()}


def fit_dampers(base: MachineOption, modes: Modes, place: str, *, mass: float, cut: CuttingDescription,
                actuator: ProofMassActuator | None = None) -> FittedDampers:
    """Return a tuned damper and an active one at a place, each judged by the cut.

    modes : with damping, at tool against work and at the place; place : label of point and direction; mass : moving, kg, of
    both unless an actuator is given.
    """
    lines = np.asarray(base.response.frequency)
    # Both dampers are tuned for the mean cut, then judged by the chart.
    factors = mean_factors(face_problem(base.response, cut))
    tuned = tune_damper_for_cut(modes, place, mass, lines=lines, factors=factors)
    device = actuator or ProofMassActuator(mass)
    loop_frequencies = loop_lines(lines, device)
    active = tune_gain(fitting_place(modes, place, loop_frequencies), device, factors=factors)
    # The loop is judged on more lines than the cut, whose own lines are kept for the chart.
    inside = np.isin(loop_frequencies, lines)
    response_on_lines = Frf(loop_frequencies[inside], active.response.values[inside], active.response.outputs,
                            active.response.inputs)
    assert tuned.response is not None
    depth = base.limit.chart.depth_max
    options = []
    for name, kilograms, response in ((f"tuned damper, {mass:g} kg at {place}", mass, tuned.response),
                                      (f"active damper, {device.mass:g} kg moving at {place}", device.mass, response_on_lines)):
        options.append(MachineOption(name, base.mass + kilograms, np.zeros(0), response, cut_limit(response, cut, depth=depth)))
    return FittedDampers(tuned, active, tuple(options))


def judge_variants(variants: Mapping[str, FiniteElementMachine], base: MachineOption, cut: CuttingDescription, *, number: int,
                   joints: float) -> tuple[MachineOption, ...]:
    """Return machines (name to machine) as options, solved anew, on the lines and with the largest depth of the base.

    number : of modes solved; joints : damping ratio of every mode by the joints.
    """
    lines = np.asarray(base.response.frequency)
    return tuple(judge_machine(name, machine, solve_with_damping(machine, number, joints), cut=cut, lines=lines,
                               depth=base.limit.chart.depth_max) for name, machine in variants.items())
