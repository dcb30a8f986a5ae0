"""The one way in for meshes: any format by its suffix, with unit and materials, checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.bodies.solid import ElementBlock, Material, SolidModel
from toolpoint.bodies.solid.checks import check_pieces, check_size
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

    Raises ToolpointError for a size that no part of a machine has (a wrong unit), several bodies, linear elements.
    """
    if unit not in _UNITS:
        fail("unit", repr(unit), f"must be one of {', '.join(_UNITS)}")
    content = _content(Path(path))
    used = np.unique(np.concatenate([block.ravel() for block in content.elements.values()]))
    place = {int(number): k for k, number in enumerate(used)}
    blocks = [ElementBlock(np.searchsorted(used, block), name) for name, block in content.elements.items()]
    of_set = dict.fromkeys(content.elements, materials) if isinstance(materials, Material) else dict(materials)
    sets = {name: np.array([place[int(n)] for n in members if int(n) in place]) for name, members in content.node_sets.items()}
    model = SolidModel(content.places[np.searchsorted(content.numbers, used)] * _UNITS[unit], tuple(blocks), of_set,
                       {name: value for name, value in sets.items() if len(value)})
    check_size(np.ptp(model.nodes, axis=0))
    check_pieces(model)
    return model


def is_mesh(path: Path) -> bool:
    """Return whether a file is a mesh by its suffix."""
    return path.suffix.lower() in _READERS


def read_nodes(path: Path) -> dict[str | int, FloatArray]:
    """Return the places of the nodes of a mesh file by number, in the file's own unit."""
    content = _content(path)
    return {int(number): value for number, value in zip(content.numbers, content.places, strict=True)}


def read_sets(path: Path) -> tuple[str, ...]:
    """Return the names of the sets of elements of a mesh file."""
    return tuple(_content(path).elements)


def _content(path: Path) -> MeshContent:
    check_regular(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise ToolpointError(f"{path}: suffix {path.suffix!r}; must be one of {', '.join(_READERS)}")
    return reader(path)
