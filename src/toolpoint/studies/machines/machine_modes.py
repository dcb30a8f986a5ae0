"""Natural frequencies of a machine at a pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from toolpoint._check import FloatArray
from toolpoint.machine import Machine
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.gyroscopics import fastest_spin
from toolpoint.machine.shapes import body_shapes
from toolpoint.studies.text_table import text_table


@dataclass(frozen=True, eq=False)
class MachineModes:
    """The lowest natural frequencies (n_modes,) of a machine, Hz, at a pose; those of whirl where bodies spin."""

    machine: Machine
    pose: Mapping[str, float]
    frequency: FloatArray

    def table(self) -> str:
        """Return the frequencies as text."""
        rows = [[str(i + 1), f"{f:.4f}"] for i, f in enumerate(self.frequency)]
        spin = fastest_spin(self.machine.description)
        title = self.machine.name + (f", bodies spinning at up to {spin * 30 / 3.141592653589793:.6g} rev/min" if spin else "")
        return text_table(title, ["mode", "frequency Hz"], rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the frequencies (Hz) as plain data."""
        return {"frequency_hz": self.frequency.tolist()}


def solve_modes(machine: Machine, pose: Mapping[str, float] | None = None, count: int = 12) -> MachineModes:
    """Return the lowest natural frequencies of a machine at a pose (m, rad), undamped."""
    at = dict(pose or {})
    if fastest_spin(machine.description):
        return MachineModes(machine, at, natural_frequencies(machine, at, count)[0])
    return MachineModes(machine, at, body_shapes(machine, at, count).frequency)
