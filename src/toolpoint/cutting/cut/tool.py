"""Tool and Engagement: the cutter's geometry and the arc over which its teeth cut."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import LEFT_OUT, FloatArray, count, fail, floats, nonnegative, positive, scalar
from toolpoint._notebook import NotebookText


@dataclass(frozen=True, eq=False)
class Tool(NotebookText):
    r"""An end mill.

    Parameters
    ----------
    diameter : float
        m.
    teeth : int
        Number of teeth N.
    helix : float or (teeth,) floats
        Helix angle in rad, one for all teeth or one each, zero where left out; a lower point of an edge enters the cut earlier.
    pitch : (teeth,) floats, optional
        Angles in rad from each tooth to the one that follows it in the cut, their sum 2 pi; equal where left out.
    runout : float
        Parallel offset of the cutter's axis from the spindle's axis, m.
    runout_angle : float
        Angle in rad from tooth 0 to the direction of the offset, against the sense of rotation.
    tilt : float
        Offset added for every metre of height above the tip, m/m (rad), in the direction of the offset.
    corner_radius : float
        m; diameter/2 is a ball end mill, 0 a sharp corner.

    Raises
    ------
    ToolpointError
        For a diameter or number of teeth not above zero, pitch angles that do not add up to 2 pi, and the like.

    Examples
    --------
    >>> import numpy as np
    >>> Tool(diameter=0.012, teeth=2, helix=np.radians(30))
    Tool(12 mm, 2 teeth, helix 30 deg)
    """

    diameter: float
    teeth: int
    helix: FloatArray = LEFT_OUT
    pitch: FloatArray = LEFT_OUT
    runout: float = 0.0
    runout_angle: float = 0.0
    tilt: float = 0.0
    corner_radius: float = 0.0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "diameter", positive("Tool.diameter", self.diameter, 10.0))
        put(self, "teeth", count("Tool.teeth", self.teeth))
        helix = floats("Tool.helix", np.broadcast_to(0.0 if self.helix is None else self.helix, (self.teeth,)), (self.teeth,))
        # No mill is steeper; an angle given in degrees nearly always is, as a number of radians.
        if np.abs(helix).max() > np.radians(75):
            fail("Tool.helix", f"{np.abs(helix).max():g} rad", "must be within 75 degrees", remedy="angles are in rad")
        put(self, "helix", helix)
        pitch = np.full(self.teeth, 2 * np.pi / self.teeth) if self.pitch is None else self.pitch
        pitch = floats("Tool.pitch", pitch, (self.teeth,))
        if pitch.min() <= 0 or abs(pitch.sum() - 2 * np.pi) > 1e-6:
            fail("Tool.pitch", f"sum {pitch.sum():g} rad, least {pitch.min():g}",
                 "must be above zero and add up to 2 pi", remedy="angles are in rad")
        put(self, "pitch", pitch)
        for name in ("runout", "corner_radius"):
            put(self, name, float(nonnegative(f"Tool.{name}", floats(f"Tool.{name}", getattr(self, name)))))
        for name in ("runout_angle", "tilt"):
            put(self, name, scalar(f"Tool.{name}", getattr(self, name)))
        if self.corner_radius > self.diameter / 2 * (1 + 1e-9):
            fail("Tool.corner_radius", f"{self.corner_radius:g} m", f"must be at most {self.diameter / 2:g} m",
                 remedy="half the diameter is a ball end mill")

    @property
    def radius(self) -> float:
        """Half the diameter, m."""
        return self.diameter / 2

    @property
    def is_regular(self) -> bool:
        """Whether all pitch angles and all helix angles are equal, so that one tooth period is the only delay."""
        # Rounding of 2 pi over the teeth must not make an irregular tool, which would be sent to engines that are ten times
        # slower.
        return bool(np.ptp(self.pitch) < 1e-12 and np.ptp(self.helix) < 1e-12)

    @property
    def has_helix(self) -> bool:
        """Whether any tooth has a helix."""
        return bool(np.any(np.abs(self.helix) > 1e-12))

    def angles(self, height: FloatArray | float = 0.0) -> FloatArray:
        """Return the lag of every tooth's edge behind tooth 0's tip at these heights, rad, shape (..., teeth)."""
        start = np.concatenate([[0.0], np.cumsum(self.pitch)[:-1]])
        return start + 2 * np.tan(self.helix) / self.diameter * np.asarray(height)[..., None]

    def local_radius(self, height: FloatArray | float = 0.0) -> FloatArray:
        """Return the radius of the cutter's envelope at these heights above the tip, m (corner radius or ball)."""
        z, c = np.asarray(height, float), self.corner_radius
        inside = np.clip(c - z, 0.0, c)
        return self.radius - c + np.sqrt(np.maximum(c**2 - inside**2, 0.0))

    def edge_length(self, depth: float) -> float:
        """Return the length of edge along the meridian from the tip to this height, m: longer than it at a rounded corner."""
        c = self.corner_radius
        if c == 0:
            return depth
        return float(c * np.arccos(max(0.0, 1 - min(depth, c) / c)) + max(depth - c, 0.0))

    def along_edge(self, length: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return height (m), axial immersion angle kappa (rad) and local radius (m) at lengths along the meridian."""
        u, c = np.asarray(length, float), self.corner_radius
        if c == 0:
            return u, np.full(u.shape, np.pi / 2), np.full(u.shape, self.radius)
        kappa = np.minimum(u / c, np.pi / 2)
        height = c * (1 - np.cos(kappa)) + np.maximum(u - c * np.pi / 2, 0.0)
        return height, kappa, self.radius - c + c * np.sin(kappa)

    def edge_radius(self, height: FloatArray | float = 0.0) -> FloatArray:
        r"""Return the distance of every edge from the spindle's axis, m, shape (..., teeth).

        :math:`R_j(z) = R(z) + (\rho + \tau z) \cos(\gamma - \psi_j(z))`, the usual form for offset and tilt that are
        small against the radius (Kline, DeVor, 1983).
        """
        z = np.asarray(height, float)
        offset = self.runout + self.tilt * z
        return self.local_radius(z)[..., None] + offset[..., None] * np.cos(self.runout_angle - self.angles(z))

    def with_runout(self, offset: float, angle: float = 0.0, tilt: float = 0.0) -> Tool:
        """Return the same tool with this run-out."""
        return replace(self, runout=offset, runout_angle=angle, tilt=tilt)

    def __repr__(self) -> str:
        parts = [f"{1e3 * self.diameter:g} mm", f"{self.teeth} teeth"]
        if self.has_helix:
            parts.append("helix " + "/".join(f"{np.degrees(h):g}" for h in np.unique(self.helix)) + " deg")
        if np.ptp(self.pitch) > 1e-12:
            parts.append("pitch " + "/".join(f"{np.degrees(p):g}" for p in self.pitch) + " deg")
        if self.runout or self.tilt:
            parts.append(f"run-out {1e6 * self.runout:.3g} µm")
        return f"Tool({', '.join(parts)})"


@dataclass(frozen=True)
class Engagement(NotebookText):
    """The arc of cut: angles from entry to exit, clockwise from y, feed along x.

    Parameters
    ----------
    entry, exit : float
        rad, 0 <= entry < exit <= pi. `down`, `up`, `slot` and `centred` make them from the radial immersion a/D.

    Examples
    --------
    >>> Engagement.down(0.5)
    Engagement(90..180 deg)
    """

    entry: float
    exit: float

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "entry", scalar("Engagement.entry", self.entry))
        put(self, "exit", scalar("Engagement.exit", self.exit))
        if not 0 <= self.entry < self.exit <= np.pi + 1e-12:
            fail("Engagement", f"entry {self.entry:g}, exit {self.exit:g} rad", "must be 0 <= entry < exit <= pi",
                 remedy="angles are in rad, clockwise from y with the feed along x")

    @classmethod
    def down(cls, immersion: float) -> Engagement:
        """Return the engagement of down-milling (climb) at radial immersion a/D: from acos(2 a/D - 1) to pi."""
        return cls(float(np.arccos(2 * _immersion(immersion) - 1)), np.pi)

    @classmethod
    def up(cls, immersion: float) -> Engagement:
        """Return the engagement of up-milling (conventional) at radial immersion a/D: from 0 to acos(1 - 2 a/D)."""
        return cls(0.0, float(np.arccos(1 - 2 * _immersion(immersion))))

    @classmethod
    def slot(cls) -> Engagement:
        """Return full immersion, 0 to pi."""
        return cls(0.0, np.pi)

    @classmethod
    def centred(cls, immersion: float) -> Engagement:
        """Return a cut of width a/D in the middle of the cutter (face milling)."""
        half = float(np.arcsin(_immersion(immersion)))
        return cls(np.pi / 2 - half, np.pi / 2 + half)

    def at_radius(self, ratio: FloatArray) -> tuple[FloatArray, FloatArray]:
        r"""Return entry and exit where the tool's local radius is its largest over `ratio`: the walls of the work are planes.

        :math:`\cos\phi_{loc} = (R/r) \cos\phi` for both, so a slot stays a slot and a ball's tip cuts only within its reach.
        """
        a, b = (np.arccos(np.clip(np.cos(phi) * ratio, -1.0, 1.0)) for phi in (self.entry, self.exit))
        return np.where(ratio == 1, self.entry, a), np.where(ratio == 1, self.exit, b)

    @property
    def arc(self) -> float:
        """Length of the arc of cut, rad."""
        return self.exit - self.entry

    def __repr__(self) -> str:
        return f"Engagement({np.degrees(self.entry):.4g}..{np.degrees(self.exit):.4g} deg)"


def _immersion(value: float) -> float:
    number = positive("immersion", value)
    if number > 1:
        fail("immersion", f"{number:g}",
             "radial immersion a/D must be at most 1: the cut cannot be wider than the diameter",
             remedy="give the ratio of width to diameter")
    return number
