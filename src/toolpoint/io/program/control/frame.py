r"""Frame of a program, which transforms coordinates: TRANS, ROT, SCALE, MIRROR and their additive kinds (Siemens), G68, G69,
G51.1 and G50.1 (Fanuc).

A programmed point p lies at :math:`o + t + A p` in machine coordinates, o the settable origin, A a rotation, times a mirror
or scales where these are programmed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

Matrix = list[list[float]]
AXES = {"X": 0, "Y": 1, "Z": 2}
# G18 is Z and X, in this order: the sense of arcs follows from it, and X and Z would turn them round.
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
_TURN_TOLERANCE = 1e-9  # of a component: sines of right angles are wrong by 1e-16, and turned frames add up a few


def _identity() -> Matrix:
    return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@dataclass
class ProgramFrame:
    """Shift t (m) and matrix A of the frame in force; `is_identity` where A is the identity, which most programs keep."""

    shift: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    matrix: Matrix = field(default_factory=_identity)
    is_identity: bool = True

    def turned(self, vector: list[float]) -> list[float]:
        """Return A v."""
        return vector if self.is_identity else [sum(a * v for a, v in zip(row, vector, strict=True)) for row in self.matrix]

    def turned_back(self, vector: list[float]) -> list[float]:
        """Return A^-1 v."""
        if self.is_identity:
            return vector
        return [sum(a * v for a, v in zip(row, vector, strict=True)) for row in _inverse(self.matrix)]

    def reset(self) -> None:
        """Take the frame away."""
        self.shift, self.matrix, self.is_identity = [0.0, 0.0, 0.0], _identity(), True

    def translate(self, by: list[float]) -> None:
        """Shift the frame along its own axes, m."""
        self.shift = [a + b for a, b in zip(self.shift, self.turned(by), strict=True)]

    def multiply(self, by: Matrix) -> None:
        """Turn, mirror or stretch the frame about its own origin."""
        columns = list(zip(*by, strict=True))
        self.matrix = [[sum(a * b for a, b in zip(row, column, strict=True)) for column in columns] for row in self.matrix]
        self.is_identity = all(abs(self.matrix[i][j] - (i == j)) < 1e-15 for i in range(3) for j in range(3))

    def plane_factor(self, plane: tuple[int, int]) -> float | None:
        """Return by what arcs of a plane grow, negative where they turn the other way; None where they would tilt or become
        ellipses."""
        if self.is_identity:
            return 1.0
        a, b = plane
        c, m = 3 - a - b, self.matrix
        size = math.hypot(m[a][a], m[b][a])
        turn = 1.0 if m[a][a] * m[b][b] - m[a][b] * m[b][a] > 0 else -1.0
        slant = max(abs(m[a][a] - turn * m[b][b]), abs(m[b][a] + turn * m[a][b]), abs(m[c][a]), abs(m[c][b]))
        return turn * size if slant < _TURN_TOLERANCE * size else None

    def is_upright(self, third: int) -> bool:
        """Whether an axis still points where it pointed, so that a tool along it drills along it."""
        others = [i for i in range(3) if i != third]
        return self.is_identity or (abs(self.matrix[third][third] - 1) < _TURN_TOLERANCE and all(
            abs(self.matrix[i][third]) < _TURN_TOLERANCE and abs(self.matrix[third][i]) < _TURN_TOLERANCE for i in others))


def rotation(axis: int, angle: float) -> Matrix:
    """Return the rotation about an axis by an angle in degrees."""
    result = _identity()
    # Quarter turns exactly: a cosine of 6e-17 would tilt what stands square.
    quarter = angle / 90
    if quarter == round(quarter):
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    else:
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    result[a][a], result[a][b], result[b][a], result[b][b] = c, -s, s, c
    return result


def diagonal(values: Mapping[int, float]) -> Matrix:
    """Return the matrix that multiplies some axes."""
    return [[values.get(i, 1.0) if i == j else 0.0 for j in range(3)] for i in range(3)]


def _inverse(m: Matrix) -> Matrix:
    after = ((1, 2), (2, 0), (0, 1))
    minor = [[m[p][r] * m[q][s] - m[p][s] * m[q][r] for p, q in after] for r, s in after]
    size = sum(m[0][i] * minor[i][0] for i in range(3))
    return [[value / size for value in row] for row in minor]


def change_frame(frame: ProgramFrame, verb: str, words: Mapping[str, float], *, plane: int, unit: float) -> str:
    """Carry out TRANS, ROT, SCALE, MIRROR (which replace the frame) or ATRANS, AROT, ASCALE, AMIRROR (which add to it).

    Parameters
    ----------
    words : X, Y, Z (lengths, angles in degrees, factors) and RPL (an angle in the plane)
    plane : 17, 18 or 19; unit : m per programmed unit of length

    Returns
    -------
    What is wrong with the words, empty where they are right.
    """
    kind = verb.removeprefix("A")
    if verb == kind:
        frame.reset()
    axes = {AXES[letter]: value for letter, value in words.items() if letter in AXES}
    if kind == "TRANS":
        frame.translate([unit * axes.get(i, 0.0) for i in range(3)])
    elif kind == "SCALE":
        if any(value <= 0 for value in axes.values()):
            return f"{verb} with a factor of {min(axes.values()):g}; must be above zero"
        frame.multiply(diagonal(axes))
    elif kind == "MIRROR":
        frame.multiply(diagonal(dict.fromkeys(axes, -1.0)))
    elif "RPL" in words and axes:
        return f"{verb} with RPL and with angles about axes; program one of them"
    elif "RPL" in words:
        frame.multiply(rotation(3 - sum(PLANES[plane]), words["RPL"]))
    else:
        # Roll, pitch and yaw: first about Z, then about the new Y, then about the new X.
        for axis in (2, 1, 0):
            frame.multiply(rotation(axis, axes.get(axis, 0.0)))
    return ""
