"""Folders of images as clips: frames in the order of the numbers in their names, grey, 8 or 16 bits."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import MAX_FRAME_SIDE, MIN_FRAME_SIDE, Clip, Frames

IMAGE_SUFFIXES = (".png", ".tif", ".tiff", ".pgm", ".bmp", ".jpg", ".jpeg")
LOSSY_SUFFIXES = (".jpg", ".jpeg")
_DEEP_IMAGE_MODES = ("I;16", "I;16B", "I;16L", "I")  # modes of Pillow for grey images of more than 8 bits


@dataclass(frozen=True)
class ImageFrames:
    """The images of a folder, one frame each."""

    paths: tuple[Path, ...]
    shape: tuple[int, int]
    bits: int

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order."""
        for start in range(0, len(self.paths), size):
            chunk_paths = self.paths[start:start + size]
            frames = np.empty((len(chunk_paths), *self.shape), np.uint8 if self.bits == 8 else np.uint16)
            for k, path in enumerate(chunk_paths):
                image = read_image(path)
                if image.shape != self.shape or (image.dtype == np.uint8) != (self.bits == 8):
                    fail("path", f"{path.name} is {image.shape[1]} x {image.shape[0]} pixels of {image.dtype}",
                         f"must be like the first image, {self.shape[1]} x {self.shape[0]} of {self.bits} bits")
                frames[k] = image
            yield frames


def read(folder: Path, frame_rate: float) -> Clip:
    """Return the clip of the images in a folder."""
    paths = [path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file()]
    if len(paths) < 2:
        fail("path", f"{len(paths)} images in {folder}", f"must be two at least, of {' '.join(IMAGE_SUFFIXES)}")
    kinds = {path.suffix.lower() for path in paths}
    if len(kinds) > 1:
        fail("path", f"{folder.name} holds images of {', '.join(sorted(kinds))}", "must be of one kind",
             remedy="move the others away")
    paths.sort(key=_number)
    first_image = read_image(paths[0])
    doubts = _gaps(paths)
    if first_image.dtype == np.uint8 and kinds & set(LOSSY_SUFFIXES):
        doubts += (Doubt("JPEG images", "each frame was compressed with loss"),)
    return Clip(ImageFrames(tuple(paths), (first_image.shape[0], first_image.shape[1]),
                            8 if first_image.dtype == np.uint8 else 16), frame_rate,
                name=folder.name, doubts=doubts, is_lossy=bool(kinds & set(LOSSY_SUFFIXES)))


def read_image(path: Path) -> Frames:
    """Return an image as grey levels (rows, columns), uint8 or uint16; colours by their luminance."""
    from PIL import Image

    try:
        with Image.open(path) as image:
            columns, rows = image.size
            if not (MIN_FRAME_SIDE <= rows <= MAX_FRAME_SIDE and MIN_FRAME_SIDE <= columns <= MAX_FRAME_SIDE):
                fail("path", f"{path.name} is {columns} x {rows} pixels",
                     f"must be {MIN_FRAME_SIDE} to {MAX_FRAME_SIDE} wide and high")
            if image.mode in _DEEP_IMAGE_MODES:
                return np.asarray(image).clip(0, 65535).astype(np.uint16)
            return np.asarray(image.convert("L"))
    except ToolpointError:
        raise
    except Exception as error:  # Pillow raises what the damage brings: OSError, SyntaxError, ValueError, struct.error ...
        raise ToolpointError(f"path: {path.name} is no image that can be read ({str(error)[:200]})", argument="path") from None


def _number(path: Path) -> tuple[list[int], str]:
    return [int(part) for part in re.findall(r"\d+", path.stem)], path.stem


def _gaps(paths: list[Path]) -> tuple[Doubt, ...]:
    """Return a doubt where the numbers of the images have gaps: frames may have been dropped."""
    numbers = [_number(path)[0][-1:] for path in paths]
    if not all(numbers):
        return ()
    steps = np.diff([number[0] for number in numbers])
    # Cameras that keep every second or tenth image number them so: the usual step is no gap.
    usual_step = int(np.median(steps))
    gaps = np.flatnonzero(steps != usual_step)
    if gaps.size == 0:
        return ()
    return (Doubt("numbers of the images",
                  f"they jump at {gaps.size} places, first after {paths[int(gaps[0])].name}: frames may "
                  "be missing there"),)
