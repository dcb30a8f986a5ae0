"""A STEP file -> a solid model of 10-node tetrahedra, questioned first: unit, size, pieces, mass against geometry."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning, fail, positive
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.bodies.solid import ElementBlock, Material, SolidModel
from toolpoint.bodies.solid.checks import SIZE_LIMITS, SolidCheck, check_size, check_solid
from toolpoint.bodies.solid.straighten import straighten
from toolpoint.io.door import check_regular
from toolpoint.io.meshes.step_file import StepGeometry, StepMesh, measure_step, mesh_step, unit_name

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
MIN_PART_LENGTH, MAX_PART_LENGTH, MAX_PART_MASS = 10e-3, 10.0, 5e4  # m, m, kg: parts beyond are asked about
MAX_MESH_DIFFERENCE = 0.01  # difference of mass or centre between mesh and geometry above which a mesh is called too coarse


@dataclass(frozen=True, eq=False)
class StepPart(NotebookText):
    """A meshed STEP solid.

    model : SolidModel, one set ``body``; check : its size, mass and quality; geometry : what the mesh stands for; notes : unit,
    elements, and what a user must know.
    """

    model: SolidModel
    check: SolidCheck
    geometry: StepGeometry
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"StepPart({self.check!r}, {self.model.element_count} tetrahedra, {self.model.size} coordinates)"


def read_step(path: str | Path, material: Material, *, mesh_size: float, unit: str | None = None) -> StepPart:
    """Return the finite-element model of the one solid of a STEP file.

    Parameters
    ----------
    path : path
        .step or .stp.
    material : Material
    mesh_size : float
        Longest side of an element, m; Netgen takes smaller ones where faces bend or are close.
    unit : str, optional
        ``m``, ``mm``, ``cm`` or ``in``: only for a file that states a wrong unit, which is believed otherwise.

    Raises
    ------
    ToolpointError
        Without Netgen (extra `mesh`); for a damaged file, none or several solids, a size that no part of a machine has, or a
        unit that contradicts a file which makes sense in its own.
    """
    path = Path(path)
    check_regular(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: there is no such file")
    positive("mesh_size", mesh_size)
    geometry = measure_step(path)
    factor = 1.0 if unit is None else _factor(unit, geometry)
    geometry = geometry.scaled(factor)
    notes = _unit_notes(geometry, factor, unit, mass=material.density * geometry.volume)
    check_size(geometry.high - geometry.low)
    mesh = mesh_step(geometry, mesh_size, factor=factor)
    elements = outward(mesh)
    nodes, folded = straighten(mesh.nodes, elements)
    model = SolidModel(nodes, (ElementBlock(elements),), {"body": material})
    check = check_solid(model)
    notes += (_mesh_note(model, check, geometry, mesher=mesh.mesher),)
    if folded:
        notes += (f"{folded} curved elements folded and were straightened",)
    doubts = _doubts(model, geometry)
    for doubt in doubts:
        warnings.warn(f"{path}: {doubt}", ToolpointWarning, stacklevel=2)
    return StepPart(model, check, geometry, notes + doubts + check.notes)


def _factor(unit: str, geometry: StepGeometry) -> float:
    """Return the given unit over the stated one; refuse one that contradicts a file which makes sense in its own."""
    if unit not in UNITS:
        fail("unit", repr(unit), f"must be one of {', '.join(UNITS)}")
    factor = UNITS[unit] / geometry.stated
    if abs(factor - 1) < 1e-9:
        return 1.0
    if SIZE_LIMITS[0] <= geometry.largest <= SIZE_LIMITS[1]:
        fail("unit", f"{unit!r}: as that the part would be {factor * geometry.largest:.4g} m long",
             f"must agree with the file, which states {unit_name(geometry.stated)} and so is {geometry.largest:.4g} m long",
             remedy="leave unit out; or, where the file is wrong, export it again in its true unit")
    return factor


def _unit_notes(geometry: StepGeometry, factor: float, unit: str | None, *, mass: float) -> tuple[str, ...]:
    """Name what looks odd about size and mass (kg)."""
    states, largest, note = f"the file states {unit_name(geometry.stated)}", geometry.largest, ""
    if factor != 1:
        note = f"read in {unit}, though {states}, as which it would be {largest / factor:.4g} m long"
    elif not MIN_PART_LENGTH <= largest <= MAX_PART_LENGTH and SIZE_LIMITS[0] <= largest <= SIZE_LIMITS[1]:
        length, other = (f"only {1e3 * largest:.3g} mm", "m") if largest < MIN_PART_LENGTH else (f"{largest:.3g} m", "mm")
        note = f"{length} long: was it drawn in {other}? {states}; compare its mass"
    elif mass > MAX_PART_MASS and largest <= SIZE_LIMITS[1]:
        note = f"{mass:.3g} kg: was it drawn in mm? {states}, as which it is {largest:.3g} m long"
    if not note:
        return ()
    warnings.warn(f"{geometry.path}: {note}", ToolpointWarning, stacklevel=3)
    return (note,)


def outward(mesh: StepMesh) -> np.ndarray:
    """Return the elements with positive volume: a mesher that counts the other way round has its corners 2 and 3 exchanged."""
    a, b, c, d = (mesh.nodes[mesh.elements[:, k]] for k in range(4))
    turned = np.einsum("ei,ei->e", np.cross(b - a, c - a), d - a) < 0
    if not turned.any():
        return mesh.elements
    swapped = mesh.elements[:, [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    return np.where(turned[:, None], swapped, mesh.elements)


def _mesh_note(model: SolidModel, check: SolidCheck, geometry: StepGeometry, *, mesher: str) -> str:
    size = " x ".join(f"{s:.4g}" for s in check.size)
    return (f"{geometry.path.name} in {unit_name(geometry.stated)}: {size} m, {check.mass:.5g} kg, {model.element_count} "
            f"tetrahedra by {mesher}, worst Jacobian ratio {check.jacobian_ratio:.2g}, volume "
            f"{100 * _excess(model, geometry):+.2g} % and inertia {100 * _inertia_error(model, geometry):.2g} % from the "
            "geometry's; the error of the mesh is not estimated: compare "
            "with a finer one")


def _excess(model: SolidModel, geometry: StepGeometry) -> float:
    return model.mass_properties.mass / (model.materials["body"].density * geometry.volume) - 1


def _doubts(model: SolidModel, geometry: StepGeometry) -> tuple[Doubt, ...]:
    excess, centre = _excess(model, geometry), model.mass_properties.centre
    offset = float(np.linalg.norm(centre - geometry.centre) / np.linalg.norm(geometry.high - geometry.low))
    turning = _inertia_error(model, geometry)
    if max(abs(excess), offset, turning) <= MAX_MESH_DIFFERENCE:
        return ()
    return (Doubt("mesh", f"mass differs from the geometry's by {100 * excess:+.2g} %, its centre by {100 * offset:.2g} % of "
                  f"the "
                  f"size, its inertia by {100 * turning:.2g} % of the largest: the mesh is too coarse",
                  "take a smaller mesh_size", figure=max(abs(excess), offset, turning)),)


def _inertia_error(model: SolidModel, geometry: StepGeometry) -> float:
    """Return the largest difference of the mesh's inertia from the geometry's, over the largest moment of inertia."""
    meshed = model.mass_properties.inertia / model.materials["body"].density
    return float(np.abs(meshed - geometry.inertia).max() / np.linalg.eigvalsh(geometry.inertia)[-1])
