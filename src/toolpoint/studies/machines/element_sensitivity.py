"""Sensitivity of a machine's frequencies to every element of its castings and solids, and what a kilogram of wall buys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, count
from toolpoint._doubt import Doubt, doubts_among, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid import SolidModel
from toolpoint.bodies.solid.sensitivity import ElementSensitivity, element_centres, element_masses, frequency_sensitivity
from toolpoint.machine import Machine
from toolpoint.machine.assembly.full_mesh import FullMeshes, link_full_meshes
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.studies.text_table import text_table
from toolpoint.vibration.sparse import EigenPairs

_SHIFT_FREQUENCY_RATIO = 1e-3  # of the highest: modes below it do not set the shift of the search
_PRINTED_MODES, _PRINTED_ELEMENTS = 3, 5  # of the table
_MAX_RIGID_COUNT = 6  # motions of a machine that is not held: looked for beside the modes asked for


@dataclass(frozen=True, eq=False)
class ElementStudy(NotebookText):
    """Sensitivities of a machine's frequencies to the elements of its meshed bodies.

    Parameters
    ----------
    machine : Machine
    meshes : FullMeshes
        All elements at the pose.
    pairs : EigenPairs
        Modes of the whole, unit modal mass; those at 0 Hz left out.
    slopes : mapping of body to ElementSensitivity
    notes : sequence of str
        Doubts first.
    """

    machine: Machine
    meshes: FullMeshes
    pairs: EigenPairs
    slopes: Mapping[str, ElementSensitivity]
    notes: tuple[str, ...] = ()

    @property
    def frequency(self) -> FloatArray:
        """Natural frequencies, (n_modes,), Hz."""
        return self.pairs.frequency

    @property
    def models(self) -> dict[str, SolidModel]:
        """Meshed bodies, each in the frame of the machine."""
        return {name: replace(part.model, nodes=tf.move(part.frame, part.model.nodes))
                for name, part in self.meshes.meshed.items()}

    @cached_property
    def element_masses(self) -> dict[str, FloatArray]:
        """Mass of every element, (e,), kg, by body."""
        return {name: element_masses(part.model) for name, part in self.meshes.meshed.items()}

    def shape_of(self, body: str) -> FloatArray:
        """Return the motion of a body's nodes in all modes, (3 nodes, n_modes), along the axes of the machine."""
        part = self.meshes.meshed[body]
        shapes = part.shapes(self.pairs.vectors).reshape(len(part.model.nodes), 3, -1)
        return np.einsum("ij,njk->nik", part.frame[:3, :3], shapes).reshape(part.model.size, -1)

    def hertz_a_kilogram(self, body: str) -> FloatArray:
        """Return the gain of every frequency by a kilogram that thickens each element, (n_modes, e), Hz/kg."""
        return self.slopes[body].hertz_a_kilogram(self.element_masses[body])

    def best_elements(self, mode: int = 0, number: int = _PRINTED_ELEMENTS) -> list[tuple[str, FloatArray, float]]:
        """Return (body, centre (3,) in m in the machine's frame, Hz/kg) of the elements where wall raises a mode most."""
        rows = []
        for name, part in self.meshes.meshed.items():
            gains, centres = self.hertz_a_kilogram(name)[mode], element_centres(part.model)
            for k in np.argsort(-gains)[:number]:
                rows.append((name, tf.move(part.frame, centres[k][None])[0], float(gains[k])))
        return sorted(rows, key=lambda row: -row[2])[:number]

    def rows(self) -> list[list[str]]:
        """Return a row of text for every body: effect of its E and density, and the elements that hold 80 % of it in mode 1."""
        rows = []
        for name, slopes in self.slopes.items():
            elements, mass = slopes.holders(self.element_masses[name], 0)
            gains = self.hertz_a_kilogram(name)[0]
            effects = (*slopes.modulus.sum(axis=1)[:_PRINTED_MODES], *slopes.density.sum(axis=1)[:_PRINTED_MODES])
            rows.append([name, *(f"{value:+.3f}" for value in effects), f"{100 * elements:.0f} %", f"{100 * mass:.0f} %",
                         f"{gains.max():+.3g}", f"{gains.min():+.3g}"])
        return rows

    @property
    def header(self) -> list[str]:
        """Titles of `rows`."""
        modes = range(1, min(_PRINTED_MODES, len(self.frequency)) + 1)
        return ["body", *(f"E, mode {k}" for k in modes), *(f"density, mode {k}" for k in modes), "elements with 80 %",
                "their mass", "best Hz/kg", "worst Hz/kg"]

    def table(self) -> str:
        """Return frequencies, the effect of every body, and where a kilogram of wall raises the first mode most, as text."""
        frequencies = ", ".join(f"{f:.3f}" for f in self.frequency)
        best = "\n".join(f"  {name} at ({', '.join(f'{1e3 * x:.0f}' for x in place)}) mm: {gain:+.3g} Hz/kg"
                         for name, place, gain in self.best_elements())
        title = (f"{self.machine.name}: {frequencies} Hz; per cent of a mode's frequency for a per cent of modulus E, of "
                 "density")
        return "\n".join(with_notes([text_table(title, self.header, self.rows()),
                                     "Where a kilogram of wall raises mode 1 most:", best], self.notes))

    def to_dict(self) -> dict[str, Any]:
        """Return frequencies (Hz), sums by body and set, and the best elements of every mode, as plain data."""
        sets = {name: {part: {"modulus": modulus.tolist(), "density": density.tolist()}
                       for part, (modulus, density) in slopes.by_set().items()} for name, slopes in self.slopes.items()}
        best = [[{"body": name, "centre_m": place.tolist(), "hz_a_kg": gain} for name, place, gain in self.best_elements(k)]
                for k in range(len(self.frequency))]
        return {"frequency_hz": self.frequency.tolist(), "relative_sensitivity": sets, "best_elements": best,
                "coordinates": self.meshes.linked.size, "doubts": doubts_among(self.notes), "notes": list(self.notes)}

    def __repr__(self) -> str:
        elements = sum(len(masses) for masses in self.element_masses.values())
        return f"ElementStudy({self.machine.name!r}, {len(self.frequency)} modes, {elements} elements)"


