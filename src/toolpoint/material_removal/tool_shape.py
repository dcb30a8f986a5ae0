"""MillShape: envelope of a rotating end mill; Holder: what is above its edges. Other kinds of tools are refused by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, fail, floats, nonnegative, positive, scalar

SHAPE_COLUMNS = ("flat", "corner", "sin_taper", "cos_taper", "radius")  # of the array that kernels read
_SUPPORTED_KINDS = ("cylindrical", "bull", "ball", "tapered")
_MAX_TAPER = np.radians(60.0)  # half angle, rad


@dataclass(frozen=True)
class MillShape:
    """Envelope of an end mill: a flat end, a corner arc tangent to it, and a cylinder or a cone above.

    Parameters
    ----------
    diameter : float
        m, of the cylinder; of a tapered mill the largest one, at the upper end of its edges.
    corner_radius : float
        m; 0 is a sharp corner, the whole radius of the tip a ball.
    taper : float
        Half angle of the cone, rad; 0 is a cylinder.
    flute_length : float
        Length of the edges along the axis, m; needed with a taper, where it fixes the diameter of the tip.

    Raises
    ------
    ToolpointError
        For lengths that are not above zero, a corner that does not fit the tip, a taper that leaves no tip.

    Examples
    --------
    >>> MillShape(0.01, 0.005).kind, MillShape(0.01).kind
    ('ball', 'cylindrical')
    """

    diameter: float
    corner_radius: float = 0.0
    taper: float = 0.0
    flute_length: float = float("inf")

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "diameter", positive("MillShape.diameter", self.diameter, 10.0))
        put(self, "corner_radius", float(nonnegative("MillShape.corner_radius", floats("corner_radius", self.corner_radius))))
        if not 0 <= scalar("MillShape.taper", self.taper) <= _MAX_TAPER:
            fail("MillShape.taper", f"{np.degrees(self.taper):g} degrees", "must be a half angle of 0 to 60 degrees")
        if not self.flute_length > 0:
            fail("MillShape.flute_length", f"{self.flute_length:g} m", "must be above zero")
        if self.taper > 0 and not np.isfinite(self.flute_length):
            fail("MillShape.flute_length", "missing", "must be given with a taper", remedy="it fixes the diameter of the tip")
        if self.flat < -1e-9 * self.diameter:
            fail("MillShape.corner_radius", f"{1e3 * self.corner_radius:g} mm", "must fit the tip of the tool",
                 remedy="a ball has the radius of its tip; of a taper the tip is what the flute length leaves")

    @property
    def radius(self) -> float:
        """Largest radius, m."""
        return self.diameter / 2

    @property
    def flat(self) -> float:
        """Radius of the flat end, m; 0 of a ball."""
        if self.taper == 0:
            return self.radius - self.corner_radius
        # The cone is tangent to the corner arc at height c (1 - sin a), radius e + c cos a.
        s, c = np.sin(self.taper), np.cos(self.taper)
        height = self.flute_length - self.corner_radius * (1 - s)
        return float(self.radius - height * s / c - self.corner_radius * c)

    @property
    def kind(self) -> str:
        """Name of the shape: cylindrical, bull, ball or tapered."""
        if self.taper > 0:
            return "tapered"
        if self.corner_radius == 0:
            return "cylindrical"
        return "ball" if self.flat < 1e-6 * self.radius else "bull"

    def edge_length(self, height: FloatArray) -> FloatArray:
        """Return the length (m) of the edge's meridian from the flat end up to heights (m) above the tip."""
        z, c = np.asarray(height, float), self.corner_radius
        tangent = c * (1 - np.sin(self.taper))
        arc = c * np.arccos(np.clip(1 - np.minimum(z, tangent) / max(c, 1e-300), -1, 1)) if c > 0 else np.zeros_like(z)
        return np.asarray(arc + np.maximum(z - tangent, 0.0) / np.cos(self.taper))

    def height_at(self, length: FloatArray) -> FloatArray:
        """Return the height (m) above the tip at lengths (m) along the edge's meridian."""
        u, c = np.asarray(length, float), self.corner_radius
        turn = np.pi / 2 - self.taper
        inside = np.minimum(u, c * turn)
        rise = c * (1 - np.cos(inside / c)) if c > 0 else np.zeros_like(u)
        return np.asarray(rise + np.maximum(u - c * turn, 0.0) * np.cos(self.taper))

    @property
    def array(self) -> FloatArray:
        """Numbers that the kernels read, see `SHAPE_COLUMNS`."""
        flat = max(self.flat, 0.0) if self.flat > 1e-9 * self.radius else 0.0
        return np.array([flat, self.corner_radius, np.sin(self.taper), np.cos(self.taper), self.radius])


def shape_of_kind(kind: str, diameter: float, **lengths: float) -> MillShape:
    """Return the shape of a named kind of end mill; T-slot cutters, drills, thread mills and other kinds are refused by name.

    Examples
    --------
    >>> shape_of_kind("ball", 0.006).corner_radius
    0.003
    """
    if kind not in _SUPPORTED_KINDS:
        fail("tool", repr(kind), f"must be one of {', '.join(_SUPPORTED_KINDS)}",
             remedy="the engagement of other tools is not computed")
    if kind == "ball":
        lengths = {"corner_radius": diameter / 2, **lengths}
    shape = MillShape(diameter, **lengths)
    if shape.kind != kind:
        fail("tool", f"{kind} with these lengths", f"is {shape.kind}", remedy="correct the kind or the lengths")
    return shape


@dataclass(frozen=True)
class Holder:
    """Bodies of revolution above the edges: cylinders from `heights` above the tip upwards, with `diameters`, m.

    The last one reaches up without end (the spindle nose). `stick_out` : m from the tip to the holder.

    Examples
    --------
    >>> Holder.of(stick_out=0.04, shank=0.01, flute_length=0.02, diameter=0.03).heights
    (0.02, 0.04)
    """

    heights: tuple[float, ...] = ()
    diameters: tuple[float, ...] = ()
    stick_out: float = 0.0
    names: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        if len(self.heights) != len(self.diameters):
            fail("Holder", f"{len(self.heights)} heights, {len(self.diameters)} diameters", "must be equally many")
        for name, values in (("heights", self.heights), ("diameters", self.diameters)):
            for value in values:
                positive(f"Holder.{name}", value, 10.0)

    @classmethod
    def of(cls, *, stick_out: float, shank: float = 0.0, flute_length: float = float("inf"), diameter: float = 0.0,
           further: Sequence[tuple[float, float]] = ()) -> Holder:
        """Return a shank above the edges, a holder above the stick-out, and further (height above the tip, diameter), m."""
        rows = [("shank", flute_length, shank)] if shank > 0 and flute_length < stick_out else []
        rows += [("holder", stick_out, diameter)] if diameter > 0 else []
        rows += [("holder", height, width) for height, width in further]
        return cls(tuple(r[1] for r in rows), tuple(r[2] for r in rows), stick_out, tuple(r[0] for r in rows))
