"""Steps of a five-axis program: its tips and directions along every segment, through the rotary axes of the machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.drives.program.path import Path
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.material_removal.tri_dexels.turned_moves import TurnedMoves
from toolpoint.studies.machining.five_axes.tool_directions import ROTARY_LETTERS, RotaryAxes
from toolpoint.studies.machining.program_path import ParsedProgram

MAX_STEP_TURN, MAX_RAPID_TURN = np.radians(1.0), np.radians(5.0)  # rad, of the angles of one step
MAX_TURNED_STEPS = 400_000  # of a program
_UPRIGHT_ANGLE = 1e-9  # rad


class FiveAxisProgram(ParsedProgram, Protocol):
    """Program with directions of the tool, see `io.program.path.segments.Program`."""

    @property
    def directions(self) -> FloatArray:
        """Programmed directions of the tool at both ends of every segment, (n, 12), see `io.program.control.tool_centre`."""
        ...

    @property
    def is_controlled(self) -> np.ndarray:
        """Whether tool centre control is in force, (n,)."""
        ...

    @property
    def unseen(self) -> np.ndarray:
        """Rapids whose tip's way is not known, (n,)."""
        ...

    @property
    def is_tilted(self) -> bool:
        """Whether planes are tilted too."""
        ...

    def tip_path(self) -> Path:
        """Segments of the tip as a path."""
        ...


@dataclass(frozen=True, eq=False)
class TurnedPath:
    """Steps of a program; angles_at_ends : (n, 2, 3) of A, B and C, rad (not a number without a machine); of every segment the
    number of steps and the size of its turn (rad)."""

    moves: TurnedMoves
    angles_at_ends: FloatArray
    steps: np.ndarray
    turn: FloatArray

    @property
    def angles(self) -> FloatArray:
        """Angles of A, B and C at the end of every step, (n, 3) rad."""
        return self.angles_at_ends[:, 1]


def find_ends(program: FiveAxisProgram, rotary: RotaryAxes | None, lines: np.ndarray) -> FloatArray:
    """Return what turns the tool at both ends of every segment: angles (n, 2, 3), rad, with a machine, else unit vectors.

    A vector takes the angles nearest to those before. Raises ToolpointError, with the line, for angles without a machine, or of
    axes that the machine does not have.
    """
    programmed = program.directions.reshape(-1, 2, 2, 3)  # segment, end, angles or vector
    ends = np.zeros((len(programmed), 2, 3))
    last: FloatArray = np.zeros(3)
    for k in range(len(programmed)):
        for end in (0, 1):
            angles, vector = programmed[k, end]
            if rotary is not None:
                last = _angles(rotary, angles, vector, start=last, line=int(lines[k])) if program.is_controlled[k] else 0 * last
                ends[k, end] = last
            else:
                ends[k, end] = _vector(angles, vector, line=int(lines[k])) if program.is_controlled[k] else (0.0, 0.0, 1.0)
    return ends


def _angles(rotary: RotaryAxes, angles: FloatArray, vector: FloatArray, *, start: FloatArray, line: int) -> FloatArray:
    if np.isnan(vector[0]):
        foreign = [ROTARY_LETTERS[k] for k in range(3) if k not in rotary.indices and abs(angles[k]) > _UPRIGHT_ANGLE]
        if foreign:
            raise ToolpointError(f"program: line {line} turns {foreign[0]}, and the machine turns {', '.join(rotary.letters)}; "
                                 "post the program for this machine, or with vectors of the tool")
        for letter, (lower, upper) in zip(rotary.letters, rotary.limits, strict=True):
            angle = angles[ROTARY_LETTERS.index(letter)]
            if not lower - _UPRIGHT_ANGLE <= angle <= upper + _UPRIGHT_ANGLE:
                raise ToolpointError(f"program: line {line} turns {letter} to {np.degrees(angle):.6g}°, beyond its travel of "
                                     f"{np.degrees(lower):g} .. {np.degrees(upper):g}°; post the program for this machine")
        return angles
    try:
        return rotary.angles_for(vector, start)
    except ToolpointError as error:
        raise ToolpointError(f"program: line {line}: {error}") from None


def _vector(angles: FloatArray, vector: FloatArray, *, line: int) -> FloatArray:
    if not np.isnan(vector[0]):
        return vector
    if np.abs(angles).max() > _UPRIGHT_ANGLE:
        raise ToolpointError(f"program: line {line} turns rotary axes, and which direction they give is known of a "
                             "machine alone; give `machine`, or post the program with vectors of the tool")
    return np.array([0.0, 0.0, 1.0])


def split_turned(path: Path, ends: FloatArray, rotary: RotaryAxes | None, *, step: float, lever: float, is_seen: np.ndarray,
                 shape: np.ndarray) -> TurnedPath:
    """Return the steps of a program: none longer than `step` (m) at the tip and a `lever` (m) above it, nor turned by more than
    `MAX_STEP_TURN`.

    ends : as of `find_ends`; is_seen : (n,) segments whose tip's way is known; shape : (n,) of the tools.
    """
    lengths = np.linalg.norm(path.end - path.start, axis=1)
    if rotary is None:
        across = np.linalg.norm(np.cross(ends[:, 0], ends[:, 1]), axis=1)
        turn = np.arctan2(across, np.einsum("ni,ni->n", ends[:, 0], ends[:, 1]))
    else:
        turn = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    fine = np.maximum((lengths + lever * turn) / step, turn / MAX_STEP_TURN)
    count = np.ceil(np.where(path.rapid, np.maximum(turn / MAX_RAPID_TURN, lengths > 0), fine) - 1e-9).astype(int)
    count[~is_seen] = 0
    if count.sum() > MAX_TURNED_STEPS:
        raise ToolpointError(f"program: {count.sum()} steps of the tool; at most {MAX_TURNED_STEPS} are cut; run a part of it")
    block = np.repeat(np.arange(path.count), count)
    order = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    share = np.stack([order, order + 1], axis=1) / count[block][:, None]
    tips = path.start[block][:, None] + share[..., None] * (path.end - path.start)[block][:, None]
    is_last = share[:, 1] == 1.0  # ends are those of the program, free of rounding
    tips[is_last, 1] = path.end[block[is_last]]
    if rotary is None:
        axes = _great_circle(ends[block], turn[block], share)
        frames, angles = smallest_turn(axes), np.full((block.size, 2, 3), np.nan)
    else:
        turned = ends[block][:, :1] + share[..., None] * (ends[:, 1] - ends[:, 0])[block][:, None]
        frames = rotary.frames(turned.reshape(-1, 3)).reshape(-1, 2, 3, 3)
        axes, angles = frames[..., 2], turned
    motion = TurnedMoves(tips, np.ascontiguousarray(axes), frames, block, shape[block], path.rapid[block])
    return TurnedPath(motion, angles, count, turn)


def _great_circle(ends: FloatArray, turn: FloatArray, share: FloatArray) -> FloatArray:
    """Return unit vectors (n, 2, 3) at shares (n, 2) of the turn (rad) between two of them."""
    sine = np.sin(turn)[:, None]
    flat = sine < 1e-9
    safe = np.where(flat, 1.0, sine)
    first = np.where(flat, 1 - share, np.sin((1 - share) * turn[:, None]) / safe)
    last = np.where(flat, share, np.sin(share * turn[:, None]) / safe)
    mixed = first[..., None] * ends[:, :1] + last[..., None] * ends[:, 1:]
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))
