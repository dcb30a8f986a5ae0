"""Cards of Nastran bulk data in small, large and free fields, through INCLUDE statements."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Never

from toolpoint._check import ToolpointError

_INCLUDE_STATEMENT = re.compile(r"\s*INCLUDE\s+['\"]?([^'\"$]+?)['\"]?\s*(\$.*)?$", re.IGNORECASE)
_MAX_INCLUDE_DEPTH = 20  # files within files: beyond, they name each other in a circle


@dataclass(frozen=True)
class BulkCard:
    """A card with its file and line; fields[0] is the keyword, then eight data fields a line (four of large ones)."""

    path: Path
    line: int
    fields: tuple[str, ...]

    @property
    def keyword(self) -> str:
        """Name of the card, without the asterisk of large fields."""
        return self.fields[0].strip().rstrip("*").upper()

    def word(self, place: int) -> str:
        """Return a field without blanks; empty where the card ends before it."""
        return self.fields[place].strip() if place < len(self.fields) else ""

    def words(self, start: int) -> list[str]:
        """Return the fields from a place on that are not blank."""
        return [field.strip() for field in self.fields[start:] if field.strip()]

    def whole(self, place: int, default: int | None = None) -> int:
        """Return a whole number; `default` where the field is blank, an error where there is none."""
        word = self.word(place)
        return default if default is not None and not word else self.whole_of(word)

    def whole_of(self, word: str) -> int:
        """Return the whole number of a word of this card, or say where it is none."""
        try:
            return int(word)
        except ValueError:
            self.refuse(repr(word.strip()), "must be a whole number")

    def real(self, place: int, default: float | None = None) -> float:
        """Return a number as finite-element programs write it; `default` where the field is blank."""
        word = self.word(place)
        if default is not None and not word:
            return default
        text = word.upper().replace("D", "E")
        # Fields of eight characters leave no room for an E: 7.85-9 is 7.85e-9.
        text = re.sub(r"(?<=[0-9.])([+-]\d+)$", r"E\1", text) if "E" not in text else text
        try:
            value = float(text)
        except ValueError:
            self.refuse(repr(word), "must be a number")
        if not abs(value) < float("inf"):
            self.refuse(repr(word), "must be finite")
        return value

    def reals(self, places: range | Collection[int], default: float | None = 0.0) -> list[float]:
        """Return the numbers of several fields."""
        return [self.real(place, default) for place in places]

    def refuse(self, what: str, limit: str) -> Never:
        """Raise ToolpointError with file and line of the card."""
        raise ToolpointError(f"{self.path}:{self.line}: {self.keyword}: {what}; {limit}")

    def with_line(self, error: ToolpointError) -> ToolpointError:
        """Return an error with file and line of the card, which one of the card itself has already."""
        return ToolpointError(f"{self.path}:{self.line}: {self.keyword}: {error}") if error.argument else error


def bulk_cards(path: Path, keywords: Collection[str]) -> Iterator[BulkCard]:
    """Yield the cards of some kinds, of the file and of those that it includes, in their order.

    Raises ToolpointError where an included file is missing.
    """
    fields: list[str] = []
    place, keep = (Path(path), 0), False
    for file, number, raw in bulk_lines(Path(path)):
        line = raw.split("$")[0].rstrip()
        if not line:
            continue
        data, is_more = _split(line)
        if is_more:
            fields += data if keep else []
            continue
        if keep:
            yield BulkCard(*place, tuple(fields))
        # Cards of other kinds are passed over before their fields are kept: a mesh may have millions.
        keep = data[0].strip().rstrip("*").upper() in keywords
        fields, place = data, (file, number)
    if keep:
        yield BulkCard(*place, tuple(fields))


def bulk_lines(path: Path, depth: int = 0) -> Iterator[tuple[Path, int, str]]:
    """Yield file, number and text of every line, those of included files in their place."""
    for number, raw in enumerate(path.read_text(encoding="latin-1").splitlines(), 1):
        statement = raw.lstrip()[:7].upper() == "INCLUDE" and _INCLUDE_STATEMENT.match(raw)
        if not statement:
            yield path, number, raw
            continue
        included = path.parent / statement.group(1).strip()
        if not included.is_file():
            raise ToolpointError(f"{path}:{number}: INCLUDE {included}: no such file; must lie where the statement says, "
                                 "beside this file")
        if depth >= _MAX_INCLUDE_DEPTH:
            raise ToolpointError(f"{path}:{number}: INCLUDE {included}: {depth} files within each other; must not name each "
                                 "other in a circle")
        yield from bulk_lines(included, depth + 1)


def _split(line: str) -> tuple[list[str], bool]:
    """Return the fields of a line, with the keyword where it begins a card, and whether it goes on with the card before."""
    if "," in line:
        fields = line.split(",")
        is_more = fields[0].strip() == "" or fields[0].startswith(("+", "*"))
        # Filled up to eight: a short line ends in blank fields, and the line that continues it begins at the ninth.
        data = fields[1:5] if "*" in fields[0] else (fields[1:9] + [""] * 8)[:8]
        return (data if is_more else [fields[0], *data]), is_more
    head = line[:8]
    is_more = head.strip() == "" or head.startswith(("+", "*"))
    width = 16 if "*" in head else 8
    data = [line[k:k + width] for k in range(8, 72, width)]
    return (data if is_more else [head, *data]), is_more
