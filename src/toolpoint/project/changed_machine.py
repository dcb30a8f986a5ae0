"""Machine with numbers changed by hand: what was identified loses the changed numbers, and every result says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.machine.description import IdentifiedDescription

CHOSEN_SOURCE = "chosen"  # where a number comes from that a person set


def change_machine(machine: Machine, values: Mapping[str, float]) -> Machine:
    """Return a machine with numbers changed by path (``joints.guide.stiffness.x``), SI, as a person chose them.

    The joints and bodies are marked as chosen, the numbers leave the covariance of those that a test identified, and the
    machine carries a doubt that names them: an interval of its answers no longer holds what was changed.

    Raises ToolpointError for a path that the machine lacks, and for a value that no machine can have.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> table = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> guide = JointDescription("ground", "table", stiffness={"x": 1e7})
    >>> machine = build(MachineDescription("slide", {"table": table}, {"guide": guide}))
    >>> changed = change_machine(machine, {"joints.guide.stiffness.x": 2e7})
    >>> changed.value("joints.guide.stiffness.x"), len(changed.description.doubts)  # what rests on it says so
    (20000000.0, 1)
    """
    changed = {path: value for path, value in values.items() if value != machine.value(path)}
    if not changed:
        return machine
    description = machine.description.with_values(changed)
    parts = {tuple(path.split(".")[:2]) for path in changed}
    joints = {name: replace(joint, source=CHOSEN_SOURCE) if ("joints", name) in parts else joint
              for name, joint in description.joints.items()}
    bodies = {name: replace(body, source=CHOSEN_SOURCE) if ("bodies", name) in parts else body
              for name, body in description.bodies.items()}
    doubts = tuple(Doubt(path, f"was changed by hand from {machine.value(path):.6g} to {value:.6g}, which no interval holds",
                         "measure the changed machine, and identify it anew") for path, value in changed.items())
    identified = _without(description.identified, list(changed))
    return machine.rebuild(replace(description, joints=joints, bodies=bodies, identified=identified,
                                   doubts=(*description.doubts, *doubts)))


def _without(identified: IdentifiedDescription | None, paths: Sequence[str]) -> IdentifiedDescription | None:
    """Return identified numbers without some; None where none are left."""
    if identified is None:
        return None
    kept = [number for number, path in enumerate(identified.parameters) if path not in paths]
    if not kept:
        return None
    covariance = identified.matrix[np.ix_(kept, kept)]
    rows = tuple(tuple(float(value) for value in row[:number + 1]) for number, row in enumerate(covariance))
    return replace(identified, parameters=tuple(identified.parameters[number] for number in kept), covariance=rows)
