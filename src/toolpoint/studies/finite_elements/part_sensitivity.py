"""Sensitivities of a machine, or of a part alone: frequencies, motions, MAC by element and by set, summed; Hz per kilogram."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid.sensitivity import ElementSensitivity, element_masses
from toolpoint.studies.finite_elements.shape_sensitivity import ShapeSensitivity, mac_sensitivity, motion_sensitivity
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.studies.text_table import text_table
from toolpoint.vibration import Dof
from toolpoint.vibration.sparse import EigenPairs


@dataclass(frozen=True, eq=False)
class PartSensitivity(NotebookText):
    """Sensitivities of a machine or of a part alone.

    pairs : modes of the machine; frequency : part to the sensitivities of every frequency to its elements; motion :
    sensitivities of a named motion in every mode at unit modal mass; mac : those of the MAC with measured shapes, None without
    a test.
    """

    name: str
    machine: FiniteElementMachine
    pairs: EigenPairs
    frequency: Mapping[str, ElementSensitivity]
    motion: ShapeSensitivity
    mac: ShapeSensitivity | None = None

    def hertz_a_kilogram(self, part: str) -> FloatArray:
        """Return the gain of every frequency by a kilogram that thickens an element (E and mass), (k, e), Hz/kg."""
        return self.frequency[part].hertz_a_kilogram(element_masses(self.machine.parts[part]))

    def holders(self, part: str, mode: int) -> tuple[float, float]:
        """Return the share of a part's elements, and of its mass, that hold 80 % of its effect by E on a mode (from 0)."""
        return self.frequency[part].holders(element_masses(self.machine.parts[part]), mode)

    def rows(self, modes: int = 3) -> list[list[str]]:
        """Return a row of text for every part, see `HEADER`: sensitivities to E and density of the first modes, and `holders`.

        The shares of elements and mass are those of mode 1.
        """
        rows = []
        for part, slopes in self.frequency.items():
            elements, mass = self.holders(part, 0)
            effects = (*slopes.modulus.sum(axis=1)[:modes], *slopes.density.sum(axis=1)[:modes])
            rows.append([part, *(f"{v:+.3f}" for v in effects), f"{100 * elements:.0f} %", f"{100 * mass:.0f} %"])
        return rows

    def best_grams(self, mode: int = 0, number: int = 3) -> list[tuple[str, float, float]]:
        """Return (part, best element, worst element), Hz/kg, of the `number` best parts in a mode (from 0), the best first."""
        ends = []
        for part in self.machine.parts:
            gains = self.hertz_a_kilogram(part)[mode]
            ends.append((part, float(gains.max()), float(gains.min())))
        return sorted(ends, key=lambda entry: -entry[1])[:number]

    def table(self) -> str:
        """Return as text: sensitivities by part, the effect of a kilogram of wall on mode 1, and what moves the least MAC."""
        title = f"{self.name.capitalize()}: per cent of a mode's frequency for a per cent of modulus E, of density"
        text = text_table(title, HEADER, self.rows())
        gram = "; ".join(f"{part} {gain_max:+.3g} .. {gain_min:+.3g}" for part, gain_max, gain_min in self.best_grams())
        text += f"\nA kilogram more of wall moves mode 1 by, in the best and the worst element, Hz: {gram}"
        if self.mac is not None and len(self.mac.values):
            k = int(np.argmin(self.mac.values))
            text += f"\n{self.mac.names[k]} {self.mac.values[k]:.3f}: raised most by {', '.join(self.mac_levers(k))}"
        return text

    def mac_levers(self, pair: int, number: int = 4) -> list[str]:
        """Return the `number` changes that move the MAC of a pair (from 0) most, each with its effect for +10 %."""
        assert self.mac is not None
        effects = {f"stiffness of {name}": float(v[pair]) for name, v in self.mac.joints.items()}
        for part, (modulus, density) in self.mac.by_part().items():
            effects |= {f"E of {part}": float(modulus[pair]), f"density of {part}": float(density[pair])}
        order = sorted(effects, key=lambda name: -abs(effects[name]))[:number]
        return [f"{name} ({0.1 * effects[name]:+.3f} for +10 %)" for name in order]

    def to_dict(self) -> dict[str, Any]:
        """Return sensitivities summed over parts as plain data, without those of single elements."""
        sums = (lambda slopes: {} if slopes is None else {
            "functions": list(slopes.names), "values": slopes.values.tolist(),
            "parts": {p: {"modulus": m.tolist(), "density": d.tolist()} for p, (m, d) in slopes.by_part().items()},
            "joints": {j: v.tolist() for j, v in slopes.joints.items()}, "notes": list(slopes.notes)})
        return {"name": self.name, "frequency_hz": self.pairs.frequency.tolist(), "motion": sums(self.motion),
                "mac": sums(self.mac),
                "frequency": {p: {"modulus": s.modulus.sum(axis=1).tolist(), "density": s.density.sum(axis=1).tolist()}
                              for p, s in self.frequency.items()}}

    def __repr__(self) -> str:
        elements = sum(model.element_count for model in self.machine.parts.values())
        return f"PartSensitivity({self.name}, {self.pairs.count} modes, {elements} elements)"


HEADER = ("part", "E, mode 1", "E, mode 2", "E, mode 3", "density, mode 1", "density, mode 2", "density, mode 3",
          "elements with 80 %", "their mass")


def study_sensitivity(name: str, machine: FiniteElementMachine, pairs: EigenPairs, *, dof: Dof, mode_count: int = 10,
                      measured: tuple[tuple[Dof, ...], Array, tuple[int, ...]] | None = None) -> PartSensitivity:
    """Return all sensitivities of a machine.

    Parameters
    ----------
    name : str
    machine, pairs
        The machine and its modes, at least one more than `mode_count`.
    dof : Dof
        At a node (a number from 1): the motion whose sensitivities are studied.
    mode_count : int
        Lowest modes that are studied.
    measured : (Dofs, shapes (n_dofs, k), modes (k,)), optional
        Of a test, and the mode of the model that each shape belongs to.
    """
    # Slopes of shapes need at least one mode above.
    count = min(mode_count, pairs.count - 1)
    slopes = machine.sensitivities(pairs)
    motion = motion_sensitivity(machine, pairs, {f"{machine.part_of_node[int(dof.point) - 1]} {dof.direction}":
                                                 machine.motion_of([dof])}, which=range(count))
    mac = None
    if measured is not None:
        dofs, shapes, which = measured
        kept = [k for k, mode in enumerate(which) if mode < count]
        mac = mac_sensitivity(machine, pairs, dofs, measured=shapes[:, kept], which=[which[k] for k in kept])
    return PartSensitivity(name, machine, pairs, slopes, motion, mac)
