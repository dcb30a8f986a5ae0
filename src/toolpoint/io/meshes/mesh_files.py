"""The one way in for meshes: any format by its suffix, with unit and materials, checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, IndexArray, ToolpointError, fail
from toolpoint.bodies.solid import ElementBlock, Material, SolidModel
from toolpoint.bodies.solid.checks import check_pieces, check_size
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.io.door import check_regular
from toolpoint.io.meshes import abaqus_inp, ansys_cdb, nastran_bulk
from toolpoint.io.meshes.mesh_content import MeshContent

_UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
_READERS: dict[str, Callable[[Path], MeshContent]] = {
    ".inp": abaqus_inp.read, ".cdb": ansys_cdb.read, ".bdf": nastran_bulk.read, ".nas": nastran_bulk.read,
    ".dat": nastran_bulk.read}


def read_mesh(path: str | Path, materials: Material | Mapping[str, Material], *, unit: str) -> SolidModel:
    """Return the solid model of a mesh file.

    Parameters
    ----------
    path : path
        .inp, .cdb, .bdf, .nas or .dat.
    materials : Material, or mapping of set name to Material
        One for all sets, or one for each.
    unit : str
        Of the file's lengths: ``m``, ``mm``, ``cm`` or ``in``. No mesh file says it, so it must be given.

    Elements of 4 or 8 nodes are given mid-side nodes on their straight edges.

    Raises ToolpointError for a size that no part of a machine has (a wrong unit), several bodies, wedges and pyramids.

    Examples
    --------
    >>> import tempfile
    >>> from toolpoint.bodies.solid import STEEL
    >>> corners = [(x, y, z) for z in (0, 200) for x, y in ((0, 0), (300, 0), (300, 100), (0, 100))]
    >>> lines = ["*NODE", *(f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(corners, 1)),
    ...          "*ELEMENT, TYPE=C3D8, ELSET=BLOCK", "1, 1, 2, 3, 4, 5, 6, 7, 8"]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "block.inp"
    ...     written = path.write_text("\\n".join(lines))
    ...     model = read_mesh(path, STEEL, unit="mm")
    >>> model.element_count, (1e3 * model.nodes.max(axis=0)).round(6).tolist()  # mm
    (1, [300.0, 100.0, 200.0])
    """
    return build_model(read_content(Path(path)), materials, unit=unit)


def build_model(content: MeshContent, materials: Material | Mapping[str, Material], *, unit: str) -> SolidModel:
    """Return the solid model of a mesh file's content; parameters and errors as of `read_mesh`."""
    used = np.unique(np.concatenate([block.ravel() for block in content.elements.values()]))
    place = {int(number): k for k, number in enumerate(used)}
    blocks = [ElementBlock(np.searchsorted(used, block), name) for name, block in content.elements.items()]
    of_set = dict.fromkeys(content.elements, materials) if isinstance(materials, Material) else dict(materials)
    sets = {name: np.array([place[int(n)] for n in members if int(n) in place]) for name, members in content.node_sets.items()}
    model = SolidModel(content.places[np.searchsorted(content.numbers, used)] * _factor(unit), tuple(blocks), of_set,
                       {name: value for name, value in sets.items() if len(value)})
    check_size(np.ptp(model.nodes, axis=0))
    check_pieces(model)
    return replace(model, surfaces=_surfaces(content, model, place)) if content.surfaces else model


def _factor(unit: str) -> float:
    """Return metres in a unit."""
    if unit not in _UNITS:
        fail("unit", repr(unit), f"must be one of {', '.join(_UNITS)}")
    return _UNITS[unit]


def _surfaces(content: MeshContent, model: SolidModel, place: Mapping[int, int]) -> dict[str, tuple[IndexArray, ...]]:
    """Return the outer faces of every surface; faces inside the body belong to none."""
    groups = outer_faces(model)
    row_of = {tuple(sorted(face[:len(face) // 2].tolist())): (k, row) for k, group in enumerate(groups)
              for row, face in enumerate(group)}
    surfaces = {}
    for name, faces in content.surfaces.items():
        rows = [row_of[key] for face in faces if (key := tuple(sorted(place[n] for n in face))) in row_of]
        chosen = [np.unique([row for k, row in rows if k == i]).astype(int) for i in range(len(groups))]
        surfaces[name] = tuple(group[numbers] for group, numbers in zip(groups, chosen, strict=True) if len(numbers))
    return {name: faces for name, faces in surfaces.items() if faces}


def is_mesh(path: Path) -> bool:
    """Return whether a file is a mesh by its suffix."""
    return path.suffix.lower() in _READERS


def read_nodes(path: Path) -> dict[str | int, FloatArray]:
    """Return the places of the nodes of a mesh file by number, in the file's own unit."""
    content = read_content(path)
    return {int(number): value for number, value in zip(content.numbers, content.places, strict=True)}


def read_sets(path: Path) -> tuple[str, ...]:
    """Return the names of the sets of elements of a mesh file."""
    return tuple(read_content(path).elements)


def read_content(path: Path) -> MeshContent:
    """Return what a mesh file of any format holds, in its own units."""
    check_regular(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise ToolpointError(f"{path}: suffix {path.suffix!r}; must be one of {', '.join(_READERS)}")
    return reader(path)
