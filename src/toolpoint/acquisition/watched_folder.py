"""Watched folder: records that another program writes, each taken once it is whole."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.acquisition.device import DeviceFault, SampleBlock

SETTLING_SECONDS = 0.3  # s in which a file has not grown: it is whole
LOOK_SECONDS = 0.05  # s between two looks into the folder


@dataclass(frozen=True, eq=False)
class FolderRecord:
    """Content of a file: samples (n, n_channels), rate (Hz; None where the file does not say it), names and units."""

    samples: FloatArray
    rate: float | None
    names: tuple[str, ...]
    units: tuple[str, ...]


class WatchedFolder:
    """Delivers each new file of a folder as one record.

    Parameters
    ----------
    folder : path
    read : callable
        Reader of a file's FolderRecord, raising ToolpointError for one that is not whole.
    pattern : str
        Of the names of the files.
    rate : float, optional
        Hz, where the files do not say it.

    Examples
    --------
    >>> from toolpoint.acquisition import WatchedFolder
    >>> WatchedFolder("records", read=lambda path: None).pattern
    '*'
    """

    def __init__(self, folder: str | Path, read: Callable[[Path], FolderRecord], pattern: str = "*", *,
                 rate: float | None = None) -> None:
        self.folder, self.pattern, self._read = Path(folder), pattern, read
        self.rate = 0.0 if rate is None else rate
        self.names, self.units = tuple[str, ...](), tuple[str, ...]()
        self.ranges: tuple[float | None, ...] = ()
        self.doubts: tuple[Doubt, ...] = ()
        self._sizes: dict[Path, tuple[tuple[int, int], float]] = {}
        self._taken, self._delivered, self._is_open = set[Path](), 0, False
        self._first: SampleBlock | None = None

    def open(self) -> None:
        """Begin with files that come from now on; those that are there are left alone. A second call changes nothing."""
        if self._is_open:
            return
        if not self.folder.is_dir():
            raise DeviceFault(f"{self.folder}: no such folder; must be the one into which the other program writes")
        self._taken, self._is_open = set(self.folder.glob(self.pattern)), True

    def close(self) -> None:
        """Stop watching."""

    def read(self, timeout: float) -> SampleBlock | None:
        """Return the next whole record, None where none came in time."""
        if self._first is not None:
            first, self._first = self._first, None
            return first
        end = time.monotonic() + timeout
        while True:
            if (record := self._next_record()) is not None:
                return record
            if time.monotonic() >= end:
                return None
            time.sleep(LOOK_SECONDS)

    def wait_for_first(self) -> None:
        """Wait for the first record, which says rate, names and units; it is delivered by the next `read`."""
        self.open()
        while self._first is None:
            self._first = self.read(1.0)

    def _next_record(self) -> SampleBlock | None:
        if not self.folder.is_dir():
            raise DeviceFault(f"{self.folder}: the folder is gone")
        for path in sorted(self.folder.glob(self.pattern)):
            if path in self._taken or not path.is_file() or not self._is_settled(path):
                continue
            self._taken.add(path)
            return self._block_of(path)
        return None

    def _is_settled(self, path: Path) -> bool:
        """Whether a file has kept its size and time for a while."""
        state, now = (path.stat().st_size, path.stat().st_mtime_ns), time.monotonic()
        previous, since = self._sizes.get(path, (None, now))
        if previous != state:
            self._sizes[path] = (state, now)
            return False
        return now - since >= SETTLING_SECONDS

    def _block_of(self, path: Path) -> SampleBlock:
        record = self._read(path)
        rate = record.rate or self.rate
        if not rate:
            raise ToolpointError(f"{path}: no sample rate; give it with `rate`, Hz")
        if self.names and (len(record.names) != len(self.names) or abs(rate / self.rate - 1) > 1e-6):
            raise DeviceFault(f"{path}: {len(record.names)} channels at {rate:g} Hz; must be {len(self.names)} at "
                              f"{self.rate:g} Hz, as the first record; begin anew for another set-up")
        self.rate, self.names, self.units = float(rate), record.names, record.units
        self.ranges = (None,) * len(record.names)
        block = SampleBlock(record.samples, self._delivered, time.monotonic(), is_record=True, name=path.name)
        self._delivered = block.stop
        return block
