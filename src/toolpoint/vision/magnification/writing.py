"""Frames out: mp4 (extra `video`), GIF, WebP, or a folder of PNG images; the file appears whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import fail, positive
from toolpoint.vision.clip import Frames

ANIMATED_SUFFIXES = (".gif", ".webp")
MAX_ANIMATION_PIXELS = 60_000_000  # of all frames of a .gif or .webp together: about 50 MB on disk
X264_QUALITY = "14"  # constant rate factor of x264: no difference is seen, at a tenth of the size


def write_frames(frames: Iterable[Frames], path: str | os.PathLike[str], rate: float = 30.0) -> Path:
    """Write frames (rows, columns) or (rows, columns, 3), uint8 or uint16, to be played at `rate` frames/s; return the path.

    ``.mp4``: H.264 by PyAV; ``.gif``, ``.webp``: for pages; a path without ending: a folder of PNG images, 16 bits kept.
    Raises ToolpointError for an animation of more than `MAX_ANIMATION_PIXELS`.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = sorted(write_frames(np.zeros((2, 8, 8), np.uint8), Path(folder, "frames")).iterdir())
    >>> len(files)
    2
    """
    target = Path(path)
    kind = target.suffix.lower()
    positive("rate", rate, 1000)
    if kind == "":
        return _write_folder(frames, target)
    if kind not in (".mp4", *ANIMATED_SUFFIXES):
        fail("path", target.name, "must end in .mp4, .gif or .webp, or be a folder for PNG images")
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = target.with_name(f".{target.name}.part{kind}")
    try:
        if kind == ".mp4":
            _write_video(frames, draft, rate)
        else:
            _write_animation(frames, draft, rate)
        draft.replace(target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    return target


def encode_picture(picture: np.ndarray, kind: str = "png") -> bytes:
    """Return a picture (rows, columns) or (rows, columns, 3) as a PNG, JPEG or WebP file in memory."""
    import io

    buffer = io.BytesIO()
    _image(picture).save(buffer, kind.upper(), **({"quality": 85} if kind == "jpeg" else {"optimize": True}))
    return buffer.getvalue()


def encode_moving(frames: Iterable[Frames], rate: float = 25.0, *, quality: int = 60) -> bytes:
    """Return frames as an animated WebP file in memory, endless."""
    import io

    buffer = io.BytesIO()
    images = [_image(frame) for frame in frames]
    images[0].save(buffer, "WEBP", save_all=True, append_images=images[1:], duration=round(1000 / rate), loop=0,
                   quality=quality,
                   method=3)
    return buffer.getvalue()


def _image(frame: np.ndarray) -> Any:
    from PIL import Image

    return Image.fromarray(eight_bits(frame))


def eight_bits(frame: np.ndarray) -> np.ndarray:
    """Return a frame with 8 bits: 16-bit levels over their largest."""
    if frame.dtype == np.uint8:
        return np.ascontiguousarray(frame)
    largest_level = max(float(frame.max()), 1.0)
    return (frame * (255 / largest_level)).astype(np.uint8)


def _write_folder(frames: Iterable[Frames], folder: Path) -> Path:
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for number, frame in enumerate(frames):
        Image.fromarray(np.ascontiguousarray(frame)).save(folder / f"frame_{number:06d}.png")
    return folder


def _write_animation(frames: Iterable[Frames], path: Path, rate: float) -> None:
    images, pixel_count = [], 0
    for frame in frames:
        images.append(_image(frame))
        pixel_count += frame.shape[0] * frame.shape[1]
        if pixel_count > MAX_ANIMATION_PIXELS:
            fail("frames", f"over {len(images) - 1} frames of {frame.shape[1]} x {frame.shape[0]} pixels for {path.suffix}",
                 f"must be at most {MAX_ANIMATION_PIXELS / 1e6:.0f} million pixels, about 50 MB",
                 remedy="write .mp4, a tenth of the size, or a folder of images")
    if not images:
        fail("frames", "none", "must be one at least")
    images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / rate), loop=0)


def _write_video(frames: Iterable[Frames], path: Path, rate: float) -> None:
    from toolpoint.vision.reading.video import library

    av = library()
    with av.open(str(path), "w") as container:
        stream = None
        for frame in frames:
            picture = eight_bits(frame)
            rows, columns = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
            if stream is None:
                stream = container.add_stream("libx264" if "libx264" in av.codecs_available else "mpeg4", rate=round(rate))
                stream.width, stream.height, stream.pix_fmt = columns, rows, "yuv420p"
                stream.options = {"crf": X264_QUALITY}
            kind = "gray" if picture.ndim == 2 else "rgb24"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(picture[:rows, :columns]),
                                                                   format=kind)))
        if stream is None:
            fail("frames", "none", "must be one at least")
        container.mux(stream.encode())
