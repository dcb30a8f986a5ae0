"""Axis: a commanded coordinate with its limits, which drives one joint direction or several with factors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, one_of, scalar

AXES = ("x", "y", "z", "rx", "ry", "rz")
DIRECTIONS = AXES + tuple("-" + axis for axis in AXES)


@dataclass(frozen=True)
class Drive:
    """Joint direction that an axis drives: it moves by `factor` (m or rad) for every m or rad of the axis.

    joint : the joint of the chain; direction : ``x y z rx ry rz`` of its frame, with a minus sign for the opposite sense.

    Examples
    --------
    >>> Drive(joint=0, direction="-z").rate
    -1.0
    """

    joint: int
    direction: str
    factor: float = 1.0

    def __post_init__(self) -> None:
        one_of("Drive.direction", self.direction, DIRECTIONS)
        if scalar("Drive.factor", self.factor) == 0:
            fail("Drive.factor", "0", "must not be zero", remedy="leave the drive out")

    @property
    def way(self) -> int:
        """Index of the direction among x y z rx ry rz."""
        return AXES.index(self.direction.lstrip("-"))

    @property
    def rate(self) -> float:
        """Motion along the positive direction per m or rad of the axis."""
        return -self.factor if self.direction[0] == "-" else self.factor


@dataclass(frozen=True)
class Axis:
    """Commanded coordinate of a machine, in m or rad.

    Parameters
    ----------
    name : str
        For example X, Y, Z, A, B, C, or tilt.
    drives : sequence of Drive
        The joint directions that it moves; none for a coordinate of the tool (see `task.Task`).
    lower, upper : float
        Limits of travel, m or rad.
    reference_position : float
        Displayed position at the reference pose, m or rad.
    turns : bool, optional
        Whether it is an angle; that of its first drive where left out.

    Raises
    ------
    ToolpointError
        Where `lower` is not below `upper`.

    Examples
    --------
    >>> Axis("A", (Drive(joint=0, direction="rx"),), lower=-0.5, upper=0.5).words(0.25)
    '14.3239 deg'
    """

    name: str
    drives: tuple[Drive, ...] = ()
    lower: float = -np.inf
    upper: float = np.inf
    reference_position: float = 0.0
    turns: bool | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "drives", tuple(self.drives))
        if not self.lower < self.upper:
            fail(f"axis {self.name}: limits", f"{self.lower:g} .. {self.upper:g}", "the lower must be below the upper")

    @property
    def is_rotary(self) -> bool:
        """Whether the axis is an angle."""
        return self.turns if self.turns is not None else bool(self.drives) and self.drives[0].way > 2

    @property
    def unit(self) -> str:
        """Unit in which a person reads it: deg or m."""
        return "deg" if self.is_rotary else "m"

    def shown(self, position: FloatArray) -> FloatArray:
        """Return positions in the unit that a person reads."""
        return np.degrees(position) if self.is_rotary else np.asarray(position, float)

    def words(self, position: float) -> str:
        """Return a position with its unit: ``30 deg``, ``0.2 m``."""
        return f"{round(float(self.shown(np.asarray(position))), 9) + 0.0:.6g} {self.unit}"  # rounding's 1e-14 is zero

    @property
    def span(self) -> str:
        """The limits of travel in words."""
        lower_shown, upper_shown = (float(v) for v in self.shown(np.array([self.lower, self.upper])))
        return f"{lower_shown:.6g} .. {upper_shown:.6g} {self.unit}"

    def checked(self, position: FloatArray) -> FloatArray:
        """Return positions after checking them against the limits of travel; raises ToolpointError for one beyond them."""
        # Poses of a grid end at the limit itself, by sums that round.
        slack = 1e-9 * max(1.0, abs(self.lower) if np.isfinite(self.lower) else 1.0)
        for value in (float(np.min(position)), float(np.max(position))):
            if not self.lower - slack <= scalar(f"pose {self.name}", value) <= self.upper + slack:
                fail(f"pose {self.name}", self._words_beyond(value), f"must be within {self.span}", remedy=self._meant(value))
        return position

    def _words_beyond(self, value: float) -> str:
        """Return a position beyond the travel with its unit; the excess in words where the digits shown do not tell it."""
        words = self.words(value)
        limit = self.lower if value < self.lower else self.upper
        if words != self.words(limit):
            return words
        excess = 1e6 * abs(float(self.shown(np.asarray(value - limit))))
        return f"{words}, {excess:.2g} {'µm' if self.unit == 'm' else 'µdeg'} beyond its travel"

    def _meant(self, value: float) -> str:
        """Return a remedy for a round number beyond the travel of a rotary axis: degrees were meant.

        A position that was converted from degrees is not round in radians.
        """
        is_round = abs(1e3 * value - round(1e3 * value)) < 1e-9
        if self.is_rotary and is_round and abs(value) > np.pi:
            return f"a number without a unit is in rad; did you mean {self.name}={value:g}deg?"
        return ""