def study_elements(machine: Machine, pose: Mapping[str, float] | None = None, modes: int = 6) -> ElementStudy:
    """Return the sensitivity of the `modes` lowest frequencies at a pose (m, rad) to E and density of every element.

    All elements of castings and solids are solved, unreduced; other bodies and all joints are as in the machine. A wall that
    is thickened by a share gains stiffness and mass by that share: what a kilogram of it buys is the sum of both slopes over
    its mass. Source: Fox, Kapoor, AIAA J. 6 (1968).

    Raises ToolpointError as `machine.assembly.full_mesh.link_full_meshes`: for a machine without meshes, with bodies that
    spin, and with gravity or loads.

    Examples
    --------
    A block bolted to the ground: stiffness of iron and bolts share the half of a per cent that a frequency gains by a per cent.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description.elastic import CastingBox, ElasticDescription, PatchDescription
    >>> foot = PatchDescription((0.1, 0.05, 0), (1, 0, 0), (0, -1, 0), 0.2, 0.1)
    >>> block = ElasticDescription((CastingBox((0, 0, 0), (0.2, 0.1, 0.1)),), {"foot": foot}, band=6000.0, mesh_size=0.1)
    >>> joint = JointDescription("ground", "block", child_interface="foot")
    >>> machine = build(MachineDescription("block", {"block": BodyDescription(elastic=block)}, {"bolts": joint}))
    >>> result = study_elements(machine, modes=2)
    >>> slopes = result.slopes["block"]
    >>> slopes.modulus.sum(axis=1).round(6).tolist(), slopes.density.sum(axis=1).round(6).tolist()
    ([0.5, 0.5], [-0.5, -0.5])
    """
    meshes = link_full_meshes(machine, pose)
    # The reduced machine tells the size of the lowest squares, from which the search begins.
    reduced = solve_modes(machine, pose, count("modes", modes) + _MAX_RIGID_COUNT)
    lowest = _SHIFT_FREQUENCY_RATIO * reduced.frequency.max(initial=0.0)
    moving = reduced.frequency[reduced.frequency > lowest]
    pairs = meshes.linked.modes(modes + len(reduced.frequency) - len(moving), shift=(2 * np.pi * float(moving.min())) ** 2)
    keep = pairs.frequency > lowest
    pairs = replace(pairs, squares=pairs.squares[keep], vectors=pairs.vectors[:, keep], residual=pairs.residual[keep])
    slopes = {name: frequency_sensitivity(part.model, pairs.squares, part.shapes(pairs.vectors))
              for name, part in meshes.meshed.items()}
    return ElementStudy(machine, meshes, pairs, slopes, (
        *_question(slopes), *(note for note in reduced.notes if isinstance(note, Doubt)), *_notes(meshes)))


def _question(slopes: Mapping[str, ElementSensitivity]) -> list[Doubt]:
    """Return the doubt about modes that lie together: every body states the same ones."""
    together = dict.fromkeys(note for part in slopes.values() for note in part.notes)
    return [Doubt("modes", "; ".join(together))] if together else []


def _notes(meshes: FullMeshes) -> tuple[str, ...]:
    return (f"{meshes.linked.size} coordinates of all elements; slopes are of first order, of undamped modes: they hold for "
            "small changes, and near edges they hang on the size of the mesh",
            "joints stay as they are: a wall that is thickened under a guideway moves its rails in no slope")
