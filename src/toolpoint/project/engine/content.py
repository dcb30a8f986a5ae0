"""Content of files as SHA-256, kept beside size and times, so that a file is read again only where these have changed."""

from __future__ import annotations

import hashlib
import json
import os
import time
from pathlib import Path

from toolpoint.project.engine.drafts import write_whole

READ_BLOCK = 1 << 20  # bytes
# A file that was written so shortly before it was read may be written once more within the same tick of the file system's
# clock: such a stamp is not believed.
MIN_STAMP_AGE_NS = 2_000_000_000  # ns
Stamp = list[int]


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(READ_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def text_digest(text: str) -> str:
    """Return the SHA-256 of a text, hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


class ContentCache:
    """Digests of the files of a project, by their path, with size, times and inode when they were read."""

    def __init__(self, root: Path, file: Path) -> None:
        self.root, self._file, self._changed = root, file, False
        self._entries: dict[str, tuple[Stamp, str]] = _read_entries(file)

    def digest(self, path: str) -> str:
        """Return the digest of a file relative to the project, empty where there is none."""
        full = self.root / path
        try:
            status = full.stat()
            stamp = [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]
            if (entry := self._entries.get(path)) is not None and entry[0] == stamp:
                return entry[1]
            digest = file_digest(full)
        except OSError:
            return ""
        if abs(time.time_ns() - max(stamp[1], stamp[2])) > MIN_STAMP_AGE_NS:
            self._entries[path], self._changed = (stamp, digest), True
        return digest

    def save(self) -> None:
        """Write the digests where some are new."""
        if self._changed:
            write_whole(self._file, json.dumps(self._entries))
            self._changed = False


def _read_entries(file: Path) -> dict[str, tuple[Stamp, str]]:
    """Return the kept digests; a file that cannot be read costs time and nothing else."""
    try:
        entries = json.loads(file.read_text(encoding="utf-8"))
        return {path: (list(stamp), str(digest)) for path, (stamp, digest) in entries.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def exists(root: Path, path: str) -> bool:
    """Whether a file relative to the project is there."""
    return os.path.isfile(root / path)
