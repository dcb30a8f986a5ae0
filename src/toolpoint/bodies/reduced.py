r"""ReducedBody: a reduced elastic body in parts that scale with modulus and density of named sets; nothing is assembled again.

With the kept shapes V, :math:`K = \sum_s (E_s/E_{s,0}) V^T K_s V` and :math:`M = \sum_s (\rho_s/\rho_{s,0}) V^T M_s V`, and a
loss factor per set gives :math:`D = \sum_s \eta_s (E_s/E_{s,0}) V^T K_s V`. Derivatives are the parts themselves; those of
frequencies are those of the machine with these shapes. Where sets scale differently, shapes of the changed body would be
a little better (second order in the change): `at` says so in the body's notes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.bodies.body import Body, combine_modal
from toolpoint.bodies.residual_form import ResidualForm

EQUAL_SCALE_TOLERANCE = 1e-9  # relative difference of the scales of all sets that are one scale of the body
MAX_SCALE_SPREAD = 1.2  # ratio of the scales of two sets: above, the kept shapes are noted as those of other numbers
Kind = Literal["modulus", "density", "loss_factor"]
KINDS: tuple[Kind, ...] = ("modulus", "density", "loss_factor")


@dataclass(frozen=True)
class ElasticNumbers:
    """Young's modulus (Pa), density (kg/m^3) and structural loss factor of a set."""

    modulus: float
    density: float
    loss_factor: float = 0.0


@dataclass(frozen=True, eq=False)
class ReducedPart:
    """Part of a body that a set brings at its nominal numbers.

    stiffness (m, m); mass and gyroscopic matrix (6 + m, 6 + m), the latter or None; energy (m, m) of the error of its mesh, or
    None.
    """

    numbers: ElasticNumbers
    stiffness: FloatArray
    mass: FloatArray
    gyroscopic: FloatArray | None = None
    mesh_energy: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class BodySlope:
    """Derivative of a body's matrices to one number; None where it has none."""

    mass: FloatArray | None = None
    stiffness: FloatArray | None = None
    structural_damping: FloatArray | None = None
    gyroscopic: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ReducedBody(NotebookText):
    """Reduced body at its nominal numbers, without loss factors, and its parts by set."""

    nominal: Body
    parts: Mapping[str, ReducedPart]

    def combined(self, mix: FloatArray) -> ReducedBody:
        """Return the body over combinations (r, k) of its modal coordinates, its parts likewise."""
        turn = combine_modal(mix)
        parts = {name: replace(part, stiffness=mix.T @ part.stiffness @ mix, mass=turn.T @ part.mass @ turn,
                               gyroscopic=None if part.gyroscopic is None else turn.T @ part.gyroscopic @ turn,
                               mesh_energy=None if part.mesh_energy is None else mix.T @ part.mesh_energy @ mix)
                 for name, part in self.parts.items()}
        return ReducedBody(self.nominal.combined(mix), parts)

    def at(self, numbers: Mapping[str, ElasticNumbers]) -> Body:
        """Return the body with these numbers of its sets and the kept shapes."""
        if set(numbers) != set(self.parts):
            fail("numbers", f"sets {', '.join(numbers)}", f"must be those of the body, {', '.join(self.parts)}")
        body = self.nominal
        mass, stiffness = np.array(body.mass), np.array(body.stiffness)
        gyroscopic = None if body.gyroscopic is None else np.array(body.gyroscopic)
        energy = None if body.mesh_energy is None else np.array(body.mesh_energy)
        loss = np.zeros_like(stiffness)
        for name, part in self.parts.items():
            stiffer, denser = numbers[name].modulus / part.numbers.modulus, numbers[name].density / part.numbers.density
            if stiffer != 1:
                stiffness += (stiffer - 1) * part.stiffness
                if energy is not None and part.mesh_energy is not None:
                    energy += (stiffer - 1) * part.mesh_energy
            if denser != 1:
                mass += (denser - 1) * part.mass
                if gyroscopic is not None and part.gyroscopic is not None:
                    gyroscopic += (denser - 1) * part.gyroscopic
            loss += numbers[name].loss_factor * stiffer * part.stiffness
        return replace(body, mass=mass, stiffness=stiffness, gyroscopic=gyroscopic, residual=self._residual(numbers),
                       structural_damping=loss, mesh_energy=energy, notes=(*body.notes, *self._notes(numbers)))

    def _residual(self, numbers: Mapping[str, ElasticNumbers]) -> ResidualForm | None:
        """Return the form of the scaled body; None where sets scale differently: the kept shapes' residual is then unknown."""
        form = self.nominal.residual
        if form is None:
            return None
        stiffer, denser = (np.array([getattr(numbers[name], kind) / getattr(part.numbers, kind)
                                  for name, part in self.parts.items()]) for kind in ("modulus", "density"))
        if np.ptp(stiffer) > EQUAL_SCALE_TOLERANCE * stiffer.max() or np.ptp(denser) > EQUAL_SCALE_TOLERANCE * denser.max():
            return None
        return form if stiffer[0] == denser[0] == 1 else form.scaled(float(stiffer[0]),
                                                                                    float(denser[0]))

    def _notes(self, numbers: Mapping[str, ElasticNumbers]) -> tuple[str, ...]:
        """Return a note for every number whose scales differ by set."""
        notes = []
        for kind in ("modulus", "density"):
            scales = {name: getattr(numbers[name], kind) / getattr(part.numbers, kind) for name, part in self.parts.items()}
            if max(scales.values()) > MAX_SCALE_SPREAD * min(scales.values()):
                words = ", ".join(f"{name} x {scale:.3g}" for name, scale in scales.items() if scale != 1)
                notes.append(f"shapes are those before {kind} changed by set ({words}): frequencies may be some per mille "
                             "too high; write the machine and read it anew")
        return tuple(notes)

    def slope(self, name: str, kind: Kind, numbers: ElasticNumbers) -> BodySlope:
        """Return the derivative to one number of a set, whose numbers are now `numbers`."""
        part = self.parts[name]
        if kind == "modulus":
            per_unit = part.stiffness / part.numbers.modulus
            return BodySlope(None, per_unit, numbers.loss_factor * per_unit if numbers.loss_factor else None)
        if kind == "density":
            gyroscopic = None if part.gyroscopic is None else part.gyroscopic / part.numbers.density
            return BodySlope(part.mass / part.numbers.density, gyroscopic=gyroscopic)
        return BodySlope(structural_damping=numbers.modulus / part.numbers.modulus * part.stiffness)

    def __repr__(self) -> str:
        return f"ReducedBody({self.nominal!r}, sets {', '.join(self.parts)})"
