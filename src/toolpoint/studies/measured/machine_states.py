"""Two machine files as two states of a machine: modes at the points that both have, responses of the tool, numbers changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine, assemble
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.studies.measured.state_comparison import ComparedState, StateComparison, compare_states
from toolpoint.studies.measured.state_numbers import compare_numbers
from toolpoint.vibration import Dof, Frf, eigen

_WAYS = ("+x", "+y", "+z")


def compare_machines(older: tuple[str, Machine], newer: tuple[str, Machine], *, pose: Mapping[str, float] | None = None,
                     count: int = 6, lowest_mac: float = 0.5, rng: np.random.Generator) -> StateComparison:
    """Return how two machines, each with its name, differ at a pose: their lowest `count` modes, tool responses and numbers.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     BodyDescription, InertiaDescription, JointDescription, MachineDescription, PointDescription)
    >>> machine = build(MachineDescription(
    ...     "slide", {"head": BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))},
    ...     {"guide": JointDescription("ground", "head", stiffness={"x": 1e7})}, points={"tip": PointDescription("head")}))
    >>> worn = machine.with_values({"joints.guide.stiffness.x": 0.81e7})
    >>> compare_machines(("new", machine), ("worn", worn), rng=np.random.default_rng(1)).change.round(6).tolist()
    [-0.1]
    """
    machines = (older[1], newer[1])
    points = [name for name in machines[0].description.points if name in machines[1].description.points]
    if not points:
        fail("newer", f"{newer[0]}: no point of {older[0]}", "both machines must name a common point")
    dofs = [Dof(name, way) for name in points for way in _WAYS]
    frfs = _tool_responses(machines, pose)
    states = [_state(named, dofs, (pose, count), frf) for named, frf in zip((older, newer), frfs, strict=True)]
    result = compare_states(*states, lowest_mac=lowest_mac, rng=rng)
    numbers = compare_numbers(*machines, result.pairs.pairs[:, 0], pose=pose)
    exact = [state.name for state in states if not np.isfinite(state.interval).any()]
    doubts = [Doubt("intervals", f"the numbers of {' and '.join(exact)} are taken as exact", "whether a change is one is for a "
                    "test to tell: compare two tests, or identified machines, which carry their covariance")] if exact else []
    return replace(result, numbers=numbers, doubts=(*doubts, *result.doubts))


def _state(named: tuple[str, Machine], dofs: Sequence[Dof], how: tuple[Mapping[str, float] | None, int], frf: Frf | None
           ) -> ComparedState:
    (name, machine), (pose, count) = named, how
    modes = eigen.solve_undamped(assemble(machine, pose, dofs), min(count, machine.size))
    spread = solve_modes(machine, pose, modes.count).spread
    return ComparedState(name, modes, np.full(modes.count, np.nan) if spread is None else spread.interval, frf)


def _tool_responses(machines: tuple[Machine, Machine], pose: Mapping[str, float] | None) -> tuple[Frf | None, Frf | None]:
    """Return the responses of both tools over the lines of the first; none where one has no tool or no damping."""
    try:
        first = tool_point(machines[0], [pose or {}]).frf
        return first.at_pose(0), tool_point(machines[1], [pose or {}], first.frequency).frf.at_pose(0)
    except ToolpointError:
        return None, None
