"""Natural frequencies of a machine at a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from toolpoint._check import FloatArray
from toolpoint.machine import Machine
from toolpoint.machine.shapes import body_shapes
from toolpoint.studies.text_table import text_table


@dataclass(frozen=True, eq=False)
class MachineModes:
    """The lowest natural frequencies (n_modes,) of a machine, Hz, at a pose."""

    machine: Machine
    pose: Mapping[str, float]
    frequency: FloatArray

    def table(self) -> str:
        """Return the frequencies as text."""
        rows = [[str(i + 1), f"{f:.4f}"] for i, f in enumerate(self.frequency)]
        return text_table(self.machine.name, ["mode", "frequency Hz"], rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the frequencies (Hz) as plain data."""
        return {"frequency_hz": self.frequency.tolist()}


def solve_modes(machine: Machine, pose: Mapping[str, float] | None = None, count: int = 12) -> MachineModes:
    """Return the lowest natural frequencies of a machine at a pose (m, rad), undamped."""
    at = dict(pose or {})
    return MachineModes(machine, at, body_shapes(machine, at, count).frequency)
