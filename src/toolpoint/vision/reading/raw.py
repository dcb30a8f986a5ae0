"""Raw high-speed frames: `.npy` arrays and plain binary files of a stated shape, read in chunks, never as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError, count, fail
from toolpoint.vision.clip import MAX_FRAME_SIDE, MIN_FRAME_SIDE, Clip, Frames

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


@dataclass(frozen=True)
class FrameFile:
    """Frames that lie one after the other in a file, from `offset` on."""

    path: Path
    offset: int
    frames: int
    shape: tuple[int, int]
    bits: int
    big_endian: bool = False

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order."""
        bytes_per_pixel = 2 if self.bits > 8 else 1
        pixel_type = np.dtype((">u2" if self.big_endian else "<u2") if bytes_per_pixel == 2 else "u1")
        rows, columns = self.shape
        with self.path.open("rb") as file:
            file.seek(self.offset)
            for start in range(0, self.frames, size):
                frame_count = min(size, self.frames - start)
                data = np.fromfile(file, pixel_type, frame_count * rows * columns)
                if data.size != frame_count * rows * columns:
                    fail("path", f"{self.path.name} ends in frame {start + data.size // (rows * columns)} of {self.frames}",
                         "must hold whole frames", remedy="it was changed while it was read, or cut")
                yield data.reshape(frame_count, rows, columns).astype(pixel_type.newbyteorder("="), copy=False)


def read_array(path: Path, frame_rate: float, bits: int | None = None) -> Clip:
    """Return the clip of a ``.npy`` file of (frames, rows, columns), unsigned integers of 8 or 16 bits."""
    try:
        with path.open("rb") as file:
            version = np.lib.format.read_magic(file)
            if version not in _HEADERS:
                fail("path", f"{path.name} is of version {version}", "must be 1.0 or 2.0",
                     remedy="save it anew with numpy.save")
            shape, by_columns, pixel_type = _HEADERS[version](file)
            offset = file.tell()
    except ToolpointError:
        raise
    except Exception as error:  # numpy raises what the damage brings: ValueError, SyntaxError, struct.error ...
        raise ToolpointError(f"path: {path.name} is no .npy file that can be read ({str(error)[:200]})",
                             argument="path") from None
    if len(shape) != 3 or pixel_type.kind != "u" or pixel_type.itemsize > 2 or by_columns:
        fail("path", f"{path.name} holds {pixel_type} of shape {shape}" + (", by columns" if by_columns else ""),
             "must be (frames, rows, columns) of uint8 or uint16, by rows", remedy="scale, round and save it anew")
    return _clip(path, offset, tuple(int(n) for n in shape), frame_rate=frame_rate, bits=bits or 8 * pixel_type.itemsize,
                 big_endian=pixel_type.str[0] == ">")


def read_binary(path: Path, frame_rate: float, shape: tuple[int, int] | None, *, bits: int | None = None) -> Clip:
    """Return the clip of plain frames (rows by columns, little-endian) of a stated shape."""
    if shape is None:
        fail("shape", "not given", f"{path.name} does not say it", remedy="state rows and columns")
    rows, columns = (count("shape", n, MIN_FRAME_SIDE) for n in shape)
    bits = bits or 8
    bytes_per_pixel = 2 if bits > 8 else 1
    file_bytes, frame_bytes = path.stat().st_size, rows * columns * bytes_per_pixel
    if file_bytes % frame_bytes or file_bytes < 2 * frame_bytes:
        fail("shape", f"{columns} x {rows} pixels of {bytes_per_pixel} bytes are {frame_bytes} bytes, the file has "
                      f"{file_bytes}",
             f"must be a whole number of frames, two at least ({file_bytes / frame_bytes:.3f} here)",
             remedy="correct the shape or the bits")
    return _clip(path, 0, (file_bytes // frame_bytes, rows, columns), frame_rate=frame_rate, bits=bits)


def _clip(path: Path, offset: int, shape: tuple[int, ...], *, frame_rate: float, bits: int, big_endian: bool = False) -> Clip:
    frames, rows, columns = shape
    if not 8 <= bits <= 16:
        fail("bits", str(bits), "must be 8 to 16")
    if frames < 2 or not (MIN_FRAME_SIDE <= rows <= MAX_FRAME_SIDE and MIN_FRAME_SIDE <= columns <= MAX_FRAME_SIDE):
        fail("path", f"{path.name} holds {frames} frames of {columns} x {rows} pixels",
             f"must be two frames at least, {MIN_FRAME_SIDE} to {MAX_FRAME_SIDE} pixels wide and high")
    available_bytes, required_bytes = path.stat().st_size - offset, frames * rows * columns * (2 if bits > 8 else 1)
    if available_bytes < required_bytes:
        fail("path", f"{path.name} has {available_bytes} bytes of frames", f"its header says {required_bytes}",
             remedy="it was cut: copy it again")
    return Clip(FrameFile(path, offset, frames, (rows, columns), bits, big_endian), frame_rate, name=path.name)
