r"""Tilted planes (3+2): G68.2 with G53.1 and G69 (Fanuc), CYCLE800 (Siemens), PLANE SPATIAL and PLANE RESET (Heidenhain).

A point p of the tilted plane lies at :math:`o + R p` in the work. While a plane is tilted the modal state is in the axes of R,
so arcs and cycles are computed as in an upright plane; each segment keeps its plane. Other ways to tilt are
refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from toolpoint.io.program.control.frame import AXES, Matrix, ProgramFrame, rotation

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

_ROTATION_TOLERANCE = 1e-9
_SPATIAL_PATTERN = re.compile(r"PLANE\s+SPATIAL\s+SPA\s*([+-]?[\d.]+)\s+SPB\s*([+-]?[\d.]+)\s+SPC\s*([+-]?[\d.]+)(.*)")
_SWIVEL_PARAMETERS = ("_FR", "_TC", "_ST", "_MODE", "_X0", "_Y0", "_Z0", "_A", "_B", "_C", "_X1", "_Y1", "_Z1", "_DIR")
_AXIS_BY_AXIS_MODE = 0  # bits 6 and 7 of _MODE: angles about axes, one after another
_UPRIGHT_ROTATION: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@dataclass
class TiltedPlane:
    """Plane in force: rotation R (None upright), origin (m, in the work's axes), whether the tool has been turned to it."""

    matrix: Matrix | None = None
    origin: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    is_reached: bool = True
    upright_frame: ProgramFrame | None = None

    def into(self, vector: list[float]) -> list[float]:
        """Return a vector of the work in the axes of the plane, R^T v."""
        m = self.matrix
        return vector if m is None else [sum(m[i][j] * vector[i] for i in range(3)) for j in range(3)]

    def out(self, vector: list[float]) -> list[float]:
        """Return a vector of the plane in the axes of the work, R v."""
        return vector if self.matrix is None else product(self.matrix, vector)


def product(matrix: Matrix, vector: list[float]) -> list[float]:
    """Return the product of a matrix and a vector."""
    return [sum(a * v for a, v in zip(row, vector, strict=True)) for row in matrix]


def tilt(state: ControlModes, number: int, turns: list[tuple[int, float]], *, origin: list[float], is_reached: bool) -> None:
    """Tilt the plane from upright by turns about axes (0 to 2, degrees), each about the axis as the turns before left it.

    origin : of the plane in the program's coordinates, m.
    """
    cancel(state)
    frame = state.frame
    combined = [list(row) for row in frame.matrix]
    if not _is_rotation(combined):
        state.remarks.fault(number, 1, "a tilted plane where the program's axes are mirrored or stretched is not computed")
        return
    for axis, angle in turns:
        step = rotation(axis, angle)
        combined = [[sum(row[k] * step[k][j] for k in range(3)) for j in range(3)] for row in combined]
    place = [a + b for a, b in zip(frame.shift, frame.turned(origin), strict=True)]
    _enter(state, TiltedPlane(combined, place, is_reached, frame))


def cancel(state: ControlModes) -> None:
    """Return to the upright axes and the frame that was in force before the plane was tilted."""
    if state.tilted.matrix is not None:
        frame = state.tilted.upright_frame
        _enter(state, TiltedPlane())
        state.frame = frame or ProgramFrame()


def _enter(state: ControlModes, plane: TiltedPlane) -> None:
    state.position = plane.into(state.tilted.out(state.position))
    state.tilted, state.frame = plane, ProgramFrame()
    state.segments.enter_plane(plane.matrix or _UPRIGHT_ROTATION)


def _is_rotation(m: Matrix) -> bool:
    gram = [[sum(m[k][i] * m[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    volume = sum(m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]) for i in range(3))
    return volume > 0 and all(abs(gram[i][j] - (i == j)) < _ROTATION_TOLERANCE for i in range(3) for j in range(3))


def tilt_by_euler(state: ControlModes, number: int, places: Mapping[str, tuple[str, float]]) -> None:
    """Tilt by G68.2 X Y Z I J K: origin, and angles about Z, the new X and the new Z; it is reached by G53.1."""
    origin = [state.length(i, places[letter][1]) if letter in places else 0.0 for letter, i in AXES.items()]
    angles = [places[letter][1] if letter in places else 0.0 for letter in "IJK"]
    tilt(state, number, list(zip((2, 0, 2), angles, strict=True)), origin=origin, is_reached=False)


def tilt_by_swivel_cycle(state: ControlModes, number: int, values: list[float | None]) -> None:
    """Tilt by CYCLE800: angles about axes one after another, a shift before and one after; without parameters upright."""
    named = {name: value for name, value in zip(_SWIVEL_PARAMETERS, values, strict=False) if value is not None}
    if not named:
        cancel(state)
        return
    mode, kind = int(named.get("_MODE", 57)), int(named.get("_ST", 0))
    if mode >> 6 != _AXIS_BY_AXIS_MODE or kind % 10 != 0:
        what = "solid, projected or machine angles" if kind % 10 == 0 else "a plane added to the one before"
        state.remarks.fault(number, 1, f"CYCLE800 with {what} is not computed; swivel anew, axis by axis")
        return
    order = [(mode >> shift & 3) - 1 for shift in (0, 2, 4)]
    if sorted(order) != [0, 1, 2]:
        state.remarks.fault(number, 1, f"CYCLE800 with _MODE {mode}: its order of axes is not X, Y and Z once each")
        return
    turns = [(axis, named.get(name, 0.0)) for axis, name in zip(order, ("_A", "_B", "_C"), strict=True)]
    tilt(state, number, turns, origin=[state.scale * named.get(f"_{axis}0", 0.0) for axis in "XYZ"], is_reached=True)
    state.frame.translate([state.scale * named.get(f"_{axis}1", 0.0) for axis in "XYZ"])


def tilt_by_plane_function(state: ControlModes, number: int, line: str) -> str:
    """Tilt by PLANE SPATIAL (turns about the fixed X, Y, Z in this order) or PLANE RESET; return what is refused."""
    if line.startswith("PLANE RESET"):
        cancel(state)
        return ""
    match = _SPATIAL_PATTERN.match(line)
    if match is None:
        kind = " ".join(line.split()[:2])
        return f"{kind}: this way to tilt is not computed; program PLANE SPATIAL with numbers"
    a, b, c = (float(match[k]) for k in (1, 2, 3))
    tilt(state, number, [(2, c), (1, b), (0, a)], origin=[0.0, 0.0, 0.0], is_reached=True)
    if re.search(r"\bSTAY\b", match[4]):
        state.remarks.note(number, "PLANE with STAY: the rotary axes are taken to be turned before the next cut")
    return ""
