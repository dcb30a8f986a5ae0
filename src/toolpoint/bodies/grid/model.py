"""GridModel: parts over grid points and the ties between them, and its assembled matrices."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.bodies.grid.bar import BarSection, bar_frame, bar_stiffness, consistent_mass, end_mass, end_motion, release_ends
from toolpoint.bodies.grid.tie import WAYS, TieEquation, eliminate_ties
from toolpoint.bodies.imported import ImportedMatrices, TiedRows
from toolpoint.spatial.rotation import skew
from toolpoint.vibration import Dof


@dataclass(frozen=True, eq=False)
class GridPart:
    """Share of an element: symmetric stiffness and mass over its coordinates, (n, n), dense or sparse, or None."""

    dofs: tuple[Dof, ...]
    stiffness: FloatArray | csc_array | None = None
    mass: FloatArray | csc_array | None = None


@dataclass(frozen=True, eq=False)
class Bar:
    """A bar between two grid points.

    ends : numbers of its points; toward : (3,), into plane 1; offsets : (2, 3), from the points to the bar's ends; hinges :
    rows 0 .. 11 at its ends that carry no force.
    """

    ends: tuple[int, int]
    section: BarSection
    toward: FloatArray
    offsets: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    hinges: tuple[int, ...] = ()


def bar_part(places: Mapping[int, FloatArray], bar: Bar, *, is_coupled: bool) -> GridPart:
    """Return what a bar adds, its mass along it (`is_coupled`) or half at each end."""
    start, end = (places[point] + offset for point, offset in zip(bar.ends, bar.offsets, strict=True))
    axes, length = bar_frame(start, end, bar.toward), float(np.linalg.norm(end - start))
    motion = end_motion(axes, bar.offsets)
    mass = (consistent_mass if is_coupled else end_mass)(bar.section, length)
    stiffness = release_ends(bar_stiffness(bar.section, length), list(bar.hinges))
    return GridPart(point_dofs(bar.ends), motion.T @ stiffness @ motion, motion.T @ mass @ motion)


def spring_part(ends: Sequence[Dof | None], stiffness: float) -> GridPart:
    """Return a scalar spring between two coordinates; None is the ground."""
    signs = {dof: sign for dof, sign in zip(ends, (1.0, -1.0), strict=True) if dof is not None}
    row = np.array(list(signs.values()))
    return GridPart(tuple(signs), stiffness * np.outer(row, row))


def bushing_part(places: Mapping[int, FloatArray], ends: Sequence[int], *, centre: FloatArray, axes: FloatArray,
                 stiffness: FloatArray) -> GridPart:
    """Return six springs (6,) along `axes` (3, 3, in rows) at a centre (3,) between two points, or one and the ground."""
    rows = []
    for sign, point in zip((-1.0, 1.0), ends, strict=False):
        rows.append(sign * end_motion(axes, np.array([centre - places[point]]))[:6, :6])
    motion = np.hstack(rows)
    return GridPart(point_dofs(ends), motion.T @ (stiffness[:, None] * motion))


def mass_part(point: int, mass: float, *, offset: FloatArray, inertia: FloatArray) -> GridPart:
    """Return a rigid mass at an offset (3,) from its point, with its inertia (3, 3) about its own centre."""
    arm = skew(offset)
    matrix = np.block([[mass * np.eye(3), -mass * arm], [mass * arm, inertia - mass * arm @ arm]])
    return GridPart(point_dofs((point,)), None, matrix)


def point_dofs(points: Iterable[int]) -> tuple[Dof, ...]:
    """Return the six coordinates of each point."""
    return tuple(Dof(point, way) for point in points for way in WAYS)


@dataclass(frozen=True, eq=False)
class GridModel(NotebookText):
    """Parts over grid points in one consistent system of units, and ties between their coordinates.

    Parameters
    ----------
    places : mapping of point number to (3,) floats
    parts : sequence of GridPart
    ties : sequence of TieEquation
    notes : sequence of str
        What the model leaves out, and doubts.

    Examples
    --------
    Two masses on a spring swing at sqrt(k (1/m1 + 1/m2)):

    >>> import numpy as np
    >>> ends = (Dof(1, "+x"), Dof(2, "+x"))
    >>> masses = [GridPart((end,), mass=np.array([[mass]])) for end, mass in zip(ends, (1.0, 3.0))]
    >>> places = {1: np.zeros(3), 2: np.array([1.0, 0, 0])}
    >>> assembled = GridModel(places, (*masses, spring_part(ends, 300.0))).assemble()
    >>> [round(float(w), 9) for w in assembled.modes(2).frequency * 2 * np.pi]
    [0.0, 20.0]
    """

    places: Mapping[int, FloatArray]
    parts: tuple[GridPart, ...]
    ties: tuple[TieEquation, ...] = ()
    notes: tuple[str, ...] = ()

    def assemble(self, *, length: float = 1.0, force: float = 1.0) -> ImportedMatrices:
        """Return stiffness and mass in SI units over the coordinates that follow no other.

        length, force : m and N of the model's units (mm and N: 1e-3, 1), whose unit of time is the second.

        Coordinates without stiffness and mass are left out. Raises ToolpointError for ties that contradict each other, and for
        a model without mass or stiffness.
        """
        dofs = tuple(dict.fromkeys([
            *(dof for part in self.parts for dof in part.dofs),
            *(dof for tie in self.ties for dof in (tie.follower, *tie.terms))]))
        left, motion = eliminate_ties(dofs, self.ties)
        # u in the model's units per u in SI: a model in mm counts a thousand for a metre, rotations are rad in both.
        scale = diags_array(np.array([1.0 if dof.is_rotation else 1 / length for dof in left]))
        energy = force * length
        both = [csc_array(energy * (scale @ (motion.T @ _sum_parts(dofs, self.parts, name) @ motion) @ scale))
                for name in ("stiffness", "mass")]
        keep = np.flatnonzero(sum(np.abs(matrix.diagonal()) for matrix in both) > 0)
        for name, matrix in zip(("stiffness", "mass"), both, strict=True):
            if not matrix.nnz:
                fail("model", f"no {name}", "must have stiffness and mass")
        stiffness, mass = (csc_array((matrix + matrix.T) / 2)[keep][:, keep] for matrix in both)
        followers = [dof for dof in dofs if dof not in set(left)]
        place = {dof: k for k, dof in enumerate(dofs)}
        unscale = diags_array(np.array([1.0 if dof.is_rotation else length for dof in followers])) if followers else None
        tied = None if unscale is None else TiedRows(
            tuple(followers), csc_array(unscale @ csc_array(motion)[[place[dof] for dof in followers]] @ scale)[:, keep])
        return ImportedMatrices(csc_array(stiffness), csc_array(mass), tuple(left[k] for k in keep),
                                {point: length * np.asarray(place, float) for point, place in self.places.items()},
                                notes=self.notes, tied=tied)


def _sum_parts(dofs: Sequence[Dof], parts: Sequence[GridPart], name: str) -> csc_array:
    """Return stiffness or mass of all parts over `dofs`."""
    place = {dof: k for k, dof in enumerate(dofs)}
    rows, columns, values = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros(0)]
    for part in parts:
        matrix = getattr(part, name)
        if matrix is None:
            continue
        entries, index = coo_array(matrix), np.array([place[dof] for dof in part.dofs])
        rows.append(index[entries.coords[0]])
        columns.append(index[entries.coords[1]])
        values.append(entries.data)
    return csc_array(coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
                               shape=(len(dofs), len(dofs))))
