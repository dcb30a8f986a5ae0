r"""Tool centre control of five axes: G43.4 and G43.5 (Fanuc), TRAORI (Siemens), M128 and FUNCTION TCPM (Heidenhain).

While it is in force X, Y and Z are places of the tool's tip in the work, and the direction of the tool is that of the rotary
axes (A, B, C) or a vector (G43.5 I J K, A3 B3 C3, TX TY TZ). Which direction angles mean is known of a machine alone, so a
segment keeps what was programmed at both of its ends. Other ways to give a direction are refused by name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

ROTARY_AXES = {"A": 0, "B": 1, "C": 2}
_NO_VECTOR = (math.nan, math.nan, math.nan)
_UPRIGHT_TOLERANCE = 1e-12  # rad, or of a unit vector


@dataclass
class CentreControl:
    """Direction of the tool, and the word by which tool centre control began (empty where it is not in force).

    angles : of A, B and C as programmed last, rad; vector : of the tool from its tip upwards, where it was programmed last.
    """

    word: str = ""
    takes_vector_words: bool = False
    angles: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    vector: tuple[float, float, float] | None = None
    _next_angles: list[float] | None = None
    _next_vector: tuple[float, float, float] | None = None

    @property
    def is_turned(self) -> bool:
        """Whether the tool stands otherwise than upright, as far as the program says."""
        if self.vector is not None:
            return abs(self.vector[0]) + abs(self.vector[1]) > _UPRIGHT_TOLERANCE or self.vector[2] < 0
        return any(abs(angle) > _UPRIGHT_TOLERANCE for angle in self.angles)

    def turn_to(self, words: dict[str, tuple[str, float]], *, incremental: bool) -> None:
        """Take the angles of a block, (mode, degrees) by letter, as those of the end of its motion."""
        angles = list(self._next_angles or self.angles)
        for letter, (mode, value) in words.items():
            i = ROTARY_AXES[letter]
            relative = mode == "IC" or (incremental and mode != "AC")
            angles[i] = math.radians(value) + (angles[i] if relative else 0.0)
        self._next_angles, self._next_vector = angles, None

    def point_along(self, vector: tuple[float, float, float]) -> str:
        """Take a direction of the tool as that of the end of a block's motion; return what is wrong with it."""
        size = math.sqrt(sum(v * v for v in vector))
        if size < 1e-6:
            return "a direction of the tool of no length; give its vector from the tip upwards"
        self._next_vector = (vector[0] / size, vector[1] / size, vector[2] / size)
        return ""

    @property
    def turns(self) -> bool:
        """Whether the block that is read turns the tool."""
        return self._next_vector is not None or (self._next_angles is not None and self._next_angles != self.angles)

    @property
    def turn(self) -> float:
        """Size of the turn of the block that is read, rad: of its angles together, or between its vectors."""
        if self._next_vector is not None:
            last = self.vector or (0.0, 0.0, 1.0)
            return math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(last, self._next_vector, strict=True)))))
        return math.dist(self.angles, self._next_angles or self.angles)

    def arrive(self) -> tuple[float, ...]:
        """Return the directions at both ends of the block's motion, see `path.segments`; the end is where the tool now is."""
        start = (*self.angles, *(self.vector or _NO_VECTOR))
        if self._next_vector is not None:
            self.vector = self._next_vector
        elif self._next_angles is not None:
            self.angles, self.vector = self._next_angles, None
        self._next_angles, self._next_vector = None, None
        return (*start, *self.angles, *(self.vector or _NO_VECTOR))


def part_of_turn(directions: tuple[float, ...], first: float, last: float) -> tuple[float, ...]:
    """Return the directions at both ends of a part of a motion, by its shares: angles evenly, vectors along their chord."""
    ends = []
    for share in (first, last):
        mixed = [a + share * (b - a) for a, b in zip(directions[:6], directions[6:], strict=True)]
        size = math.sqrt(sum(v * v for v in mixed[3:]))
        ends += [*mixed[:3], *(v / size for v in mixed[3:])]
    return tuple(ends)


def begin_control(state: ControlModes, number: int, word: str, *, takes_vector_words: bool = False) -> None:
    """Begin tool centre control by a word; refuse it where the program's axes are turned or tilted."""
    if state.tilted.matrix is not None or not _is_shift(state):
        state.remarks.fault(number, 1, f"{word} where the program's axes are turned, mirrored, stretched or tilted is not "
                            "computed")
        return
    state.centre.word, state.centre.takes_vector_words = word, takes_vector_words
    state.remarks.note(number, f"tool centre control ({word}): X, Y and Z are places of the tool's tip, of a ball too, in the "
                       "work, which they follow where it turns; the tip goes straight and rotary axes evenly between blocks")


def end_control(state: ControlModes) -> None:
    """End tool centre control; the tool stays turned as it is."""
    state.centre.word, state.centre.takes_vector_words = "", False


def _is_shift(state: ControlModes) -> bool:
    return all(abs(state.frame.matrix[i][j] - (i == j)) < _UPRIGHT_TOLERANCE for i in range(3) for j in range(3))
