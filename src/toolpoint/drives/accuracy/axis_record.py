"""Records of a controller: signals of an axis with their own times, recognised by their names; positioning runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText

ROLES = ("position_set", "position", "velocity_set", "velocity", "following_error", "current", "torque", "acceleration_set")


@dataclass(frozen=True, eq=False)
class AxisSignal:
    """Signal of an axis: name, SI unit (m, rad, m/s, rad/s, A, N m, ... or the file's own), role, axis, times (s) and values.

    `role` is one of `ROLES` or empty; a value holds until the next one.
    """

    name: str
    unit: str
    role: str
    axis: str
    time: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        finite = np.isfinite(self.time).all() and np.isfinite(self.values).all()
        if self.time.size < 2 or not finite or (np.diff(self.time) <= 0).any():
            fail(f"AxisSignal {self.name!r}", "times or values", "must be finite, at least two, the times increasing",
                 remedy="remove the faulty lines of the record")

    def at(self, time: FloatArray) -> FloatArray:
        """Return the values in force at times, s."""
        # A value holds from its own time on, also where rounding puts that time a little later.
        place = np.searchsorted(self.time, np.asarray(time) + 1e-9, side="right") - 1
        return np.asarray(self.values[np.clip(place, 0, self.time.size - 1)])


    @property
    def way(self) -> FloatArray:
        """Continuous values: positions of a rotary axis without the jumps from 360 deg to 0."""
        return np.unwrap(self.values) if self.unit == "rad" else self.values


@dataclass(frozen=True, eq=False)
class AxisRecord(NotebookText):
    """Signals of a controller's record, with notes on what was assumed of it."""

    signals: tuple[AxisSignal, ...]
    source: str = ""
    notes: tuple[str, ...] = ()

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, in their order."""
        return tuple(dict.fromkeys(s.axis for s in self.signals if s.role))

    def signal(self, role: str, axis: str) -> AxisSignal | None:
        """Return the first signal of a role and an axis, None where there is none."""
        return next((s for s in self.signals if s.role == role and s.axis == axis), None)

    def __repr__(self) -> str:
        longest = max((float(np.ptp(s.time)) for s in self.signals), default=0.0)
        return f"AxisRecord({len(self.signals)} signals of {', '.join(self.axes) or 'no axis'}; {longest:.4g} s)"


@dataclass(frozen=True, eq=False)
class PositioningRun:
    """A run of ISO 230-2: targets (m,), positions reached forward and backward (m, n), m."""

    targets: FloatArray
    forward: FloatArray
    backward: FloatArray
    source: str = ""
    notes: tuple[str, ...] = ()


# Words of a signal's name (in capitals), and what it is; the first that fits.
_WORDS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("following_error", ("FLWERR", "FOLLOWING ERROR", "FOLLOW ERR", "FOLLERR", "S DIFF", "SCHLEPP", "POS DIFF",
                         "POSDIFF")),
    ("position_set", ("CMDPOS", "S SOLL", "POSITION SET", "POS SET", "POSSET", "SETPOS", "SET POS", "POS CMD", "POSCMD",
                      "TARGET POS", "POSITION SOLL", "SOLLPOS", "SOLL POS", "LAGE SOLL", "SOLLLAGE", "S NOM", " S SET")),
    ("velocity_set", ("CMDVEL", "V SOLL", "VELOCITY SET", "SETVELO", "VEL SET", "VELSET", "SPEED SET", "SOLLGESCHW",
                      "SOLL GESCHW", "SOLLVEL", "V NOM", " V SET")),
    ("acceleration_set", ("CMDACC", "A SOLL", "ACCELERATION SET", "SETACC", "ACC SET")),
    ("current", ("ACTCURR", "I IST", "CURRENT", "STROM", "I Q", " IQ")),
    ("torque", ("TORQUE", "MOMENT", "M IST")),
    ("velocity", ("ACTVELMOT", "V IST", "ACTVELO", "VELOCITY", "SPEED", "VEL", "V ACT", "GESCHW")),
    ("position", ("MEASPOS2", "MEASPOS", "S IST", "ACTPOS", "ISTPOS", "POSITION", "POS", "S ACT")))


def role_of(name: str, unit: str) -> str:
    """Return the role of a signal by its name; empty where the unit contradicts."""
    # Makers part words by spaces, dots, strokes or bars; the space in front lets " IQ" mean a whole word.
    words = " " + re.sub(r"[_/.\s]+", " ", name.upper())
    role = next((role for role, names in _WORDS if any(word in words for word in names)), "")
    kinds = {"position": ("m", "rad"), "position_set": ("m", "rad"), "following_error": ("m", "rad"), "current": ("A", "%"),
             "velocity": ("m/s", "rad/s"), "velocity_set": ("m/s", "rad/s"), "torque": ("N m", "N", "%")}
    return "" if role in kinds and unit not in (*kinds[role], "") else role


def names_of(signals: Sequence[AxisSignal]) -> list[str]:
    """Return the names of signals, each with its unit and role."""
    return [f"{s.name} [{s.unit}]" + (f" = {s.role}" if s.role else "") for s in signals]
