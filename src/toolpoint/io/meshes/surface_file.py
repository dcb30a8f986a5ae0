"""Surfaces of stocks and parts: triangles of an STL file, or of the one solid of a STEP file by its mesh (extra `mesh`)."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning
from toolpoint.bodies.solid import STEEL, ElementBlock, SolidModel
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.io.door import check_regular
from toolpoint.io.meshes import stl
from toolpoint.io.meshes.step_file import MILLIMETRE, SUFFIXES, StepMesh, measure_step, mesh_step
from toolpoint.io.meshes.step_part import outward

_FIRST_SIZE_RATIO = 0.1  # of the solid's largest extent: longest side of an element at first
_MAX_SURFACE_ERROR = 5e-4  # between the triangles and the geometry, up to which no finer mesh is asked for
_MIN_DOUBTED_SURFACE_ERROR = 1e-3
_MESH_ROUNDS = 4  # each with elements of half the size
_QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of a face with its mid nodes


def read_surface(path: str | Path) -> FloatArray:
    """Return the triangles (t, 3, 3) of a closed surface: of an STL file in its own unit, of a STEP file in mm.

    A STEP solid is meshed by Netgen until its triangles hold its volume within 0.05 %.

    Raises
    ------
    ToolpointError
        For a damaged file, and for a STEP file without Netgen (extra `mesh`), with several solids or without a unit.

    Examples
    --------
    >>> import tempfile
    >>> facet = "facet normal 0 0 1\\nouter loop\\nvertex 0 0 0\\nvertex 1 0 0\\nvertex 0 1 0\\nendloop\\nendfacet\\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "plate.stl")
    ...     _ = file.write_text(f"solid plate\\n{facet}endsolid plate\\n")
    ...     read_surface(file).shape
    (1, 3, 3)
    """
    place = Path(path)
    return _of_step(place) if place.suffix.lower() in SUFFIXES else stl.read(place)


def _of_step(path: Path) -> FloatArray:
    """Return the triangles of the one solid of a STEP file, mm."""
    check_regular(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: there is no such file")
    geometry = measure_step(path)
    size, difference = _FIRST_SIZE_RATIO * geometry.largest, np.inf
    triangles: FloatArray = np.zeros((0, 3, 3))
    for _ in range(_MESH_ROUNDS):
        triangles = _outer_triangles(mesh_step(geometry, size))
        difference = volume_within(triangles) / geometry.volume - 1
        if abs(difference) <= _MAX_SURFACE_ERROR:
            break
        size /= 2
    if abs(difference) > _MIN_DOUBTED_SURFACE_ERROR:
        warnings.warn(f"{path}: the triangles of its surface differ by {100 * difference:+.2g} % from its volume: small "
                      "fillets or holes are coarse; give an STL file with a finer surface", ToolpointWarning, stacklevel=3)
    return triangles / MILLIMETRE


def _outer_triangles(mesh: StepMesh) -> FloatArray:
    """Return the triangles of the outer faces of a mesh, four of each by its mid nodes, outwards."""
    model = SolidModel(mesh.nodes, (ElementBlock(outward(mesh)),), {"body": STEEL})
    (faces,) = outer_faces(model)
    return np.asarray(mesh.nodes[faces[:, _QUARTERS].reshape(-1, 3)])


def volume_within(triangles: FloatArray) -> float:
    """Return the volume within closed triangles (t, 3, 3) that face outwards.

    Examples
    --------
    >>> corner = np.zeros(3)
    >>> x, y, z = np.eye(3)
    >>> round(6 * volume_within(np.array([[corner, y, x], [corner, x, z], [corner, z, y], [x, y, z]])), 12)
    1.0
    """
    return float(np.einsum("ti,ti->t", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)
