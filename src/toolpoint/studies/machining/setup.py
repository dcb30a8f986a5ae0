"""MachiningSetup: stock, tools and limits with which a program is run, and what of it is computed how finely."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.cutting.description import CuttingDescription
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.jerk_profile import JerkLimits
from toolpoint.material_removal import Holder, MillShape, Stock
from toolpoint.material_removal.removed import DEFAULT_SLICES, SPACING_RATIO

STEP_RATIO = 1 / 4  # of the tool's radius: longest piece of a move
MAX_DEXELS_WITHOUT_WORD = 2_000_000  # of a grid where no spacing is given: 60 MB


@dataclass(frozen=True)
class CuttingLimits:
    """Limits, infinite where not given: spindle power (W), torque (N m), speed (rev/min); bending of the tool (N m).

    curve : torque of the spindle over its speed, pairs of rev/min and N m in rising speed. Between two points the power is
    linear in the speed, which is exact for constant torque and for constant power; below the first point the torque stays,
    above the last point the power stays.

    Examples
    --------
    >>> limits = CuttingLimits(curve=((1500.0, 60.0), (6000.0, 15.0)))
    >>> [round(float(torque), 6) for torque in limits.torque_at(np.array([500.0, 3000.0, 12000.0]))]
    [60.0, 30.0, 7.5]
    """

    power: float = float("inf")
    torque: float = float("inf")
    bending: float = float("inf")
    speed: float = float("inf")
    curve: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("power", "torque", "bending", "speed"):
            if not getattr(self, name) > 0:
                fail(f"CuttingLimits.{name}", f"{getattr(self, name):g}", "must be above zero")
        speeds = [speed for speed, _ in self.curve]
        if any(speed <= 0 or torque <= 0 for speed, torque in self.curve) or sorted(set(speeds)) != speeds:
            fail("CuttingLimits.curve", f"{self.curve}", "must be pairs of rev/min and N m above zero, in rising speed")

    def power_at(self, speed: FloatArray) -> FloatArray:
        """Return the limit of power (W) at spindle speeds (rev/min)."""
        constant = np.full(np.shape(speed), self.power)
        if not self.curve:
            return constant
        knots, torques = np.array(self.curve).T
        rated = np.interp(speed, knots, knots * torques * np.pi / 30)
        return np.minimum(constant, np.where(speed < knots[0], torques[0] * np.asarray(speed) * np.pi / 30, rated))

    def torque_at(self, speed: FloatArray) -> FloatArray:
        """Return the limit of torque (N m) at spindle speeds (rev/min)."""
        constant = np.full(np.shape(speed), self.torque)
        if not self.curve:
            return constant
        turning = np.maximum(np.asarray(speed, float), 1e-9)
        return np.minimum(constant, replace(self, power=float("inf")).power_at(turning) * 30 / (np.pi * turning))


@dataclass(frozen=True)
class MachiningSetup:
    """Setup of a run.

    Parameters
    ----------
    stock : Stock
        In the coordinates of the program.
    cut : CuttingDescription
        Tool and coefficients of every tool number that `cuts` does not name.
    cuts : mapping of tool number to CuttingDescription
    taper : float
        Half angle of a tapered mill, rad.
    stick_out, holder_diameter : float
        m; 0 where not known: then no holder is looked at, and bending is taken at the top of the edges.
    stick_outs : mapping of tool number to stick-out
        m, of tools with one of their own.
    zero : mapping of axis name to position
        Axis positions of the machine at the program's zero, m.
    speed : float
        rev/min where the program holds no S.
    spacing : float
        Of the dexels, m; from the smallest tool where 0.
    part : (n, 3, 3) floats
        Triangles of the part that must not be cut into, m; none where empty.
    planned : JerkLimits, optional
        Of the set points: speed, acceleration and jerk along the path; with them feeds are those of the planner.
    rotary_speed, rotary_acceleration, rotary_jerk : float
        Limits of the rotary axes of five-axis programs, rad/s, rad/s^2 and rad/s^3; infinite where not known.
    look_ahead : int, optional
        Blocks that the control knows beyond the one under way; that of `drives` where left out, else as many as it needs.
    drives : DriveDescription, optional
        Servo of the axes: it follows the program under the cutting forces. Its limits are the planner's where `planned` is
        left out.
    raises_speed : bool
        Whether advice looks for a faster speed for a tool that holds as it is programmed, too.

    Examples
    --------
    >>> stock = Stock.box((0, 0, -0.01), (0.1, 0.05, 0))
    >>> cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    >>> MachiningSetup(stock, cut).shape_of(1).radius
    0.005
    """

    stock: Stock
    cut: CuttingDescription
    cuts: Mapping[int, CuttingDescription] = field(default_factory=dict)
    taper: float = 0.0
    stick_out: float = 0.0
    stick_outs: Mapping[int, float] = field(default_factory=dict)
    holder_diameter: float = 0.0
    zero: Mapping[str, float] = field(default_factory=dict)
    speed: float = 0.0
    spacing: float = 0.0
    slices: int = DEFAULT_SLICES
    limits: CuttingLimits = CuttingLimits()
    part: FloatArray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    planned: JerkLimits | None = None
    drives: DriveDescription | None = None
    rotary_speed: float = float("inf")
    rotary_acceleration: float = float("inf")
    rotary_jerk: float = float("inf")
    look_ahead: int | None = None
    raises_speed: bool = False

    def __post_init__(self) -> None:
        if self.planned is None and self.drives is not None:
            limits = self.drives.limits
            object.__setattr__(self, "planned", JerkLimits(limits.speed, limits.acceleration, limits.jerk))
        if self.spacing:
            positive("spacing", self.spacing, 0.1)
        if self.look_ahead is None and self.drives is not None:
            object.__setattr__(self, "look_ahead", self.drives.look_ahead)
        if self.look_ahead is not None and self.look_ahead < 0:
            fail("look_ahead", f"{self.look_ahead} blocks", "must be at least 0")
        for name in ("rotary_speed", "rotary_acceleration", "rotary_jerk"):
            if not getattr(self, name) > 0:
                fail(name, f"{getattr(self, name):g}", "must be above zero")
        if np.isfinite(self.rotary_jerk) and not np.isfinite(self.rotary_acceleration):
            fail("rotary_jerk", f"{self.rotary_jerk:g} rad/s^3", "needs a limit of acceleration, too",
                 remedy="give `rotary_acceleration`")
        for number, cut in {0: self.cut, **self.cuts}.items():
            tool_of(cut), coefficients_of(cut)  # faults of a cut are told before any work
            flute = cut.tool.flute_length
            stick_out = self.stick_out_of(number)
            if stick_out and flute and stick_out < flute:
                fail("stick_out", f"{1e3 * stick_out:g} mm", f"must be at least the {1e3 * flute:g} mm of the edges "
                                                                  f"of tool "
                     f"{number}", remedy="it is measured from the tip to the holder")

    def stick_out_of(self, number: int) -> float:
        """Return the length from the tip of a tool to its holder, m; 0 where not known."""
        return self.stick_outs.get(number, self.stick_out)

    def cut_of(self, number: int) -> CuttingDescription:
        """Return the cut of a tool number."""
        return self.cuts.get(number, self.cut)

    def shape_of(self, number: int) -> MillShape:
        """Return the envelope of a tool."""
        tool = self.cut_of(number).tool
        return MillShape(tool.diameter, tool.corner_radius, self.taper, tool.flute_length or float("inf"))

    def holder_of(self, number: int) -> Holder:
        """Return what is above the edges of a tool: shank and holder as far as they are known."""
        tool = self.cut_of(number).tool
        stick_out = self.stick_out_of(number)
        if not stick_out or not self.holder_diameter:
            return Holder()
        return Holder.of(stick_out=stick_out, shank=tool.diameter * 0.999, flute_length=tool.flute_length or float("inf"),
                         diameter=self.holder_diameter)

    def spacing_for(self, shapes: list[MillShape]) -> float:
        """Return the spacing of the dexels, m: the stated one, else a fraction of the smallest tool that fits the memory."""
        if self.spacing:
            return self.spacing
        fine = SPACING_RATIO * min(shape.radius for shape in shapes)
        area = float((self.stock.upper - self.stock.lower)[:2].prod())
        return max(fine, float(np.sqrt(area / MAX_DEXELS_WITHOUT_WORD)))
