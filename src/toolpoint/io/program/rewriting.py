"""Programs with other spindle speeds and feeds (words S and F) and nothing else changed; the old words stay as comments.

The new text is read back before it is written: moves must equal those of the original, feeds and speeds those requested.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.program.gcode import parse
from toolpoint.io.program.klartext.reader import is_klartext
from toolpoint.io.program.path.segments import Program

_FEED_WORD = re.compile(r"(?<![A-Z#])F\s*(=?)\s*(\d+\.?\d*|\.\d+)(?![\w.])")
_SPEED_WORD = re.compile(r"(?<![A-Z#])S\s*(=?)\s*(\d+\.?\d*|\.\d+)(?![\w.])")
_ANY_FEED_OR_SPEED = re.compile(r"(?<![A-Z#])[FS]\s*=?\s*(?=[#\[RQ])")
# Feeds per time or revolution change with the speed themselves: a new F would mean another feed than was asked for.
_REFUSED_WORDS = re.compile(r"(?<![A-Z])G\s*(93|95|96)(?!\d)")
# In G4 the word F (or S) is a time: changed as a feed, the spindle would wait for another time.
_DWELL = re.compile(r"(?<![A-Z])G\s*0?4(?!\d)")
_FEED_DIGITS = 1  # decimals of a written F
MAX_FEED_MISMATCH = 0.01  # of the feed asked for, that rounding of the word may leave


@dataclass
class _Modal:
    """Words F in force: as the original has it, and as it is written."""

    original: float = 0.0
    written: float = 0.0


@dataclass(frozen=True)
class SpeedAndFeed:
    """Factors on words: of S by the line that holds it, of F by the line that moves; `lines` : those that move at a feed.

    Lines that are not named keep their words.

    >>> slower = SpeedAndFeed(speed={1: 0.8}, feed={5: 0.8})
    >>> slower.feed.get(6, 1.0)  # a line that is not named keeps its feed
    1.0
    """

    speed: Mapping[int, float] = field(default_factory=dict)
    feed: Mapping[int, float] = field(default_factory=dict)


def rewritten(text: str, factors: SpeedAndFeed) -> str:
    """Return the text of a program with its words S and F multiplied, the old words in comments.

    Raises ToolpointError for feeds per revolution or time, constant surface speed, and words S or F that are computed: with
    the line.
    """
    modal, klartext = _Modal(), is_klartext(text)
    has_brackets = not klartext and "(" in text
    out = []
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        body = line.rstrip("\r\n")
        code, comment = _code_of(body)
        _refuse(number, code)
        changed, old = _change_line(number, code, modal, factors, klartext=klartext)
        if old:
            words = " ".join(old)
            note = f" (was {words})" if has_brackets and ";" not in comment else f" ; was {words}"
            changed = changed.rstrip() + (f" {comment.strip()}" if comment and not note.startswith(" ;") else "") + note + (
                f" {comment.strip()}" if comment and note.startswith(" ;") else "")
            body = changed
        out.append(body + line[len(line.rstrip("\r\n")):])
    return "".join(out)


def write(text: str, factors: SpeedAndFeed, path: str | Path, *, original: str | Path | None = None) -> Path:
    r"""Write a program with other speeds and feeds, proven by reading it back; never over the original.

    Raises ToolpointError where the file is the original, or where what is read back differs in more than S and F.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write("S9000 M3\nG1 X30 F600\n", SpeedAndFeed(speed={1: 0.5}), Path(folder, "slow.nc")).read_text()
    'S4500 M3 ; was S9000\nG1 X30 F600\n'
    """
    path = Path(path)
    if original is not None and path.exists() and os.path.samefile(path, original):
        raise ToolpointError(f"{path}: is the program itself; it is never written over; choose another name")
    result = rewritten(text, factors)
    _prove(text, result, factors)
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=".program-", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(result)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
    return path


def _code_of(line: str) -> tuple[str, str]:
    """Return a line without its last comment, and that comment."""
    place = line.find(";")
    if place < 0 and line.rstrip().endswith(")") and "(" in line:
        place = line.rfind("(")
    return (line, "") if place < 0 else (line[:place], line[place:])


def _refuse(number: int, code: str) -> None:
    code = re.sub(r"\([^)]*\)", "", code.upper())
    if match := _REFUSED_WORDS.search(code):
        raise ToolpointError(f"program: line {number} has G{match[1]}: feeds per time or revolution and constant surface "
                             f"speed are not "
                             "written anew; post it with G94 and G97")
    if _ANY_FEED_OR_SPEED.search(code):
        raise ToolpointError(f"program: line {number} computes its S or F; words that are computed are not written anew")


def _change_line(number: int, code: str, modal: _Modal, factors: SpeedAndFeed, *, klartext: bool) -> tuple[str, list[str]]:
    """Return the line with its new words, and the old words that are not there any more."""
    old = []
    if (word := _search(_SPEED_WORD, code)) and number in factors.speed:
        value = float(word[2]) * factors.speed[number]
    if word and number in factors.speed and f"{value:.0f}" != f"{float(word[2]):.0f}":
        code, old = f"{code[:word.start()]}S{word[1]}{value:.0f}{code[word.end():]}", [word[0].strip()]
    word = None if _DWELL.search(code.upper()) else _search(_FEED_WORD, code)
    if word:
        modal.original = float(word[2])
    if number not in factors.feed:
        modal.written = modal.original if word else modal.written
        return code, old
    value = round(modal.original * factors.feed[number], _FEED_DIGITS)
    if word:
        new = f"F{word[1]}{value:g}"
        if value != float(word[2]):
            code, old = code[:word.start()] + new + code[word.end():], [*old, word[0].strip()]
    elif value != modal.written:
        code, old = _inserted(code, f"F{value:g}", klartext), [*old, f"F{modal.original:g}"]
    modal.written = value
    return code, old


def _search(pattern: re.Pattern[str], code: str) -> re.Match[str] | None:
    """Return the first match outside of comments in brackets."""
    masked = re.sub(r"\([^)]*\)", lambda match: " " * len(match[0]), code.upper())
    return pattern.search(masked)


def _inserted(code: str, word: str, klartext: bool) -> str:
    """Return the code with a word F: before the words M of Klartext, at the end of other controls."""
    place = re.search(r"\s+M\d+", code.upper()) if klartext else None
    return f"{code.rstrip()} {word}" if place is None else f"{code[:place.start()]} {word}{code[place.start():]}"


def _prove(start_column: str, after: str, factors: SpeedAndFeed) -> None:
    """Refuse a text that, read back, moves otherwise, or has other speeds and feeds than asked for."""
    a, b = _read(start_column), _read(after)
    is_same = a.kind.shape == b.kind.shape and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in (
        "kind", "start", "end", "center", "sweep", "plane", "rapid", "stop", "line", "dwell", "tool"))
    if not is_same:
        raise ToolpointError("program: read back, the new one moves otherwise than the original; nothing was written")
    cut = ~a.rapid
    meant = a.feed * np.array([factors.feed.get(int(n), 1.0) for n in a.line])
    wrong = cut & (np.abs(b.feed - meant) > MAX_FEED_MISMATCH * meant)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ToolpointError(f"program: read back, line {a.line[k]} has a feed of {60e3 * b.feed[k]:g} mm/min where "
                             f"{60e3 * meant[k]:g} was "
                             "meant; nothing was written")


def _read(text: str) -> Program:
    # Radius compensation moves both texts alike: contours as programmed are compared.
    return parse(text, start=(0.0, 0.0, 1.0), feed=1.0, cutter_radius=0.0)
