"""A described solid body with the content of its file: a STEP solid that is meshed, or the mesh of another program."""

from __future__ import annotations

import hashlib
from dataclasses import fields
from pathlib import Path

from toolpoint._check import fail
from toolpoint.bodies.solid import Material, SolidModel
from toolpoint.bodies.solid.checks import check_solid
from toolpoint.io.meshes.mesh_files import build_model, read_content
from toolpoint.io.meshes.mesh_material import material_of_file
from toolpoint.io.meshes.step_file import SUFFIXES
from toolpoint.io.meshes.step_part import read_step
from toolpoint.machine.description.elastic import CAST_IRON, ElasticMaterial, SolidBody, SolidContent, SolidDescription


def read_solid(described: SolidDescription, folder: Path) -> SolidBody:
    """Return the described body with its mesh, checked for size, pieces and quality; the file lies in the folder.

    Raises ToolpointError beginning with the key at fault.
    """
    path = folder / described.file
    if not path.is_file():
        fail("solid.file", repr(described.file), f"must be a file in {folder}", remedy="paths are relative to the machine file")
    model, notes, materials = _step(path, described) if path.suffix.lower() in SUFFIXES else _mesh(path, described)
    arrays = [model.nodes, *(block.nodes for block in model.blocks), *model.node_sets.values(),
              *(faces for group in model.surfaces.values() for faces in group)]
    digest = hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()[:32]
    numbers = {field.name: getattr(described, field.name) for field in fields(described)} | {"materials": materials}
    return SolidBody(**numbers, digest=digest, content=SolidContent(model, notes))


def _step(path: Path, described: SolidDescription) -> tuple[SolidModel, tuple[str, ...], dict[str, ElasticMaterial]]:
    if described.mesh_size is None:
        fail("solid.mesh_size", "missing", "must be given for a STEP file",
             remedy="for example a third of the thickest wall: 30 mm")
    materials = dict(described.materials) or {"body": CAST_IRON}
    if set(materials) != {"body"}:
        fail("solid.materials", f"sets {', '.join(materials)}", "must be one, body: a STEP solid is of one material")
    part = read_step(path, _material(materials["body"]), mesh_size=described.mesh_size, unit=described.unit or None)
    return part.model, part.notes, materials


def _mesh(path: Path, described: SolidDescription) -> tuple[SolidModel, tuple[str, ...], dict[str, ElasticMaterial]]:
    if described.mesh_size is not None:
        fail("solid.mesh_size", f"{described.mesh_size:g} m", "serves a STEP file only",
             remedy="remove it: this file is a mesh")
    if not described.unit:
        fail("solid.unit", "missing", "must be m, mm, cm or in", remedy="no mesh file says in which unit its lengths are")
    content = read_content(path)
    materials, notes = {}, list(content.notes)
    for name in content.elements:
        if name in described.materials:
            materials[name] = described.materials[name]
        else:
            materials[name], note = material_of_file(path, content, name, unit=described.unit)
            notes.append(note)
    unknown_sets = [name for name in described.materials if name not in materials]
    if unknown_sets:
        fail(f"solid.materials.{unknown_sets[0]}", f"no such set in {path.name}", f"must be of {', '.join(materials)}")
    model = build_model(content, {name: _material(part) for name, part in materials.items()}, unit=described.unit)
    check = check_solid(model)
    note = f"{path.name}: {check.mass:.5g} kg, {model.element_count} elements, worst Jacobian ratio {check.jacobian_ratio:.2g}"
    return model, (note, *notes, *check.notes), materials


def _material(part: ElasticMaterial) -> Material:
    return Material(part.modulus, part.poisson, part.density, part.loss_factor)
