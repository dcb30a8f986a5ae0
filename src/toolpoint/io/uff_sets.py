"""Sets of a universal file: where each begins and ends, read lazily, every repair reported; a clear no to other files."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from toolpoint._check import ToolpointError

DELIMITER = re.compile(rb"(?:^|\n|\r)[ \t]{0,8}-1[ \t]*(?=\r|\n|$)")
_NUMBER = re.compile(rb"^\s*(\d{1,6})\s*([bB]?)(.*)$")
HEADER_LINES = 11


@dataclass(frozen=True)
class UniversalSet:
    """One set: its number, where its text and its binary part lie in the file (bytes), and its first lines.

    `body` is the offset of the first record, `stop` that of the closing delimiter. A binary set (58b) has its data at
    `data` .. `data + length` in the byte order `order` (``<`` or ``>``).
    """

    number: int
    line_of_number: str
    body: int
    stop: int
    data: int = 0
    length: int = 0
    order: str = "<"
    binary: bool = False
    header: tuple[str, ...] = field(default=(), repr=False)


class UniversalFile:
    """A universal file opened for reading: only the delimiters and first lines of its sets are read at first.

    Parameters
    ----------
    path : path

    Attributes
    ----------
    sets : tuple of UniversalSet
    repairs : list of str
        Every deviation from the format that was read past.

    Raises
    ------
    ToolpointError
        Where the file cannot be read or is not a universal file.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.repairs: list[str] = []
        try:
            with self.path.open("rb") as file:
                self._map: mmap.mmap | bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
        except ValueError:
            raise ToolpointError(f"{path}: an empty file; expected a universal file") from None
        self.sets = tuple(self._scan())

    def text(self, one: UniversalSet) -> str:
        """Return the text records of a set (for a binary one, its header records)."""
        stop = one.data if one.binary else one.stop
        return self._map[one.body:stop].decode("latin-1")

    def bytes(self, one: UniversalSet) -> bytes:
        """Return the binary data of a set."""
        return self._map[one.data:one.data + one.length]

    def repaired(self, message: str) -> None:
        """Note a deviation that was read past, once."""
        if message not in self.repairs:
            self.repairs.append(message)

    def __repr__(self) -> str:
        kinds: dict[str, int] = {}
        for one in self.sets:
            name = f"{one.number}{'b' if one.binary else ''}"
            kinds[name] = kinds.get(name, 0) + 1
        listed = ", ".join(f"{count} x {name}" for name, count in kinds.items())
        return f"UniversalFile({self.path.name}: {listed}; {len(self.repairs)} repairs)"

    def _scan(self) -> Iterator[UniversalSet]:
        at = self._first()
        while at is not None:
            start, at = self._one(at)
            if start is not None:
                yield start

    def _first(self) -> int:
        match = DELIMITER.search(self._map, 0, min(len(self._map), 65536))
        lead = self._map[:match.start()] if match else self._map[:256]
        if match is None or lead.strip() or self._line(match.end())[0].strip()[:1].isdigit() is False:
            first = bytes(lead).decode("latin-1").strip().split("\n")[0][:60]
            raise ToolpointError(f"{self.path}: not a universal file; it must start with a line of -1 and a set number, "
                                 f"found {first!r}; export it as universal file (UNV, UFF), set 58")
        if lead:
            self.repaired("blank lines before the first set")
        return match.end()

    def _line(self, at: int) -> tuple[bytes, int]:
        """Return the line after the line end at or before `at`, and the offset behind it."""
        size = len(self._map)
        while at < size and self._map[at:at + 1] in (b"\r", b"\n"):
            step = 2 if self._map[at:at + 2] == b"\r\n" else 1
            at += step
            break
        ends = [end for end in (self._map.find(b"\n", at), self._map.find(b"\r", at)) if end >= 0]
        end = min(ends, default=size)
        return self._map[at:end], end

    def _one(self, at: int) -> tuple[UniversalSet | None, int | None]:
        line, end = self._line(at)
        while not line.strip() and end < len(self._map):
            self.repaired("blank line before a set number")
            line, end = self._line(end)
        if line.strip() == b"-1":  # a delimiter twice: the last one opens
            self.repaired("a delimiter line twice")
            return None, end
        match = _NUMBER.match(line)
        if match is None:
            if line.strip():
                self.repaired(f"text between sets skipped: {line[:40].decode('latin-1').strip()!r}")
            return None, self._next_open(end)
        number, binary = int(match[1]), bool(match[2])
        body = end + (2 if self._map[end:end + 2] == b"\r\n" else 1)
        if binary:
            return self._binary(number, line, body, match[3])
        stop, after = self._close(end)
        return UniversalSet(number, line.decode("latin-1"), body, stop, header=self._header(body, stop)), after

    def _close(self, at: int) -> tuple[int, int | None]:
        match = DELIMITER.search(self._map, at)
        if match is None:
            self.repaired("the last set is not closed by -1")
            return len(self._map), None
        return match.start() + 1, self._next_open(match.end())

    def _next_open(self, at: int) -> int | None:
        match = DELIMITER.search(self._map, at)
        return None if match is None else match.end()

    def _header(self, body: int, stop: int) -> tuple[str, ...]:
        part = self._map[body:min(stop, body + 4096)].decode("latin-1")
        return tuple(part.splitlines()[:HEADER_LINES])

    def _binary(self, number: int, line: bytes, body: int, rest: bytes) -> tuple[UniversalSet | None, int | None]:
        words = rest.split()
        try:
            order, lines, length = {1: "<", 2: ">"}[int(words[0])], int(words[2]), int(words[3])
        except (IndexError, KeyError, ValueError):
            raise ToolpointError(f"{self.path}: the header {line.decode('latin-1').strip()!r} of a binary set must give "
                                 "byte order, format, lines and bytes; the file is damaged") from None
        at = body
        for _ in range(lines):
            found = self._map.find(b"\n", at)
            if found < 0:
                raise ToolpointError(f"{self.path}: a binary set ends within its {lines} header lines; it is cut short")
            at = found + 1
        stop = at + length
        ahead = self._map[stop:stop + 12].lstrip(b"\r\n \t")
        if stop > len(self._map) or not ahead.startswith(b"-1"):
            stop = self._recovered(at, length)
        header = self._header(body, at)
        one = UniversalSet(number, line.decode("latin-1"), body, stop, at, stop - at, order, True, header)
        match = DELIMITER.search(self._map, max(stop - 1, 0))
        return one, None if match is None else self._next_open(match.end())

    def _recovered(self, at: int, length: int) -> int:
        """Return where the data of a binary set end whose byte count is wrong: at the delimiter that a set follows."""
        match = re.compile(rb"\r?\n?[ \t]{0,8}-1[ \t]*\r?\n(?:[ \t]{0,8}-1[ \t]*\r?\n|[\s]*$)").search(self._map, at)
        if match is None:
            raise ToolpointError(f"{self.path}: a binary set of {length} bytes is not closed by -1; the file is cut short "
                                 "or was changed as text")
        self.repaired(f"a binary set states {length} bytes but holds {match.start() - at}")
        return match.start()
