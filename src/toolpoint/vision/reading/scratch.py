"""Scratch: decoded frames kept in an unnamed file, so that a video is decoded once however often it is read."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from typing import IO

import numpy as np

from toolpoint.vision.clip import Frames

MAX_SCRATCH_BYTES = 4_000_000_000  # 4 GB: half a minute of a 1 Mpixel clip at 120 frames a second
# A file takes at most this fraction of the free disk space, the rest is left to others.
FREE_SPACE_DIVISOR = 2


class Scratch:
    """Frames of one source in a temporary file without a name: it goes away with the object."""

    def __init__(self, limit: int | None = None) -> None:
        self.limit = MAX_SCRATCH_BYTES if limit is None else limit
        self.is_whole = False
        self._file: IO[bytes] | None = None
        self._count = 0
        self._shape: tuple[int, int] = (0, 0)
        self._kind = np.dtype(np.uint8)

    def keep(self, chunks: Iterator[Frames]) -> Iterator[Frames]:
        """Pass chunks on and keep them as they come, as long as there is room."""
        self._file, self._count = None, 0
        available_bytes = min(self.limit, shutil.disk_usage(tempfile.gettempdir()).free // FREE_SPACE_DIVISOR)
        file: IO[bytes] | None = tempfile.TemporaryFile() if available_bytes > 0 else None  # noqa: SIM115 - lives on with the object
        for frames in chunks:
            if file is not None:
                if (self._count + len(frames)) * frames[0].nbytes > available_bytes:
                    file.close()
                    file = None
                else:
                    frames.tofile(file)
                    self._count += len(frames)
                    self._shape, self._kind = (frames.shape[1], frames.shape[2]), frames.dtype
            yield frames
        self._file, self.is_whole = file, file is not None

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the kept frames."""
        assert self._file is not None
        rows, columns = self._shape
        for start in range(0, self._count, size):
            frame_count = min(size, self._count - start)
            # A reader that stops half way must not move the place of another one.
            self._file.seek(start * rows * columns * self._kind.itemsize)
            yield np.fromfile(self._file, self._kind, frame_count * rows * columns).reshape(frame_count, rows, columns)
