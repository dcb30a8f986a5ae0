"""Branches of an arm on which poses lie, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.reach import arm_of


def name_branches(machine: Machine, poses: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """Return the branch of each pose of a batch; an empty tuple for machines that are no arms."""
    arm = arm_of(machine)
    if arm is None:
        return ()
    size = max((np.size(v) for v in poses.values()), default=1)
    rows = np.stack([np.broadcast_to(np.ravel(poses.get(axis.name, axis.reference_position)), (size,))
                     for axis in arm.chain.driven_axes], axis=1)
    return tuple(arm.branch_name(row) for row in rows)


def branch_lines(branches: Iterable[str]) -> list[str]:
    """Return a line on the branches of an arm over places or poses; with several, that values jump from one to the next."""
    count = Counter(name for name in branches if name)
    if not count:
        return []
    words = ", ".join(f"{name} ({number})" for name, number in count.most_common())
    if len(count) == 1:
        return [f"branch of the arm: {next(iter(count))}"]
    return [f"branches of the arm: {words}; values jump where it changes"]
