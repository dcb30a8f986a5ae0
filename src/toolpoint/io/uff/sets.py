"""Sets of a universal file: where each begins and ends, read lazily, every repair reported."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.uff.labels import LABEL_SET_NUMBER, NumberedLabels, parse_labels

# The literal start lets the search skip through gigabytes of numbers; what stands before it is looked at afterwards.
MARK = re.compile(rb"-1[ \t]*(?=[\r\n]|$)")
_LINE_LEAD = re.compile(rb"(?:^|[\r\n])([ \t]{0,8})$")
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

    >>> import tempfile
    >>> from toolpoint.io import uff
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "points.uff")
    ...     uff.write(path, uff.MeasuredGeometry((1, 2), [[0, 0, 0], [1, 0, 0]]))
    ...     uff.read_geometry(UniversalFile(path)).points
    (1, 2)
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

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return len(self._map)

    @cached_property
    def labels(self) -> NumberedLabels:
        """Labels that tables of this package give to numbers of the file; none in files of other programs."""
        return parse_labels([line for dataset in self.sets if dataset.number == LABEL_SET_NUMBER
                             for line in self.text(dataset).splitlines()], str(self.path))

    def text(self, dataset: UniversalSet) -> str:
        """Return the text records of a set (for a binary one, its header records)."""
        stop = dataset.data if dataset.binary else dataset.stop
        return self._map[dataset.body:stop].decode("latin-1")

    def behind(self, dataset: UniversalSet, lines: int) -> bytes:
        """Return what stands behind the first lines of a text set, up to its closing delimiter."""
        data = self._map[dataset.body:dataset.stop]
        start = data[:4096].decode("latin-1").splitlines(keepends=True)
        if len(start) <= lines:  # the last of these lines may go on
            start = data.decode("latin-1").splitlines(keepends=True)
        return data[sum(len(line) for line in start[:lines]):]

    def payload(self, dataset: UniversalSet) -> bytes:
        """Return the binary data of a set."""
        return self._map[dataset.data:dataset.data + dataset.length]

    def repaired(self, message: str) -> None:
        """Note a deviation that was read past, once."""
        if message not in self.repairs:
            self.repairs.append(message)

    def __repr__(self) -> str:
        kinds: dict[str, int] = {}
        for dataset in self.sets:
            name = f"{dataset.number}{'b' if dataset.binary else ''}"
            kinds[name] = kinds.get(name, 0) + 1
        listed = ", ".join(f"{count} x {name}" for name, count in kinds.items())
        return f"UniversalFile({self.path.name}: {listed}; {len(self.repairs)} repairs)"

    def _scan(self) -> Iterator[UniversalSet]:
        offset: int | None = self._first()
        while offset is not None:
            dataset, offset = self._one(offset)
            if dataset is not None:
                yield dataset

    def _first(self) -> int:
        match = self._delimiter(0, 65536)
        lead = self._map[:match[0]] if match else self._map[:256]
        if match is None or lead.strip() or not self._line(match[1])[0].strip()[:1].isdigit():
            first = bytes(lead).decode("latin-1").strip().split("\n")[0][:60]
            raise ToolpointError(f"{self.path}: not a universal file; it must start with a line of -1 and a set "
                                 f"number, found {first!r}; export it as universal file (UNV, UFF), set 58")
        if lead:
            self.repaired("blank lines before the first set")
        return match[1]

    def _delimiter(self, offset: int, stop: int | None = None) -> tuple[int, int] | None:
        """Return start (of its line) and end of the next line that holds -1 and nothing else."""
        for match in MARK.finditer(self._map, offset, len(self._map) if stop is None else min(stop, len(self._map))):
            lead = _LINE_LEAD.search(self._map[max(match.start() - 9, 0):match.start()])
            if lead is not None:
                return match.start() - len(lead[1]), match.end()
        return None

    def _line(self, offset: int) -> tuple[bytes, int]:
        """Return the line behind the line end at `offset`, and the offset of its own end."""
        size = len(self._map)
        if self._map[offset:offset + 1] in (b"\r", b"\n"):
            offset += 2 if self._map[offset:offset + 2] == b"\r\n" else 1
        end = self._map.find(b"\n", offset)
        end = size if end < 0 else end
        early = self._map.find(b"\r", offset, end)
        end = end if early < 0 else early
        return self._map[offset:end], end

    def _one(self, offset: int) -> tuple[UniversalSet | None, int | None]:
        line, end = self._line(offset)
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
        stop, after = self._close(self._leap(body, end) if number == 58 else end)
        return UniversalSet(number, line.decode("latin-1"), body, stop, header=self._header(body, stop)), after

    def _leap(self, body: int, end: int) -> int:
        """Return an offset just before the closing line of a text function, from its stated length; `end` where unsure.

        Lines of equal length are counted instead of searched, so that the headers of a gigabyte are read at once.
        """
        head = self._map[body:body + 2048].split(b"\n", 12)
        if len(head) < 13:
            return end
        words = head[6].split()
        try:
            kind, count, spacing = (int(word) for word in words[:3])
        except ValueError:
            return end
        each = (2 if kind in (5, 6) else 1) + (spacing != 1)
        per_line = {(True, True): 4, (True, False): each if kind == 6 else 2 * each}.get((kind in (4, 6), spacing == 1), 6)
        start = body + sum(len(line) + 1 for line in head[:11])
        full, remainder = divmod(count * each, per_line)
        length = len(head[11]) + 1
        guess = start + full * length - (length if not remainder else 0)
        # A wrong count must not skip sets: the guess holds only where a delimiter follows within three lines.
        if full < 2 or guess > len(self._map):
            return end
        closing = self._delimiter(guess, guess + 3 * length)
        return end if closing is None else guess

    def _close(self, offset: int) -> tuple[int, int | None]:
        match = self._delimiter(offset)
        if match is None:
            self.repaired("the last set is not closed by -1")
            return len(self._map), None
        return match[0], self._next_open(match[1])

    def _next_open(self, offset: int) -> int | None:
        line, end = self._line(offset)
        if _NUMBER.match(line) and end < len(self._map):
            self.repaired("one delimiter line between two sets instead of two")
            return offset
        match = self._delimiter(offset)
        return None if match is None else match[1]

    def _header(self, body: int, stop: int) -> tuple[str, ...]:
        part = self._map[body:min(stop, body + 4096)].decode("latin-1")
        return tuple(part.splitlines()[:HEADER_LINES])

    def _binary(self, number: int, line: bytes, body: int, description: bytes) -> tuple[UniversalSet | None, int | None]:
        words = description.split()
        try:
            order, lines, length = {1: "<", 2: ">"}[int(words[0])], int(words[2]), int(words[3])
        except (IndexError, KeyError, ValueError):
            raise ToolpointError(f"{self.path}: the header {line.decode('latin-1').strip()!r} of a binary set must "
                                 "give byte order, format, lines and bytes; the file is damaged") from None
        offset = body
        for _ in range(lines):
            newline = self._map.find(b"\n", offset)
            if newline < 0:
                raise ToolpointError(f"{self.path}: a binary set ends within its {lines} header lines; it is cut short")
            offset = newline + 1
        stop = offset + length
        following = self._map[stop:stop + 12].lstrip(b"\r\n \t")
        if stop > len(self._map) or not following.startswith(b"-1"):
            stop = self._recovered(offset, length)
        header = self._header(body, offset)
        dataset = UniversalSet(number, line.decode("latin-1"), body, stop, offset, stop - offset, order, True, header)
        match = self._delimiter(stop)
        return dataset, None if match is None else self._next_open(match[1])

    def _recovered(self, offset: int, length: int) -> int:
        """Return where the data of a binary set end whose byte count is wrong: at the delimiter that a set follows."""
        match = re.compile(rb"\r?\n?[ \t]{0,8}-1[ \t]*\r?\n(?:[ \t]{0,8}-1[ \t]*\r?\n|[\s]*$)").search(self._map, offset)
        if match is None:
            raise ToolpointError(f"{self.path}: a binary set of {length} bytes is not closed by -1; the file is cut "
                                 "short or was changed as text")
        self.repaired(f"a binary set states {length} bytes but holds {match.start() - offset}")
        return match.start()
