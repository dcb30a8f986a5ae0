"""Reading of clips by the kind of their path; the true frame rate is always an argument."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from toolpoint._check import fail
from toolpoint.vision.clip import Clip, Region
from toolpoint.vision.reading import images, raw

VIDEO_SUFFIXES = (".mp4", ".mov", ".avi", ".mkv", ".m4v")
ARRAY_SUFFIXES = (".npy",)
RAW_SUFFIXES = (".raw", ".bin")


def read(
    path: str | os.PathLike[str], frame_rate: float, *, shape: tuple[int, int] | None = None, bits: int | None = None,
    row_delay: float = 0.0, region: Region | None = None, scratch: int | None = None,
) -> Clip:
    """Return the clip of a video, a folder of images, or raw frames.

    Parameters
    ----------
    path : path
        ``.mp4 .mov .avi .mkv .m4v`` (extra ``video``), a folder of images (in the order of their numbers), ``.npy`` of
        (frames, rows, columns), or ``.raw .bin`` of a stated shape.
    frame_rate : float
        True frames per second of the camera, Hz. A high-speed video is mostly played slower: its file says the other rate.
    shape : (rows, columns), optional
        Of plain binary frames only.
    bits : int, optional
        Of plain binary frames or a 16-bit array whose camera has fewer; 8 or 16 where left out.
    row_delay : float
        Time between neighbouring rows of a rolling shutter, s.
    region : Region, optional
        Part of the picture to read.
    scratch : int, optional
        Bytes that decoded frames of a video may take on disk, so that it is decoded once; 4 GB where left out.

    Raises
    ------
    ToolpointError
        For a missing or damaged file, an unknown kind, wrong shapes, frames of unequal size, a video without luminance.

    >>> import tempfile
    >>> import numpy as np
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "clip.npy"), np.zeros((20, 16, 32), np.uint8))
    ...     read(Path(folder, "clip.npy"), 500.0).shape
    (16, 32)
    """
    place = Path(path)
    kind = _kind(place)
    if shape is not None and kind not in RAW_SUFFIXES:
        fail("shape", f"{shape} for {place.name}", "is for plain binary frames only", remedy="leave it out")
    if kind == "folder":
        clip = images.read(place, frame_rate)
    elif kind in ARRAY_SUFFIXES:
        clip = raw.read_array(place, frame_rate, bits)
    elif kind in RAW_SUFFIXES:
        clip = raw.read_binary(place, frame_rate, shape, bits=bits)
    else:
        from toolpoint.vision.reading import video

        clip = video.read(place, frame_rate, scratch)
        if row_delay and video.is_turned(clip):
            fail("row_delay", f"{row_delay:g} s for {place.name}, which is turned by its metadata",
                 "rows of the sensor are not rows of the picture",
                 remedy="remove the rotation from the file, or leave the delay out")
    clip = Clip(clip.source, clip.frame_rate, row_delay, None, place.name, clip.doubts, clip.is_lossy)
    return clip if region is None else clip.cropped_to(region.within(clip.shape))


def _kind(place: Path) -> str:
    try:
        mode = place.stat().st_mode
    except OSError as error:
        fail("path", str(place), f"cannot be read ({error.strerror})", remedy="check the name and the folder")
    if stat.S_ISDIR(mode):
        return "folder"
    if not stat.S_ISREG(mode):
        fail("path", str(place), "must be a file or a folder")
    kind = place.suffix.lower()
    if kind not in (*VIDEO_SUFFIXES, *ARRAY_SUFFIXES, *RAW_SUFFIXES):
        fail("path", place.name,
             f"must end in one of {' '.join((*VIDEO_SUFFIXES, *ARRAY_SUFFIXES, *RAW_SUFFIXES))}, or be a folder of images",
             remedy="convert the video, for example to a folder of PNG images")
    return kind
