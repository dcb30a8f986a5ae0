r"""Numbers that differ between two machine files, and what each moves: slopes of the first state times :math:`\ln(p_2/p_1)`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine
from toolpoint.machine.description.machine import parameters
from toolpoint.studies.machines.sensitivity_study import study_sensitivity

_MAX_EQUAL_RATIO = 1e-12  # relative difference of a number below which it is the same


@dataclass(frozen=True, eq=False)
class NumberChange(NotebookText):
    """A number of the file in both states, SI; predicted : (n,) relative changes of the paired frequencies, not numbers where
    its slope is not known; a number that one state lacks is not a number."""

    path: str
    older: float
    newer: float
    predicted: FloatArray

    def line(self, change: FloatArray) -> str:
        """Return the number in words, with the mode that it moves most and by how much that one changed in all."""
        words = " -> ".join("absent" if np.isnan(value) else f"{value:.6g}" for value in (self.older, self.newer))
        if not np.isfinite(self.predicted).any():
            return f"{self.path}: {words}; what it moves is not known"
        k = int(np.nanargmax(np.abs(self.predicted)))
        return (f"{self.path}: {words}; moves pair {k + 1} most, {100 * self.predicted[k]:+.3g} % of its "
                f"{100 * change[k]:+.3g} % (slope of the first state)")

    def to_dict(self) -> dict[str, Any]:
        """Return the number as plain data, None where something is not known."""
        values = [None if np.isnan(value) else float(value) for value in (self.older, self.newer, *self.predicted)]
        return {"path": self.path, "older": values[0], "newer": values[1], "predicted": values[2:]}


def compare_numbers(older: Machine, newer: Machine, modes: FloatArray, *, pose: Pose | None = None
                    ) -> tuple[NumberChange, ...]:
    """Return the numbers of bodies and joints that differ, those first that move a frequency most.

    modes : indices of the paired modes of the first state.
    """
    first, second = (_numbers(machine) for machine in (older, newer))
    paths = [path for path in dict.fromkeys([*first, *second])
             if not np.isclose(first.get(path, np.nan), second.get(path, np.nan), rtol=_MAX_EQUAL_RATIO, atol=0)]
    changes = []
    for path in paths:
        old, new = first.get(path, np.nan), second.get(path, np.nan)
        changes.append(NumberChange(path, old, new, _predicted(older, path, (old, new), modes, pose)))
    return tuple(sorted(changes, key=lambda number: -float(np.nan_to_num(np.abs(number.predicted), nan=0.0).max(initial=0.0))))


def _numbers(machine: Machine) -> Mapping[str, float]:
    return {path: machine.value(path) for path in parameters(machine.description)}


def _predicted(machine: Machine, path: str, values: tuple[float, float], modes: FloatArray, pose: Pose | None) -> FloatArray:
    """Return the relative changes of frequencies by a number; not numbers where it has no slope."""
    unknown = np.full(len(modes), np.nan)
    if not len(modes) or not min(values) > 0:  # also where one is not a number
        return unknown
    try:
        slopes = study_sensitivity(machine, [path], int(np.max(modes)) + 1, pose=pose).frequency[0]
    except ToolpointError:
        return unknown
    return np.asarray(np.expm1(slopes[modes] * np.log(values[1] / values[0])))
