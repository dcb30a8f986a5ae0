r"""Mass properties of a solid bounded by a closed triangle mesh.

Every triangle spans a tetrahedron with the origin; signed volumes and second moments add up (divergence theorem).
Source: Tonon, J. Math. Stat. 1 (2005); Eberly, Polyhedral Mass Properties, 2002.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.bodies.inertia import MassProperties


def mass_properties(nodes: ArrayLike, triangles: ArrayLike, density: float) -> MassProperties:
    """Return the mass properties of the enclosed solid.

    Parameters
    ----------
    nodes : (n, 3) floats
        Corner coordinates, m.
    triangles : (t, 3) ints
        Corners of each triangle, counter-clockwise seen from outside.
    density : float
        kg/m^3.

    Raises
    ------
    ToolpointError
        For an open mesh, triangles turned against each other, or a mesh turned inside out.
    """
    points, faces = floats("nodes", nodes, (None, 3)), check_triangles(nodes, triangles)
    centre = points.mean(axis=0)
    # About the centre of the nodes, so that distant coordinates cost no digits.
    a, b, c = (points[faces[:, i]] - centre for i in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    volume = float(volumes.sum())
    if volume <= 0:
        fail("triangles", f"enclosed volume {volume:g} m^3", "must be positive",
             remedy="the mesh is inside out: swap two corners")
    offset = (volumes[:, None] * (a + b + c) / 4).sum(axis=0) / volume
    total = a + b + c
    second = (np.einsum("t,ti,tj->ij", volumes, total, total)
              + sum(np.einsum("t,ti,tj->ij", volumes, p, p) for p in (a, b, c))) / 20
    second = second - volume * np.outer(offset, offset)
    rho = positive("density", density)
    return MassProperties(rho * volume, centre + offset, rho * (np.trace(second) * np.eye(3) - second))


def check_triangles(nodes: ArrayLike, triangles: ArrayLike) -> np.ndarray:
    """Return the triangles after checking that they bound a solid: closed, and all turned the same way."""
    faces = np.asarray(triangles)
    if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer) or len(faces) < 4:
        fail("triangles", f"shape {faces.shape}, {faces.dtype}", "must be at least 4 rows of 3 node numbers")
    count = len(np.asarray(nodes))
    if faces.min() < 0 or faces.max() >= count:
        fail("triangles", f"node number {int(faces.max())}", f"must be within 0 .. {count - 1}")
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    code = edges[:, 0].astype(np.int64) * count + edges[:, 1]
    reverse_code = edges[:, 1].astype(np.int64) * count + edges[:, 0]
    unique, repeats = np.unique(code, return_counts=True)
    if (repeats > 1).any():
        edge = divmod(int(unique[repeats > 1][0]), count)
        fail("triangles", f"edge {edge[0]}-{edge[1]} {_edge_in_words(nodes, edge)} is run through twice in the same direction",
             "neighbours must be turned the same way", remedy="turn the triangles consistently, or remove doubled ones")
    open_edges = np.setdiff1d(reverse_code, code)
    if open_edges.size:
        edge = divmod(int(open_edges[0]), count)
        fail("triangles", f"{open_edges.size} open edges, the first {edge[1]}-{edge[0]} {_edge_in_words(nodes, edge)}",
             "must close around a solid",
             remedy="merge equal nodes, or fill the holes in the CAD program")
    return faces


def _edge_in_words(nodes: ArrayLike, edge: tuple[int, int]) -> str:
    """Return the middle of an edge in words, mm."""
    centre = 1e3 * np.asarray(nodes, float)[list(edge)].mean(axis=0)
    return "at " + ", ".join(f"{name} {value:.5g}" for name, value in zip("xyz", centre + 0.0, strict=True)) + " mm"


def merge_corners(corners: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return nodes and triangles of triangle corners (t, 3, 3) as in STL files, equal corners merged."""
    nodes, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return nodes, index.reshape(-1, 3)
