"""ImportedMatrices: stiffness and mass that another finite-element program assembled, with labels of its rows."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, ToolpointWarning, fail
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.vibration import Dof, Modes
from toolpoint.vibration.dof import check_labels
from toolpoint.vibration.sparse import modes
from toolpoint.vibration.sparse.factorisation import check_symmetric

_MAX_MASS_SPREAD = 1e-6  # of the largest: relative difference of total mass between directions
_MIN_TOP_FREQUENCY = 0.01  # Hz, of the stiffest row alone: below, stiffness and mass are exchanged or in other units


@dataclass(frozen=True, eq=False)
class TiedRows:
    """Coordinates that follow those of a body: their labels, and their motion per row of its matrices, (n_tied, n)."""

    dofs: tuple[Dof, ...]
    motion: csc_array


@dataclass(frozen=True, eq=False)
class ImportedMatrices(NotebookText):
    """Stiffness and mass of a body, symmetric, both triangles stored, in SI units.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse arrays
        N/m and kg (rotations: N m/rad and kg m^2).
    dofs : sequence of Dof
        Label of every row.
    coordinates : mapping of point to (3,) floats, optional
        m.
    notes : sequence of str
        Parts of the file left out, and doubts.
    is_labelled : bool
        Whether the file says which direction each row is; where not, no mass is stated.
    tied : TiedRows, optional
        Coordinates that ties make follow the rows; interfaces may stand on them.

    Raises ToolpointError for matrices that are not square, of one size, finite and symmetric.
    """

    stiffness: csc_array
    mass: csc_array
    dofs: tuple[Dof, ...]
    coordinates: Mapping[str | int, FloatArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    is_labelled: bool = True
    tied: TiedRows | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "stiffness", check_symmetric("ImportedMatrices.stiffness", self.stiffness))
        put(self, "mass", check_symmetric("ImportedMatrices.mass", self.mass))
        if self.mass.shape != self.stiffness.shape:
            fail("ImportedMatrices.mass", f"shape {self.mass.shape}", f"must be that of the stiffness, {self.stiffness.shape}")
        negative = np.flatnonzero(self.mass.diagonal() < 0)
        if negative.size:
            fail("ImportedMatrices.mass", f"{self.mass.diagonal()[negative[0]]:g} on the diagonal of row {negative[0] + 1} "
                 f"({negative.size} rows in all)", "must not be negative", remedy="is it the mass, and of this model?")
        put(self, "dofs", check_labels("ImportedMatrices.dofs", self.dofs, self.stiffness.shape[0]))
        put(self, "notes", (*self.notes, *self._doubts()))

    def _doubts(self) -> tuple[Doubt, ...]:
        """Return and warn of what is implausible: a mass that differs by direction, rows without mass, entries far from SI."""
        doubts = []
        total = self.directional_mass
        present = total[total > 0]
        if len(present) and np.ptp(present) > _MAX_MASS_SPREAD * present.max():
            doubts.append(Doubt("mass differs by direction", ", ".join(f"{m:.6g}" for m in total) + " kg along x, y, z: held "
                                "rows were left out, or rows are labelled wrongly",
                                figure=float(np.ptp(present) / present.max())))
        is_turn = np.array([dof.is_rotation and self.is_labelled for dof in self.dofs], dtype=bool)
        # Rotations without mass are common (masses lumped at points); translations are not.
        massless = int((self.mass.diagonal()[~is_turn] <= 0).sum())
        if massless:
            doubts.append(Doubt("mass", f"{massless} of {len(self.dofs)} rows have no mass, rotations aside"))
        springs, inertias = self.stiffness.diagonal(), self.mass.diagonal()
        top_frequency = float(np.sqrt(np.abs(springs[inertias > 0] / inertias[inertias > 0]).max(initial=0.0))) / (2 * np.pi)
        if 0 < top_frequency < _MIN_TOP_FREQUENCY:
            doubts.append(Doubt("stiffness and mass", f"the stiffest row alone would swing at {top_frequency:.2g} Hz",
                                "are they exchanged, or in units of their own?", figure=top_frequency))
        for doubt in doubts:
            warnings.warn(doubt, ToolpointWarning, stacklevel=4)
        return tuple(doubts)

    @property
    def directional_mass(self) -> FloatArray:
        """Total mass along x, y and z, kg; 0 where no row has the direction, or none is labelled."""
        totals = np.zeros(3)
        if not self.is_labelled:
            return totals
        for axis, name in enumerate(("+x", "+y", "+z")):
            motion = np.array([dof.direction == name for dof in self.dofs], dtype=float)
            totals[axis] = float(motion @ (self.mass @ motion))
        return totals

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self.dofs)

    def modes(self, number: int | None = None, *, below: float | None = None) -> Modes:
        """Return the lowest modes, counted so that none is missing, undamped; number or band (Hz) as in `sparse.modes`."""
        pairs = modes(self.stiffness, self.mass, number, below=below)
        return Modes(pairs.frequency, np.zeros(pairs.count), pairs.vectors, self.dofs, notes=(*self.notes, pairs.status))

    def __repr__(self) -> str:
        mass = f"{self.directional_mass.max():.6g} kg" if self.is_labelled else "without labels"
        return f"ImportedMatrices({self.size} rows, {mass})"
