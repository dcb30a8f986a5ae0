"""Mechanics of one axis: a chain of masses and springs with its motor, table, boundaries, friction and contacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail, floats, nonnegative, positive, symmetric
from toolpoint._notebook import NotebookText
from toolpoint.drives.friction.contact import Contact, ProgressiveSpring
from toolpoint.drives.friction.laws import FrictionLaw

Row = Mapping[str, float]


@dataclass(frozen=True)
class Rub:
    """Friction along a relative coordinate: `row` names coordinates with their weights, `law` the force that opposes it.

    load : Row, optional
        Force that presses the surfaces, N per m of each coordinate (a bearing's spring); the dry level of the law grows by
        `load_arm` times its size.
    load_arm : float
        Friction torque per N of that force, m.
    """

    row: Row
    law: FrictionLaw
    name: str = "friction"
    load: Row | None = None
    load_arm: float = 0.0


@dataclass(frozen=True)
class Play:
    """Contact or progressive spring along a relative coordinate; its reference stiffness is a part of the stiffness matrix."""

    row: Row
    law: Contact | ProgressiveSpring
    name: str = "nut"


@dataclass(frozen=True, eq=False)
class Mechanics(NotebookText):
    r"""One axis :math:`M \ddot q + C \dot q + K q = e_m T - \sum r_j F_j(r_j \cdot \dot q)`.

    Parameters
    ----------
    coordinates : sequence of str
        Names; angles in rad, displacements in m.
    mass, damping, stiffness : (n, n) floats
    motor : row
        Where the motor acts and what its encoder reads (generalised angle).
    table, scale : rows
        Table displacement (absolute), and what the linear scale reads, m.
    lead : float
        Travel of the table per motor angle, m/rad (1 for a linear motor).
    boundaries : sequence of str
        Massless coordinates that a structure moves and loads; fixed to ground where no structure serves them.
    friction, contacts : sequences

    Examples
    --------
    The inertia of an axis at its motor is J + m r^2:

    >>> from toolpoint.drives import two_mass_axis
    >>> axis = two_mass_axis(motor_inertia=0.004, table_mass=100.0, lead_ratio=2e-3, stiffness=1e8)
    >>> isinstance(axis, Mechanics), round(axis.motor_inertia, 9)
    (True, 0.0044)
    """

    coordinates: tuple[str, ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    motor: Row
    table: Row
    scale: Row
    lead: float
    boundaries: tuple[str, ...] = ("base",)
    friction: tuple[Rub, ...] = ()
    contacts: tuple[Play, ...] = ()
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        n, put = len(self.coordinates), object.__setattr__
        for name in ("mass", "damping", "stiffness"):
            put(self, name, symmetric(f"Mechanics.{name}", floats(f"Mechanics.{name}", getattr(self, name), (n, n))))
        positive("Mechanics.lead", self.lead)
        for name in self.boundaries:
            if name not in self.coordinates or np.any(self.mass[self.coordinates.index(name)]):
                fail("Mechanics.boundaries", repr(name), "must be a coordinate without mass",
                     remedy="let the structure carry the mass")
        free = [i for i, name in enumerate(self.coordinates) if name not in self.boundaries]
        if np.linalg.eigvalsh(self.mass[np.ix_(free, free)]).min() <= 0:
            weak = [self.coordinates[i] for i in free if self.mass[i, i] <= 0]
            fail("Mechanics.mass", f"no inertia at {', '.join(weak) or 'a combination of coordinates'}",
                 "every free coordinate must have inertia", remedy="give the missing mass or moment of inertia")
        loads = [rub.load for rub in self.friction if rub.load is not None]
        rows = [*loads, *(rub.row for rub in self.friction), *(play.row for play in self.contacts)]
        for row in (self.motor, self.table, self.scale, *rows):
            self.vector(row)

    @property
    def free(self) -> tuple[str, ...]:
        """Coordinates with mass."""
        return tuple(name for name in self.coordinates if name not in self.boundaries)

    def vector(self, row: Row) -> FloatArray:
        """Return a row over all coordinates."""
        out = np.zeros(len(self.coordinates))
        for name, weight in row.items():
            if name not in self.coordinates:
                fail("Mechanics row", repr(name), "must be one of " + ", ".join(self.coordinates))
            out[self.coordinates.index(name)] += weight
        return out

    @property
    def motor_inertia(self) -> float:
        """Inertia of the whole axis at the motor, rigid: v^T M v with v the motion for one rad (m) of the motor."""
        free = [i for i, name in enumerate(self.coordinates) if name not in self.boundaries]
        n, block_index = len(free), np.ix_(free, free)
        row = self.vector(self.motor)[free]
        # The saddle point finds the motion of least strain for one rad of the motor, in stiffness of order one beside rows
        # of order one; springs alone are singular, as the whole axis may move.
        scale = max(float(np.abs(self.stiffness[block_index]).max()), 1.0)
        block = np.block([[self.stiffness[block_index] / scale, row[:, None]], [row[None, :], np.zeros((1, 1))]])
        v = np.linalg.solve(block, np.eye(n + 1)[n])[:n]
        return float(v @ self.mass[block_index] @ v)

    @property
    def natural_frequencies(self) -> FloatArray:
        """Undamped natural frequencies with the boundaries fixed, Hz; the rigid motion of the axis is the 0."""
        free = [i for i, c in enumerate(self.coordinates) if c not in self.boundaries]
        block_index = np.ix_(free, free)
        # Rounding takes the rigid motion's zero to either side of it.
        values = np.linalg.eigvals(np.linalg.solve(self.mass[block_index], self.stiffness[block_index])).real
        return np.sqrt(nonnegative("w^2", np.sort(np.maximum(values, 0.0)))) / (2 * np.pi)

    def __repr__(self) -> str:
        laws = ", ".join(type(rub.law).__name__ for rub in self.friction) or "none"
        return f"Mechanics({', '.join(self.coordinates)}; lead {self.lead:.6g} m/rad; friction {laws})"


@dataclass
class MassChain:
    """Builder of a Mechanics: inertias and springs added one by one."""

    coordinates: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.coordinates)
        self.mass, self.damping, self.stiffness = (np.zeros((n, n)) for _ in range(3))

    def inertia(self, name: str, value: float) -> None:
        """Add a mass (kg) or moment of inertia (kg m2)."""
        i = self.coordinates.index(name)
        self.mass[i, i] += value

    def spring(self, row: Row, stiffness: float, damping: float = 0.0) -> None:
        """Add a spring and damper along a combination of coordinates."""
        v = np.zeros(len(self.coordinates))
        for name, weight in row.items():
            v[self.coordinates.index(name)] += weight
        self.stiffness += stiffness * np.outer(v, v)
        self.damping += damping * np.outer(v, v)

    def build(self, *, motor: Row, table: Row, scale: Row, lead: float, boundaries: tuple[str, ...] = ("base",),
              friction: tuple[Rub, ...] = (), contacts: tuple[Play, ...] = ()) -> Mechanics:
        """Return the mechanics of the masses and springs added so far."""
        return Mechanics(self.coordinates, self.mass, self.damping, self.stiffness, motor, table, scale, lead, boundaries,
                         friction, contacts)
