"""Ball-screw axes: the lumped chain front, middle, end with a nut anywhere along it, and the published four-DOF chain."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from toolpoint._check import fail, positive, scalar
from toolpoint.drives.axis.catalogue import (
    STEEL_DENSITY,
    STEEL_MODULUS,
    STEEL_SHEAR,
    cylinder_inertia,
    torsional_stiffness,
)
from toolpoint.drives.axis.mechanics import MassChain, Mechanics, Play, Rub
from toolpoint.drives.friction.contact import Contact, ProgressiveSpring
from toolpoint.drives.friction.laws import Coulomb, FrictionLaw


@dataclass(frozen=True)
class Coupling:
    """Coupling between motor and screw: torsional stiffness N m/rad, damping N m s/rad, inertia kg m2.

    doubling_twist : rad, at which a progressive one (a spider) carries twice the torque of its stiffness; else None.

    Examples
    --------
    >>> Coupling(stiffness=5000.0).damping
    0.0
    """

    stiffness: float
    damping: float = 0.0
    inertia: float = 0.0
    doubling_twist: float | None = None

    def __post_init__(self) -> None:
        positive("Coupling.stiffness", self.stiffness)
        if self.doubling_twist is not None:
            positive("Coupling.doubling_twist", self.doubling_twist)

    def progression(self, row: Mapping[str, float]) -> tuple[Play, ...]:
        """Return what a progressive coupling has beyond its stiffness, along its twist; none of a linear one."""
        if self.doubling_twist is None:
            return ()
        return (Play(dict(row), ProgressiveSpring(self.stiffness, self.doubling_twist), "coupling"),)


@dataclass(frozen=True)
class BallScrew:
    """Ball screw: root diameter, lead and length between bearings in m; material; damping ratio of its springs.

    Examples
    --------
    >>> screw = BallScrew(diameter=0.036, lead=0.02, length=1.0)
    >>> print(f"{1e3 * screw.ratio:.4f} mm/rad")
    3.1831 mm/rad
    """

    diameter: float
    lead: float
    length: float
    modulus: float = STEEL_MODULUS
    shear_modulus: float = STEEL_SHEAR
    density: float = STEEL_DENSITY
    damping_ratio: float = 0.01

    def __post_init__(self) -> None:
        if scalar("BallScrew.lead", self.lead) <= 0:
            fail("BallScrew.lead", f"{self.lead:g} m", "must be above zero", remedy="give the travel of one turn in m")
        for name in ("diameter", "length", "modulus", "shear_modulus", "density"):
            positive(f"BallScrew.{name}", getattr(self, name))

    @property
    def ratio(self) -> float:
        """Lead / 2 pi, m/rad."""
        return self.lead / (2 * math.pi)

    @property
    def rod_stiffness(self) -> float:
        """E A, N (axial stiffness of one metre, N/m per m)."""
        return self.modulus * math.pi * self.diameter**2 / 4

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self.density * math.pi * self.diameter**2 / 4 * self.length


def ball_screw_axis(
    motor_inertia: float, coupling: Coupling, screw: BallScrew, *, table_mass: float, nut_position: float,
    front_bearing: float, end_bearing: float | None = None, nut: Contact | float = 1e9,
    motor_damping: float = 0.0, bearing_damping: float = 0.0, nut_damping: float = 0.0, guide_damping: float = 0.0,
    guide_friction: FrictionLaw | None = None, screw_friction: FrictionLaw | None = None,
    bearing_friction_arm: float = 0.0, saddle: tuple[float, float, float] | None = None,
) -> Mechanics:
    r"""Return the axis motor - coupling - screw (front, middle, end) - nut - saddle - table.

    The screw is three lumps, each with an angle and an axial displacement, the middle one at the nut; the springs between
    them are G I_p/l and E A/l of the parts before and behind the nut, so torsional and axial stiffness change with the
    nut's position. Lumped inertia: half of each part to its ends. The nut deflection is
    :math:`\delta = r \theta_m + x_m - x_t` with r = lead/2 pi.

    Parameters
    ----------
    motor_inertia : float
        Rotor, kg m2.
    table_mass, nut_position : float
        kg; distance of the nut from the front bearing, m, inside the screw.
    front_bearing, end_bearing : float
        Axial stiffness of the thrust bearings, N/m; None leaves the end free axially.
    nut : Contact or float
        Preloaded nut or backlash; a number is a linear stiffness, N/m.
    guide_friction, screw_friction : FrictionLaw
        Between table and base (N); on the motor shaft (N m).
    bearing_friction_arm : float
        Friction torque of a thrust bearing per N of its axial load, m: mu d_m/2 of `bearing_friction`.
    saddle : (mass, stiffness, damping), optional
        Saddle between nut and table, kg, N/m, N s/m.

    Examples
    --------
    >>> screw = BallScrew(diameter=0.036, lead=0.02, length=1.0)
    >>> axis = ball_screw_axis(0.004, Coupling(5000.0), screw, table_mass=300.0, nut_position=0.4, front_bearing=4e8)
    >>> axis.free
    ('motor', 'front', 'middle', 'end', 'x_front', 'x_middle', 'x_end', 'table')
    """
    length = positive("nut_position", nut_position)
    if length >= screw.length:
        fail("nut_position", f"{length:g} m", f"must be inside the screw of {screw.length:g} m")
    positive("motor_inertia", motor_inertia)
    positive("table_mass", table_mass)
    names = ("motor", "front", "middle", "end", "x_front", "x_middle", "x_end", *(("saddle",) if saddle else ()),
             "table", "base")
    chain = MassChain(names)
    _rotation(chain, motor_inertia, motor_damping, coupling, screw, length)
    _axial(chain, screw, length, front_bearing, end_bearing, bearing_damping)
    contacts = (*_nut(chain, screw, nut, nut_damping, "saddle" if saddle else "table"),
                *coupling.progression({"motor": 1.0, "front": -1.0}))
    chain.inertia("table", table_mass)
    if saddle:
        mass, stiffness, damping = saddle
        chain.inertia("saddle", mass)
        chain.spring({"saddle": 1, "table": -1}, stiffness, damping)
    chain.spring({"table": 1, "base": -1}, 0.0, guide_damping)
    return chain.build(motor={"motor": 1.0}, table={"table": 1.0}, scale={"table": 1.0, "base": -1.0}, lead=screw.ratio,
                      boundaries=("base",), contacts=contacts, friction=(
                          *_friction(guide_friction, screw_friction),
                          *bearing_friction("front", "x_front", stiffness=front_bearing, arm=bearing_friction_arm),
                          *bearing_friction("end", "x_end", stiffness=end_bearing or 0.0, arm=bearing_friction_arm)))


def _rotation(chain: MassChain, rotor: float, damping: float, coupling: Coupling, screw: BallScrew, x: float) -> None:
    # Half of a coupling on each side of its spring, as its two hubs are.
    chain.inertia("motor", rotor + coupling.inertia / 2)
    chain.inertia("front", coupling.inertia / 2)
    chain.spring({"motor": 1, "front": -1}, coupling.stiffness, coupling.damping)
    chain.spring({"motor": 1}, 0.0, damping)
    for first, second, part in (("front", "middle", x), ("middle", "end", screw.length - x)):
        j = cylinder_inertia(screw.diameter, part, screw.density)
        # The damping ratio is that of one lump on the spring of its part, so that no frequency of the axis need be known.
        k = torsional_stiffness(screw.diameter, part, screw.shear_modulus)
        chain.inertia(first, j / 2)
        chain.inertia(second, j / 2)
        chain.spring({first: 1, second: -1}, k, 2 * screw.damping_ratio * math.sqrt(k * j / 2))


def _axial(chain: MassChain, screw: BallScrew, x: float, front: float, end: float | None, damping: float) -> None:
    positive("front_bearing", front)
    for first, second, part in (("x_front", "x_middle", x), ("x_middle", "x_end", screw.length - x)):
        m, k = screw.mass * part / screw.length, screw.rod_stiffness / part
        chain.inertia(first, m / 2)
        chain.inertia(second, m / 2)
        chain.spring({first: 1, second: -1}, k, 2 * screw.damping_ratio * math.sqrt(k * m / 2))
    chain.spring({"x_front": 1, "base": -1}, front, damping)
    if end is not None:
        chain.spring({"x_end": 1, "base": -1}, positive("end_bearing", end), damping)


def _nut(chain: MassChain, screw: BallScrew, nut: Contact | float, damping: float, load: str) -> tuple[Play, ...]:
    row = {"middle": screw.ratio, "x_middle": 1.0, load: -1.0}
    # The plant holds the linear reference spring of a contact; its law adds the difference from it.
    stiffness = nut.reference_stiffness if isinstance(nut, Contact) else positive("nut", nut)
    chain.spring(row, stiffness, damping)
    return (Play(row, nut),) if isinstance(nut, Contact) else ()


def _friction(guide: FrictionLaw | None, screw: FrictionLaw | None) -> tuple[Rub, ...]:
    parts = []
    if guide is not None:
        parts.append(Rub({"table": 1.0, "base": -1.0}, guide, "guide"))
    if screw is not None:
        parts.append(Rub({"motor": 1.0}, screw, "shaft"))
    return tuple(parts)


def bearing_friction(turn: str, shift: str, *, stiffness: float, arm: float) -> tuple[Rub, ...]:
    r"""Return the friction of a thrust bearing that grows with its axial load.

    .. math:: T = \tfrac12 \mu d_m |F_a| \, \mathrm{sgn}(\omega)

    turn, shift : coordinates of the screw at the bearing, rad and m. stiffness : of the bearing, N/m; F_a is the force of its
    spring. arm : mu d_m/2, the coefficient of friction times half of the mean diameter, m; 0.003 times 20 mm or so for balls in
    angular contact. What a preload rubs without load is part of the shaft's own friction.
    Source: SKF, Rolling bearings (2018), friction, estimate M = 0.5 mu P d.

    Examples
    --------
    >>> bearing_friction("screw", "x_screw", stiffness=4e8, arm=6e-5)[0].load
    {'x_screw': 400000000.0, 'base': -400000000.0}
    """
    if scalar("bearing_friction_arm", arm) < 0:
        fail("bearing_friction_arm", f"{arm:g} m", "must not be negative")
    if arm == 0.0 or stiffness == 0.0:
        return ()
    return (Rub({turn: 1.0}, Coulomb(0.0), "bearing", {shift: stiffness, "base": -stiffness}, arm),)


def four_dof_axis(
    motor_inertia: float, screw_inertia: float, screw_mass: float, *, table_mass: float | None, lead_ratio: float,
    coupling: Coupling | tuple[float, float], bearing: tuple[float, float], nut: tuple[Contact | float, float],
    motor_damping: float = 0.0, guide_damping: float = 0.0, shaft_friction: FrictionLaw | None = None,
    guide_friction: FrictionLaw | None = None, bearing_friction_arm: float = 0.0,
) -> Mechanics:
    """Return the four-DOF chain motor -(K_C)- coupling and screw -(K_S, C_S axial)- ball screw -(K_T, C_T)- table.

    Coordinates: motor angle, screw angle, axial displacement of the screw, table. Pairs are (stiffness, damping);
    a `Coupling` may be progressive, its inertia is part of the screw's.
    `lead_ratio` is R_l in m/rad. Friction on the motor shaft is in N m, on the guide in N, `guide_damping` in N s/m
    between table and base; a nut with backlash or preload is a `Contact` in place of its stiffness; `bearing_friction_arm` (m)
    as in `bearing_friction`. With `table_mass` None
    the table belongs to the machine's structure: a boundary as the base is.
    Source: Machines 10 (2022) 1102, figure 2.

    Examples
    --------
    >>> axis = four_dof_axis(0.004, 0.001, 8.0, table_mass=300.0, lead_ratio=3.2e-3, coupling=(5000.0, 0.0),
    ...                      bearing=(4e8, 0.0), nut=(5e8, 0.0))
    >>> axis.coordinates
    ('motor', 'screw', 'x_screw', 'table', 'base')
    """
    for name, value in (("motor_inertia", motor_inertia), ("screw_inertia", screw_inertia), ("screw_mass", screw_mass),
                        ("table_mass", 1.0 if table_mass is None else table_mass), ("lead_ratio", lead_ratio)):
        positive(name, value)
    chain = MassChain(("motor", "screw", "x_screw", "table", "base"))
    for name, value in (("motor", motor_inertia), ("screw", screw_inertia), ("x_screw", screw_mass),
                        ("table", table_mass or 0.0)):
        chain.inertia(name, value)
    chain.spring({"motor": 1}, 0.0, motor_damping)
    chain.spring({"table": 1, "base": -1}, 0.0, guide_damping)
    joined = coupling if isinstance(coupling, Coupling) else Coupling(*coupling)
    chain.spring({"motor": 1, "screw": -1}, joined.stiffness, joined.damping)
    chain.spring({"x_screw": 1, "base": -1}, *bearing)
    row, (law, nut_damping) = {"screw": lead_ratio, "x_screw": 1, "table": -1}, nut
    chain.spring(row, law.reference_stiffness if isinstance(law, Contact) else law, nut_damping)
    return chain.build(motor={"motor": 1.0}, table={"table": 1.0}, scale={"table": 1.0, "base": -1.0}, lead=lead_ratio,
                      boundaries=("base",) if table_mass is not None else ("base", "table"),
                      friction=(*_friction(guide_friction, shaft_friction),
                                *bearing_friction("screw", "x_screw", stiffness=bearing[0], arm=bearing_friction_arm)),
                      contacts=(*((Play(row, law),) if isinstance(law, Contact) else ()),
                                *joined.progression({"motor": 1.0, "screw": -1.0})))
