r"""Matrices of another finite-element program -> a body of a machine, with interfaces over groups of its points.

Where only points are known, an interface moves as the rigid motion nearest to them in the least-squares sense (RBE3):
:math:`q = (R^T w R)^{-1} R^T w u`. Resultants are kept and nothing is stiffened; weights by points change in jumps from mesh to
mesh, so a place that slides needs faces (`elastic_body.SlidingPatch`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail, floats
from toolpoint.bodies import Body, Interface, MassProperties
from toolpoint.bodies.imported import ImportedMatrices
from toolpoint.machine.description.matrices import MatricesBody
from toolpoint.machine.parts.content_key import ContentKey
from toolpoint.machine.parts.elastic_body import free_body
from toolpoint.machine.parts.residual_places import PlaceLoads
from toolpoint.spatial.rotation import skew
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reduction import ReductionMethod, reduce
from toolpoint.vibration import Dof

MIN_SINGULAR_RATIO = 1e-6  # smallest over largest singular value of a group's rigid motions below which it leaves a motion open


@dataclass(frozen=True, eq=False)
class PointGroup:
    """Points that an interface holds on to.

    points : their names or numbers; at : the interface's place, m (the mean of the points where left out); weights : of each.
    """

    points: Sequence[str | int]
    at: FloatArray | None = None
    weights: FloatArray | None = None


def reduce_matrices(matrices: ImportedMatrices, interfaces: Mapping[str, PointGroup], *, band: float, size: int | None = None,
                    method: ReductionMethod | None = None) -> Body:
    """Return a free body of imported matrices, reduced, in the frame of their coordinates.

    Parameters
    ----------
    matrices : ImportedMatrices
        With coordinates of all points; not held anywhere.
    interfaces : mapping of name to PointGroup
    band, size, method : as in `elastic_body.reduce_solid`

    Raises
    ------
    ToolpointError
        For points without coordinates, a group that leaves a motion open (a single point, points on a line without rotations),
        or a body that is held in its matrices.
    """
    _check_places(matrices)
    origin = np.zeros(3)
    rigid = _motions(matrices, list(matrices.dofs), origin)
    places = {name: _place(matrices, group) for name, group in interfaces.items()}
    columns = [_weights(matrices, name, group, places[name]) for name, group in interfaces.items()]
    if not columns:
        fail("interfaces", "none", "must be at least one", remedy="a body is held by its interfaces")
    body = LargeBody(matrices.stiffness, matrices.mass, np.hstack(columns), rigid)
    reduction = reduce(body, method or ActingLoads(band), size)
    held = {name: Interface(places[name], weights.T @ reduction.vectors)
            for name, weights in zip(interfaces, columns, strict=True)}
    loads = {name: PlaceLoads.fixed(csc_array(weights)) for name, weights in zip(interfaces, columns, strict=True)}
    return free_body(reduction, rigid.T @ (matrices.mass @ rigid), matrices.notes, interfaces=held, places=loads)


def _check_places(matrices: ImportedMatrices) -> None:
    unplaced = sorted({str(dof.point) for dof in matrices.dofs if dof.point not in matrices.coordinates})
    if unplaced:
        fail("matrices.coordinates", f"none for {len(unplaced)} points, the first {unplaced[0]}", "every point needs its place",
             remedy="give `coordinates`, point to (x, y, z) in m")


def build_matrices(body: MatricesBody) -> Body:
    """Return the reduced body of a description; kept in memory as long as its matrices are."""
    return _reduce_described(ContentKey(f"{id(body.content)} {body.description!r}", body))


@lru_cache(maxsize=64)
def _reduce_described(key: ContentKey[MatricesBody]) -> Body:
    described = key.description.description
    groups = {name: PointGroup(group.points, np.array(group.at) if group.at else None)
              for name, group in described.interfaces.items()}
    return reduce_matrices(key.description.content, groups, band=described.band, size=described.size)


def matrices_mass(body: MatricesBody) -> MassProperties:
    """Return the mass properties of a described body: its mass matrix in the rigid motions of its points."""
    matrices = body.content
    _check_places(matrices)
    rigid = _motions(matrices, list(matrices.dofs), np.zeros(3))
    return MassProperties.of_matrix(rigid.T @ (matrices.mass @ rigid))


def _motions(matrices: ImportedMatrices, dofs: Sequence[Dof], about: FloatArray) -> FloatArray:
    """Return the motion of labelled rows per twist (v, w) about a place, (n, 6)."""
    rows = []
    for dof in dofs:
        arm = floats(f"coordinates[{dof.point!r}]", matrices.coordinates[dof.point], (3,)) - about
        rows.append(dof.unit @ np.block([[np.eye(3), -skew(arm)], [np.zeros((3, 3)), np.eye(3)]]))
    return np.array(rows)


def _place(matrices: ImportedMatrices, group: PointGroup) -> FloatArray:
    """Return the place (3,) of an interface: as stated, else the mean of its points."""
    if group.at is not None:
        return floats("at", group.at, (3,))
    unknown = [point for point in group.points if point not in matrices.coordinates]
    if unknown or not group.points:
        fail("points", f"no {unknown[0]}" if unknown else "none", "must be points of the matrices")
    return np.mean([matrices.coordinates[point] for point in group.points], axis=0)


def _weights(matrices: ImportedMatrices, name: str, group: PointGroup, interface_place: FloatArray) -> FloatArray:
    """Return W (n, 6): the interface's twist about its place is W^T u. Rotations count where there are no other rows."""
    dofs = (*matrices.dofs, *(matrices.tied.dofs if matrices.tied else ()))
    all_rows = [k for k, dof in enumerate(dofs) if dof.point in group.points]
    translation_rows = [k for k in all_rows if not dofs[k].is_rotation]
    point_weights = np.ones(len(group.points)) if group.weights is None else floats("weights", group.weights,
                                                                                    (len(group.points),))
    for rows in (translation_rows, all_rows):
        motion = _motions(matrices, [dofs[k] for k in rows], interface_place) if rows else np.zeros((0, 6))
        arm = max(float(np.abs(motion[:, 3:]).max(initial=0.0)), 1e-12)
        scaled = motion / np.array([1, 1, 1, arm, arm, arm])
        singular = np.linalg.svd(scaled, compute_uv=False) if len(rows) >= 6 else np.zeros(1)
        if singular[-1] > MIN_SINGULAR_RATIO * singular[0] and singular[0] > 0:
            weight = np.array([point_weights[list(group.points).index(dofs[k].point)] for k in rows])
            result = np.zeros((len(dofs), 6))
            result[rows] = weight[:, None] * motion @ np.linalg.inv(motion.T @ (weight[:, None] * motion))
            return _on_rows(matrices, result)
    fail(f"interfaces.{name}", f"{len(group.points)} points with {len(all_rows)} rows", "must tell six motions apart",
         remedy="an interface of one point, or of points on a line, leaves a rotation open: take points around the place")


def _on_rows(matrices: ImportedMatrices, weights: FloatArray) -> FloatArray:
    """Return weights of the rows (n, 6) equal to those of all coordinates (n + n_tied, 6): a follower's go to its leaders."""
    rows, followers = weights[:matrices.size], weights[matrices.size:]
    return rows if matrices.tied is None else rows + matrices.tied.motion.T @ followers
