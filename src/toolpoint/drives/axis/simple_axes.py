"""Axes with few masses: rigid, two masses, rack and pinion, linear motor."""

from __future__ import annotations

from toolpoint._check import fail, positive
from toolpoint.drives.axis.mechanics import MassChain, Mechanics, Play, Rub
from toolpoint.drives.friction.contact import Contact
from toolpoint.drives.friction.laws import FrictionLaw


def rigid_axis(inertia: float, lead_ratio: float, damping: float = 0.0, *, friction: FrictionLaw | None = None) -> Mechanics:
    """Return an axis of one inertia J (kg m2, at the motor) with travel r (m/rad), damping N m s/rad, friction N m.

    Examples
    --------
    >>> rigid_axis(inertia=0.005, lead_ratio=2e-3).motor_inertia
    0.005
    """
    chain = MassChain(("motor",))
    chain.inertia("motor", positive("inertia", inertia))
    chain.spring({"motor": 1}, 0.0, damping)
    rub = () if friction is None else (Rub({"motor": 1.0}, friction, "shaft"),)
    table = {"motor": positive("lead_ratio", lead_ratio)}
    return chain.build(motor={"motor": 1.0}, table=table, scale=table, lead=lead_ratio, boundaries=(), friction=rub)


def two_mass_axis(
    motor_inertia: float, table_mass: float, lead_ratio: float, *, stiffness: float, damping: float = 0.0,
    motor_damping: float = 0.0, guide_friction: FrictionLaw | None = None, shaft_friction: FrictionLaw | None = None,
    play: Contact | None = None,
) -> Mechanics:
    """Return motor and table joined by one axial spring k (N/m, at the table): delta = r theta - (x_table - x_base).

    The base carries the spring's reaction and the guide's friction. `play` replaces the spring by a contact (backlash
    or preload); `stiffness` is then not used.

    Examples
    --------
    The second frequency is that of the spring between table and motor, k (1/m + r^2/J):

    >>> import numpy as np
    >>> axis = two_mass_axis(0.004, 100.0, 2e-3, stiffness=1e8)
    >>> bool(np.isclose(axis.natural_frequencies[1], np.sqrt(1e8 * (1 / 100 + 4e-6 / 0.004)) / (2 * np.pi)))
    True
    """
    chain = MassChain(("motor", "table", "base"))
    chain.inertia("motor", positive("motor_inertia", motor_inertia))
    chain.inertia("table", positive("table_mass", table_mass))
    chain.spring({"motor": 1}, 0.0, motor_damping)
    row = {"motor": positive("lead_ratio", lead_ratio), "table": -1.0, "base": 1.0}
    chain.spring(row, positive("stiffness", stiffness) if play is None else play.reference_stiffness, damping)
    rubs = [Rub({"table": 1.0, "base": -1.0}, guide_friction, "guide")] if guide_friction else []
    rubs += [Rub({"motor": 1.0}, shaft_friction, "shaft")] if shaft_friction else []
    return chain.build(motor={"motor": 1.0}, table={"table": 1.0}, scale={"table": 1.0, "base": -1.0}, lead=lead_ratio,
                      boundaries=("base",), friction=tuple(rubs), contacts=() if play is None else (Play(row, play),))


def rack_axis(motor_inertia: float, table_mass: float, pinion_radius: float, *, gear_ratio: float, stiffness: float,
              damping: float = 0.0, backlash: float = 0.0, preload: float = 0.0, motor_damping: float = 0.0,
              guide_friction: FrictionLaw | None = None) -> Mechanics:
    """Return a rack and pinion: travel per motor angle = pinion radius / gear ratio; mesh and gear stiffness at the rack.

    `stiffness` N/m of gear and mesh in series, seen at the rack; `backlash` m of free play there, or `preload` N of two pinions
    (or the halves of a split one) against each other: both carry, `stiffness` in all, until one lets go at twice the preload.

    Examples
    --------
    >>> rack_axis(0.004, 500.0, 0.05, gear_ratio=10.0, stiffness=2e8).lead
    0.005
    """
    ratio = positive("pinion_radius", pinion_radius) / positive("gear_ratio", gear_ratio)
    if backlash > 0 and preload > 0:
        fail("preload", f"{preload:g} N beside a backlash", "must be one of the two", remedy="leave one out")
    play = Contact.with_backlash(stiffness, backlash) if backlash > 0 else None
    if preload > 0:
        play = Contact.preloaded(stiffness, preload)
    return two_mass_axis(motor_inertia, table_mass, ratio, stiffness=stiffness, damping=damping, motor_damping=motor_damping,
                         guide_friction=guide_friction, play=play)


def linear_motor_axis(mass: float, damping: float = 0.0, guide_friction: FrictionLaw | None = None) -> Mechanics:
    """Return a linear motor: the force acts between table and base, the scale is the encoder, lead 1.

    `mass` kg of table and primary part (the motor's `inertia` is not added again), `damping` N s/m of the guide.

    Examples
    --------
    >>> linear_motor_axis(mass=80.0).lead
    1.0
    """
    chain = MassChain(("table", "base"))
    chain.inertia("table", positive("mass", mass))
    row = {"table": 1.0, "base": -1.0}
    chain.spring(row, 0.0, damping)
    rubs = (Rub(row, guide_friction, "guide"),) if guide_friction else ()
    return chain.build(motor=row, table={"table": 1.0}, scale=row, lead=1.0, boundaries=("base",), friction=rubs)
