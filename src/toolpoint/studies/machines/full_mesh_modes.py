"""Natural frequencies of a machine with all elements of its meshes, beside the reduced ones and the error these state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt, doubts_among, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.assembly.full_mesh import link_full_meshes
from toolpoint.studies.machines.machine_modes import MachineModes, solve_modes
from toolpoint.studies.text_table import text_table

_SOLUTION_ERROR = 1e-7  # relative, of frequencies: differences below it are those of the two solutions
_MAX_UNSTATED_ERROR = 1e-3  # relative, of frequencies whose reduction states no error
_MIN_SHIFT_FREQUENCY = 1e-3  # of the highest: modes below it do not set the shift of the search


@dataclass(frozen=True, eq=False)
class FullMeshModes(NotebookText):
    """The lowest natural frequencies at a pose, with all elements and reduced.

    Parameters
    ----------
    reduced : MachineModes
        Of the reduced bodies, with the error that they state.
    frequency : (n_modes,) floats
        Hz, with all elements.
    size : int
        Coordinates of all bodies.
    counted_below : float
        Hz, up to which a count confirms that no mode of all elements is missing.
    """

    reduced: MachineModes
    frequency: FloatArray
    size: int
    counted_below: float

    @property
    def rise(self) -> FloatArray:
        """Relative rise of each frequency by the reduction, 0 at 0 Hz; below zero where tables of sliding places lower it."""
        moving = self.frequency > _MIN_SHIFT_FREQUENCY * self.frequency.max(initial=0.0)
        return np.where(moving, self.reduced.frequency / np.where(moving, self.frequency, 1.0) - 1, 0.0)

    @property
    def stated(self) -> FloatArray | None:
        """Relative error that the reduced bodies state, (n_modes,); not a number where theirs is not to be believed."""
        estimate = self.reduced.reduction
        return None if estimate is None else np.where(estimate.is_sure, estimate.error, np.nan)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks of the comparison, doubts first; then those of the reduced machine."""
        bound = _MAX_UNSTATED_ERROR if self.stated is None else np.nan_to_num(self.stated, nan=np.inf)
        exceeding = np.flatnonzero(np.abs(self.rise) > bound + _SOLUTION_ERROR)
        doubts = [Doubt("reduction error", f"modes {_numbers(exceeding)} differ from those of all elements by more than "
                        + ("0.1 %" if self.stated is None else "their stated error"), "take the frequencies of all elements",
                        figure=float(np.abs(self.rise[exceeding]).max()))] if len(exceeding) else []
        return (*doubts, f"{self.size} coordinates of all elements; no mode of theirs is missing below "
                f"{self.counted_below:.5g} Hz (counted). What finer meshes would change is in neither",
                *self.reduced.notes)

    def table(self) -> str:
        """Return both sets of frequencies as text."""
        header = ["mode", "all elements Hz", "reduced Hz", "higher by %", *(["stated at most %"] if self.stated is not None
                                                                              else [])]
        rows = [[str(i + 1), f"{full:.4f}", f"{reduced:.4f}", f"{100 * rise:.2g}"] for i, (full, reduced, rise) in
                enumerate(zip(self.frequency, self.reduced.frequency, self.rise, strict=True))]
        if self.stated is not None:
            rows = [[*row, "doubt" if np.isnan(error) else f"{100 * error:.2g}"]
                    for row, error in zip(rows, self.stated, strict=True)]
        return "\n".join(with_notes([text_table(self.reduced.machine.name, header, rows)], self.notes))

    def to_dict(self) -> dict[str, Any]:
        """Return both sets of frequencies (Hz) as plain data, and the stated errors (None: not known)."""
        stated = None if self.stated is None else [None if np.isnan(error) else float(error) for error in self.stated]
        return {"frequency_hz": self.frequency.tolist(), "reduced_frequency_hz": self.reduced.frequency.tolist(),
                "rise": self.rise.tolist(), "stated_error": stated, "coordinates": self.size,
                "counted_below_hz": self.counted_below, "doubts": doubts_among(self.notes), "notes": list(self.notes)}

    def __repr__(self) -> str:
        return (f"FullMeshModes({self.reduced.machine.name!r}, {len(self.frequency)} modes of {self.size} coordinates, reduced "
                f"ones within {100 * np.abs(self.rise).max(initial=0.0):.2g} %)")


def compare_full_mesh(machine: Machine, pose: Mapping[str, float] | None = None, count: int = 12) -> FullMeshModes:
    """Return the lowest `count` natural frequencies with all elements of meshed bodies at a pose (m, rad), beside the reduced.

    Joints hold the same places in the same way; sliding places are where the pose puts them, without their table. Modes are
    compared in ascending order, as the stated error is.

    Raises ToolpointError as `machine.assembly.full_mesh.link_full_meshes`: for a machine without meshes, with bodies that spin,
    and with gravity or loads.

    Examples
    --------
    A block of cast iron on its foot, three modes of 96 coordinates:

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, PatchDescription
    >>> foot = PatchDescription((0.1, 0.05, 0), (1, 0, 0), (0, -1, 0), 0.2, 0.1)
    >>> block = ElasticDescription((CastingBox((0, 0, 0), (0.2, 0.1, 0.1)),), {"foot": foot}, band=6000.0, mesh_size=0.1)
    >>> joint = JointDescription("ground", "block", child_interface="foot")
    >>> machine = build(MachineDescription("block", {"block": BodyDescription(elastic=block)}, {"bolts": joint}))
    >>> result = compare_full_mesh(machine, count=3)
    >>> result.size, bool((abs(result.rise) <= result.stated + 1e-7).all())
    (96, True)
    """
    linked = link_full_meshes(machine, pose).linked
    reduced = solve_modes(machine, pose, count)
    moving = reduced.frequency[reduced.frequency > _MIN_SHIFT_FREQUENCY * reduced.frequency.max(initial=0.0)]
    pairs = linked.modes(len(reduced.frequency), shift=(2 * np.pi * float(moving.min())) ** 2)
    return FullMeshModes(reduced, pairs.frequency, linked.size, pairs.counted_below)


def _numbers(indices: np.ndarray) -> str:
    return ", ".join(str(i + 1) for i in indices.tolist())
