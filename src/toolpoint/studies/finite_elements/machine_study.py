"""The study of a whole machine by finite elements: modes, where their energy sits, what a gram buys, a tuned damper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid.sensitivity import ElementSensitivity
from toolpoint.studies.finite_elements.tuned_damper import TunedDamper, tune_damper
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Modes
from toolpoint.vibration.sparse import EigenPairs

_NOTHING: Callable[[str], None] = lambda name: None
# Modes that a response at the tool is made of; the damper's share of the mass of the part that it sits on is chosen.
_MODES, _DAMPING = 10, 0.02


@dataclass(frozen=True, eq=False)
class Variant:
    """A machine with other sizes: its name, mass (kg) and first frequencies (Hz)."""

    name: str
    mass: float
    frequency: FloatArray


@dataclass(frozen=True, eq=False)
class FiniteElementStudy(NotebookText):
    """What was found of a machine: modes, energies of parts and joints, variants, a damper."""

    machine: FiniteElementMachine
    pairs: EigenPairs
    modes: Modes
    sensitivities: Mapping[str, ElementSensitivity]
    joint_shares: Mapping[str, FloatArray]
    variants: tuple[Variant, ...]
    damper: TunedDamper

    @property
    def mass(self) -> float:
        """kg."""
        return sum(self.machine.part_mass.values())

    @property
    def part_shares(self) -> dict[str, FloatArray]:
        """Share of every part in the strain energy of every mode: twice the relative change of f with its E."""
        return {name: 2 * s.modulus.sum(axis=1) for name, s in self.sensitivities.items()}

    @property
    def notes(self) -> tuple[str, ...]:
        """What the numbers rest on."""
        return (self.pairs.status,
                "all sizes and joint stiffnesses are chosen; joints are springs of the patch's mean motion: what rails and "
                "flanges bend locally between their bolts is not in it",
                f"the damping ratio {_DAMPING:g} of every mode is chosen: peaks and dampers hang on it",
                "depths are compared by 1 / -min Re G along the damper's direction, not by full lobes")

    def table(self) -> str:
        """Return modes with their main seats of energy, variants with hertz a kilogram, and the damper."""
        shares = {**self.part_shares, **self.joint_shares}
        rows = []
        for i, f in enumerate(self.pairs.frequency):
            seats = sorted(shares, key=lambda name: -shares[name][i])[:3]
            rows.append([str(i + 1), f"{f:.2f}", ", ".join(f"{name} {100 * shares[name][i]:.0f} %" for name in seats)])
        text = text_table(f"{self.machine.size} coordinates, {self.mass:.0f} kg", ["mode", "Hz", "strain energy in"], rows)
        lines = [[v.name, f"{v.mass - self.mass:+.1f}", *(f"{a - b:+.2f}" for a, b in zip(v.frequency, self.pairs.frequency,
                                                                                       strict=False))] for v in self.variants]
        count = min((len(v.frequency) for v in self.variants), default=0)
        header = ["variant", "kg", *(f"f{i + 1} Hz" for i in range(count))]
        text += "\n" + text_table("variants against the machine", header, lines) if lines else ""
        d = self.damper
        return text + (f"\ndamper of {d.mass:.3g} kg at {d.frequency:.2f} Hz, ratio {d.damping_ratio:.3f}: largest response x "
                       f"{d.peak_ratio:.2f}, least depth x {d.depth_ratio:.2f}; {d.status}")

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain data."""
        return {"frequency_hz": self.pairs.frequency.tolist(), "mass_kg": self.machine.part_mass,
                "strain_energy": {k: v.tolist() for k, v in {**self.part_shares, **self.joint_shares}.items()},
                "variants": [{"name": v.name, "mass_kg": v.mass, "frequency_hz": v.frequency.tolist()} for v in self.variants],
                "damper": self.damper.to_dict(), "notes": list(self.notes)}


def study_finite_elements(
    machine: FiniteElementMachine, variants: Mapping[str, FiniteElementMachine] | None = None, *, tool: str = "tool:+x",
    damper_place: str = "tool:+x", damper_mass: float = 10.0, step: Callable[[str], None] = _NOTHING,
) -> FiniteElementStudy:
    """Return the study of a machine and of variants of it.

    Parameters
    ----------
    machine : FiniteElementMachine
        With the points that `tool` and `damper_place` name.
    variants : mapping of name to FiniteElementMachine, optional
    tool, damper_place : labels
    damper_mass : float
        kg.
    step : function, optional
        Told what is being done.
    """
    step("modes")
    pairs = machine.solve(_MODES)
    modes = machine.point_modes(pairs, _DAMPING)
    step("sensitivity of every element")
    sensitivities = machine.sensitivities(pairs)
    shares = machine.joint_shares(pairs)
    others = []
    for name, other in (variants or {}).items():
        step(name)
        others.append(Variant(name, sum(other.part_mass.values()), other.solve(4).frequency[:4]))
    step("damper")
    damper = tune_damper(modes, tool, damper_place, mass=damper_mass, lines=_lines(pairs.frequency))
    return FiniteElementStudy(machine, pairs, modes, sensitivities, shares, tuple(others), damper)


def _lines(frequency: Sequence[float] | FloatArray) -> FloatArray:
    """Return lines close enough for a damping ratio of a percent."""
    return np.geomspace(0.4 * frequency[0], 1.3 * frequency[-1], 1500)
