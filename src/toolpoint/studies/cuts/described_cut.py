"""Described cut on the dynamics of a tool: the milling problem, the values that stand in for missing ones, and doubts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from toolpoint._doubt import Doubt
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.cut.total_energy import linearise_over
from toolpoint.cutting.description import PARAMETERS, CuttingDescription
from toolpoint.machine import Machine
from toolpoint.studies.cuts.example_cut import example_cut
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, as_modes
from toolpoint.studies.machines.tool_point import milling_problem

MAX_WORK_COEFFICIENT = 3e10  # Pa
MAX_LINEARISED_DEVIATION = 0.05  # of mean directional factors, between a total-energy law and its coefficients


def cut_on(machine: Machine | None, stated: Mapping[str, Any]) -> tuple[CuttingDescription, list[str]]:
    """Return the machine's cut, or the example's without one, with the stated values in place, and the assumptions.

    Examples
    --------
    >>> cut, notes = cut_on(None, {"teeth": 3})
    >>> cut.tool.teeth, notes[0][:37]
    (3, 'Not given and taken from an example: ')
    """
    described = None if machine is None else machine.description.cutting
    base, notes = example_cut(stated) if described is None else (described, [])
    return base.with_values(stated), notes


def build_problem(dynamics: ToolDynamics, values: Mapping[str, Any], *, in_time: bool = False
                      ) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    """Return the milling problem of a cut on these dynamics, the cut, and remarks.

    `values`, by their flat keys (SI), stand in place of those of the machine, or of the example where there is none. With
    `in_time` measured lines are replaced by their modes, which a simulation steps through.
    """
    stated = {name: value for name, value in values.items() if value is not None}
    problem, used, notes = _problem(dynamics, stated, in_time)
    return problem, used, [*notes, *_coefficient_notes(problem, used)]


def _coefficient_notes(problem: MillingProblem, used: CuttingDescription) -> list[str]:
    if problem.law is None:
        return [f"Coefficients: {problem.coefficients.source}."] if used.coefficients.material else []
    deviation = linearise_over(problem.law, problem.engagement, problem.feed_per_tooth)[1]
    why = f"directional factors of the law differ by {100 * deviation:.2g} %, and a limit of stability by about as much or less"
    notes = [f"Coefficients: {problem.coefficients.source}; a cut in time takes the law itself."]
    if deviation > MAX_LINEARISED_DEVIATION:
        return [*notes, Doubt("total-energy law", why, "simulate cuts near their limit: toolpoint mill", figure=deviation)]
    return [*notes, f"Over the arc {why}."]


def _problem(dynamics: ToolDynamics, stated: Mapping[str, Any], in_time: bool
             ) -> tuple[MillingProblem, CuttingDescription, list[str]]:
    dynamics = as_modes(dynamics) if in_time else dynamics
    notes = list(dynamics.notes)
    used, assumptions = cut_on(dynamics.machine, stated)
    notes += [*assumptions, *unit_doubts(used)]
    problem = milling_problem(used, dynamics.response, dynamics.x, y=dynamics.y)
    if dynamics.at_speed is not None:
        problem = problem.changed(dynamics=dynamics.at_speed)
    if problem.coefficients.ka > 0 and problem.z is None:
        notes.append("the response along z is not known: the axial force moves nothing here")
    return problem, used, notes


def unit_doubts(cut: CuttingDescription) -> list[Doubt]:
    """Return remarks on values that hint at another unit; the units of the options are named."""
    lines = []
    diameter = cut.tool.diameter
    # No mill is thinner than 0.2 mm or thicker than half a metre: beyond, the unit is wrong.
    if not 2e-4 <= diameter <= 0.5:
        lines.append(Doubt("diameter", f"{1e3 * diameter:g} mm is doubtful", "`diameter` is in mm"))
    # No edge carries a chip of a fifth of its tool: a feed per minute or in mm stands here.
    if cut.feed_per_tooth > 0.2 * diameter:
        lines.append(Doubt("feed", f"{1e3 * cut.feed_per_tooth:g} mm a tooth on a tool of {1e3 * diameter:g} mm is doubtful",
                           "`feed` is in mm per tooth"))
    for key in ("tangential", "normal", "axial"):
        value, option = getattr(cut.coefficients, key), PARAMETERS[key].option
        if value is not None and value > MAX_WORK_COEFFICIENT:
            lines.append(Doubt(option, f"{value / 1e6:g} N/mm^2 is above that of any work material",
                               f"`{option}` is in N/mm^2 (1 N/mm^2 is 1e6 Pa)"))
    return lines
