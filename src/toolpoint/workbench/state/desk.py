"""Desk of the workbench: one project folder, read anew where its files have changed, its machines kept by their content."""

from __future__ import annotations

import contextlib
import os
import threading
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toolpoint import io
from toolpoint._check import FileDoubt, ToolpointWarning
from toolpoint._doubt import Doubt
from toolpoint.io.yaml.named_files import list_named_files
from toolpoint.project import Project
from toolpoint.project.engine.content import MIN_STAMP_AGE_NS, ContentCache, file_digest
from toolpoint.project.engine.outlook import StepOutlook

if TYPE_CHECKING:  # the first view waits for no machine
    from toolpoint.machine import Machine

STATE_PLACE = ".toolpoint/workbench"  # of the token, the last job and the server's address
KEPT_MACHINES = 4  # machines kept in memory, by path and content of their file
# Not watched: a run writes into the first all the time, files that are not entered yet wait in the second.
IGNORED_FOLDERS = ("results", "incoming")
MAX_WATCHED_FILES = 2000  # of one folder, the first by name


@dataclass(frozen=True)
class ReadMachine:
    """A machine with the doubts that its file states, and the digest of the file."""

    machine: Machine
    doubts: tuple[Doubt, ...]
    digest: str


@dataclass
class Desk:
    """Project folder as the workbench sees it: every read is kept until its files change.

    folder : of the project; lock : held during every read, as requests come from several threads.
    """

    folder: Path
    lock: threading.RLock = field(default_factory=threading.RLock)
    _cache: ContentCache | None = None
    _kept: tuple[str, Project] | None = None
    _digests: dict[str, tuple[list[int], str]] = field(default_factory=dict)

    @property
    def has_project(self) -> bool:
        """Whether the folder holds a project file."""
        return (self.folder / "project.yaml").is_file()

    def project(self) -> Project:
        """Return the project as its files are now; raises ToolpointError for a folder without one.

        It is read anew only where the stamp of its files has changed: a slider asks many times a second.
        """
        with self.lock:
            stamp = self.stamp(with_files=False)
            if self._kept is None or self._kept[0] != stamp:
                self._kept = (stamp, Project.open(self.folder))
            return self._kept[1]

    def outlook(self, project: Project) -> tuple[StepOutlook, ...]:
        """Return the state of all steps of a project; file contents are kept and read again only where they have changed."""
        with self.lock:
            if self._cache is None:
                self._cache = ContentCache(self.folder, self.folder / ".toolpoint" / "contents.json")
            return project.outlook(self._cache)

    def machine(self, file: Path) -> ReadMachine:
        """Return the machine of a file with the doubts that came with it."""
        with self.lock:
            own = self._digest(file)
            named = [self._digest(path) for path in _named_files(file, own) if path.is_file()]
            return _read_machine(str(file), " ".join([own, *named]))

    def _digest(self, file: Path) -> str:
        """Return the digest of a file; it is read again only where size, times or inode have changed."""
        status = file.stat()
        # A file that changed just now may change again within the clock's resolution: its stamp is not trusted yet.
        stamp = [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
        kept = self._digests.get(str(file))
        if kept is None or kept[0] != stamp or time.time_ns() - max(stamp[1:3]) < MIN_STAMP_AGE_NS:
            kept = self._digests[str(file)] = (stamp, file_digest(file))
        return kept[1]

    def stamp(self, *, with_files: bool = True) -> str:
        """Return a text that changes when something has changed on which views rest: a line of path, size and time for each.

        with_files : also a line for every file. Without, there are the project's own files and the folders alone; the time of
        a folder changes only where a file comes or goes. Hidden files and `IGNORED_FOLDERS` are left out.
        """
        places = [self.folder / name for name in ("project.yaml", "tried.yaml", "results/project.json", ".toolpoint/steps")]
        for folder, names, files in os.walk(self.folder):
            names[:] = sorted(name for name in names if not name.startswith(".") and name not in IGNORED_FOLDERS)
            places.append(Path(folder))
            if with_files:
                places += [Path(folder, name) for name in sorted(files)[:MAX_WATCHED_FILES] if not name.startswith(".")]
        entries = []
        for path in places:
            with contextlib.suppress(OSError):
                status = path.stat()
                entries.append(f"{path} {0 if path.is_dir() else status.st_size} {status.st_mtime_ns}")
        return "\n".join(entries)


@lru_cache(maxsize=KEPT_MACHINES)
def _named_files(file: Path, digest: str) -> tuple[Path, ...]:
    """Return the meshes and matrices that a machine file of this digest names."""
    return tuple(file.parent / name for name in list_named_files(file))


@lru_cache(maxsize=KEPT_MACHINES)
def _read_machine(file: str, digest: str) -> ReadMachine:
    """Read a machine file; the digests of it and of what it names are part of the cache's key: what changed is read anew."""
    machine, doubts = collect_doubts(lambda: io.read_machine(file))
    return ReadMachine(machine, doubts, digest)


def collect_doubts(call: Callable[[], Any]) -> tuple[Any, tuple[Doubt, ...]]:
    """Return what a call returns, and the doubts among its warnings, each once."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ToolpointWarning)
        result = call()
    doubts = [warning.message.args[0] if issubclass(warning.category, FileDoubt) else Doubt.parsed(str(warning.message))
              for warning in caught if issubclass(warning.category, ToolpointWarning) and isinstance(warning.message, Warning)]
    return result, tuple(dict.fromkeys(doubts))
