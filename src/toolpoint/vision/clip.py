"""Clip: grey frames at their true rate, read in chunks, with what is doubtful about them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from toolpoint._check import count, fail, floats, positive, scalar
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText

Frames = NDArray[np.unsignedinteger]
CHUNK_BYTES = 24_000_000  # of the frames that are held at once
MIN_FRAME_SIDE, MAX_FRAME_SIDE = 8, 16_384  # pixels of a side of a frame or region


class FrameSource(Protocol):
    """Source of frames that can be read repeatedly from the start, a chunk at a time."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""
        ...

    @property
    def bits(self) -> int:
        """Bits of a pixel, 8 to 16."""
        ...

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order, (n, rows, columns) with n up to `size`, unsigned integers."""
        ...


@dataclass(frozen=True)
class Region:
    """A rectangle of the picture in pixels: left column, top row, columns, rows.

    Examples
    --------
    >>> region = Region.parse("100,50,640,480")
    >>> region.width, region.holds(np.array([[100, 50], [99, 50]])).tolist()
    (640, [True, False])
    """

    left: int
    top: int
    width: int
    height: int

    @classmethod
    def parse(cls, text: str) -> Region:
        """Read ``left,top,width,height``."""
        parts = text.split(",")
        if len(parts) != 4 or not all(part.strip().lstrip("-").isdigit() for part in parts):
            fail("region", repr(text), "must read left,top,width,height in pixels", remedy="for example 100,50,640,480")
        return cls(*(int(part) for part in parts))

    def within(self, shape: tuple[int, int], name: str = "region") -> Region:
        """Return the region after checking that it lies in a picture of (rows, columns)."""
        rows, columns = shape
        fits = self.left >= 0 and self.top >= 0 and self.left + self.width <= columns and self.top + self.height <= rows
        if not fits or self.width < MIN_FRAME_SIDE or self.height < MIN_FRAME_SIDE:
            fail(name, f"{self.left},{self.top},{self.width},{self.height}",
                 f"must lie within 0,0,{columns},{rows} (left,top,width,height) and be at least {MIN_FRAME_SIDE} "
                 f"pixels wide and high")
        return self

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Return which points (n, 2), column and row, lie inside."""
        x, y = points[..., 0] - self.left, points[..., 1] - self.top
        return (x >= 0) & (y >= 0) & (x < self.width) & (y < self.height)


@dataclass(frozen=True, eq=False)
class Clip(NotebookText):
    """Grey frames of a vibrating machine.

    Parameters
    ----------
    source : FrameSource
    frame_rate : float
        True frames per second, Hz: of the camera, not of the player.
    row_delay : float
        Time between the exposures of neighbouring rows (rolling shutter), s; 0 for a global shutter.
    region : Region, optional
        Part of the picture that is read; rows keep their delay.
    name : str
    doubts : tuple of str
        What is doubtful about the file.
    is_lossy : bool
        Whether the frames were compressed with loss.

    >>> clip = clip_of(np.zeros((50, 16, 32), np.uint8), 400.0)
    >>> sum(len(frames) for frames in clip.chunks())
    50
    """

    source: FrameSource
    frame_rate: float
    row_delay: float = 0.0
    region: Region | None = None
    name: str = ""
    doubts: tuple[Doubt, ...] = field(default=())
    is_lossy: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame_rate", positive("Clip.frame_rate", self.frame_rate, 1e7))
        delay = scalar("Clip.row_delay", self.row_delay)
        rows = self.source.shape[0]
        if not -1.0 <= delay * rows * self.frame_rate <= 1.0:
            fail("Clip.row_delay", f"{delay:g} s, {1e3 * delay * rows:g} ms for {rows} rows",
                 f"must not be longer than a frame, {1e3 / self.frame_rate:g} ms, over all rows", remedy="give seconds a row")
        if self.region is not None:
            self.region.within(self.source.shape)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns that are read."""
        return self.source.shape if self.region is None else (self.region.height, self.region.width)

    @property
    def white(self) -> int:
        """Largest grey level."""
        return int(2 ** self.source.bits - 1)

    def chunks(self, size: int | None = None) -> Iterator[Frames]:
        """Yield the frames in order, (n, rows, columns); as many at once as fit `CHUNK_BYTES` where no size is given."""
        rows, columns = self.shape
        bytes_per_pixel = 2 if self.source.bits > 8 else 1
        # Enough frames to keep the compiled loops busy, and no more than the byte limit of a chunk.
        frame_count = max(4, min(256,
                                 CHUNK_BYTES // (rows * columns * bytes_per_pixel))) if size is None else count("size", size)
        for frames in self.source.chunks(frame_count):
            if self.region is None:
                yield frames
            else:
                first_column, first_row = self.region.left, self.region.top
                yield np.ascontiguousarray(frames[:, first_row:first_row + rows, first_column:first_column + columns])

    def cropped_to(self, region: Region) -> Clip:
        """Return the clip of a part of the picture, in the coordinates of the whole one."""
        return replace(self, region=region)

    def doubted(self, *doubts: Doubt) -> Clip:
        """Return the clip with further doubts."""
        return replace(self, doubts=tuple(dict.fromkeys((*self.doubts, *doubts))))

    def __repr__(self) -> str:
        rows, columns = self.shape
        return f"Clip({self.name or type(self.source).__name__}, {columns} x {rows} pixels at {self.frame_rate:g} frames/s)"


@dataclass(frozen=True, eq=False)
class FrameArray:
    """Frames held in an array (n, rows, columns), also one that is mapped from a file."""

    frames: Frames
    bits: int = 8

    def __post_init__(self) -> None:
        if self.frames.ndim != 3 or self.frames.dtype not in (np.uint8, np.uint16):
            fail("frames", f"shape {self.frames.shape}, {self.frames.dtype}",
                 "must be (frames, rows, columns) of uint8 or uint16")
        rows, columns = self.frames.shape[1:]
        if not (MIN_FRAME_SIDE <= rows <= MAX_FRAME_SIDE and MIN_FRAME_SIDE <= columns <= MAX_FRAME_SIDE):
            fail("frames", f"{columns} x {rows} pixels", f"must be {MIN_FRAME_SIDE} to {MAX_FRAME_SIDE} wide and high")
        if len(self.frames) < 2:
            fail("frames", f"{len(self.frames)} frames", "must be two at least")

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a frame."""
        return self.frames.shape[1], self.frames.shape[2]

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order."""
        for start in range(0, len(self.frames), size):
            yield np.ascontiguousarray(self.frames[start:start + size])


def clip_of(frames: Frames, frame_rate: float, *, row_delay: float = 0.0, bits: int | None = None, name: str = "") -> Clip:
    """Return the clip of an array of frames (n, rows, columns), uint8 or uint16 (`bits`: 16 where left out).

    >>> clip = clip_of(np.zeros((50, 16, 32), np.uint8), 400.0)
    >>> clip.shape, clip.frame_rate
    ((16, 32), 400.0)
    """
    array = np.asarray(frames)
    if array.dtype not in (np.uint8, np.uint16):
        floats("frames", array[:1])
        fail("frames", f"{array.dtype}", "must be uint8 or uint16", remedy="scale and round them first")
    return Clip(FrameArray(array, bits or (8 if array.dtype == np.uint8 else 16)), frame_rate, row_delay, name=name)
