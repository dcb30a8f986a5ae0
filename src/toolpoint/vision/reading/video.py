"""Videos by PyAV (extra `video`), frame after frame: luminance, time stamps, rotation, codec, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import MAX_FRAME_SIDE, MIN_FRAME_SIDE, Clip, Frames
from toolpoint.vision.reading.scratch import Scratch

LOSSLESS_CODECS = ("ffv1", "rawvideo", "huffyuv", "ffvhuff", "png", "utvideo", "qtrle", "v210")
# Frames/s up to which players show frames: a stated rate equal to the played one is then mostly the wrong one.
MAX_PLAYBACK_RATE = 61.0
TIME_STAMP_TOLERANCE = 0.02  # of the usual step: time stamps that differ by less are even
_RATE_TAGS = ("com.android.capture.fps", "com.apple.quicktime.capture.fps")


@dataclass(frozen=True)
class Header:
    """Properties of a video that its header and first frame state."""

    shape: tuple[int, int]
    bits: int
    codec: str
    played_rate: float
    stated_rate: float | None
    interlaced: bool
    turns: int


@dataclass(frozen=True, eq=False)
class VideoFrames:
    """Frames of a video file, decoded in order; kept on scratch after the first whole reading.

    `times`: time stamps of the frames in s of playback, filled by the first whole reading.
    """

    path: Path
    header: Header
    scratch: Scratch
    times: list[float] = field(default_factory=list, repr=False)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns as the picture is meant to be seen."""
        rows, columns = self.header.shape
        return (columns, rows) if self.header.turns % 2 else (rows, columns)

    @property
    def bits(self) -> int:
        """Bits of a pixel."""
        return self.header.bits

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order."""
        if self.scratch.is_whole:
            return self.scratch.chunks(size)
        return self.scratch.keep(self._gathered(size))

    def _gathered(self, size: int) -> Iterator[Frames]:
        chunk: list[Frames] = []
        self.times.clear()
        for frame in self._decoded():
            chunk.append(frame)
            if len(chunk) == size:
                yield np.stack(chunk)
                chunk = []
        if chunk:
            yield np.stack(chunk)

    def _decoded(self) -> Iterator[Frames]:
        av = library()
        try:
            with av.open(str(self.path)) as container:
                stream = container.streams.video[0]
                stream.thread_type = "NONE"
                for frame in container.decode(stream):
                    if (frame.height, frame.width) != self.header.shape:
                        fail("path", f"{self.path.name}: frame {len(self.times)} is {frame.width} x {frame.height} pixels",
                             f"must be like the first, {self.header.shape[1]} x {self.header.shape[0]}",
                             remedy="cut the video there")
                    self.times.append(float("nan") if frame.time is None else float(frame.time))
                    yield np.ascontiguousarray(np.rot90(luminance(frame, self.header.bits), self.header.turns))
        except ToolpointError:
            raise
        except Exception as error:  # the library raises an error of its own for every fault of a file
            raise ToolpointError(f"path: {self.path.name} cannot be decoded after frame {len(self.times)} "
                                 f"({str(error)[:200]}); "
                                 "it is damaged or cut: copy it again, or cut it before that frame", argument="path") from None


def read(path: Path, frame_rate: float, scratch: int | None = None) -> Clip:
    """Return the clip of a video file; its header is read now, its frames when they are needed."""
    header = read_header(path)
    return Clip(VideoFrames(path, header, Scratch(scratch)), frame_rate, name=path.name,
                doubts=tuple(_header_doubts(header, frame_rate)), is_lossy=header.codec not in LOSSLESS_CODECS)


def is_turned(clip: Clip) -> bool:
    """Return whether the metadata of a clip's video turn its picture."""
    return isinstance(clip.source, VideoFrames) and clip.source.header.turns != 0


def read_header(path: Path) -> Header:
    """Return what a video says of itself; refuse a file without a video that can be decoded."""
    av = library()
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                fail("path", f"{path.name} has no video stream", "must have one")
            stream = container.streams.video[0]
            frame = next(container.decode(stream), None)
            if frame is None:
                fail("path", f"{path.name} has no frame that can be decoded ({stream.codec_context.name})", "must have frames")
            context = stream.codec_context
            tags = {**container.metadata, **stream.metadata}
            rate = next((float(tags[tag]) for tag in _RATE_TAGS if tag in tags), None)
            header = Header((frame.height, frame.width), _bits(frame), context.name, float(stream.average_rate or 0), rate,
                            bool(frame.interlaced_frame), _turns(frame))
    except ToolpointError:
        raise
    except Exception as error:  # as above
        raise ToolpointError(f"path: {path.name} is no video that can be read ({type(error).__name__}: {str(error)[:200]}); "
                             "convert it, for example to FFV1 in .mkv or to a folder of PNG images", argument="path") from None
    rows, columns = header.shape
    if not (MIN_FRAME_SIDE <= rows <= MAX_FRAME_SIDE and MIN_FRAME_SIDE <= columns <= MAX_FRAME_SIDE):
        fail("path", f"{path.name} is {columns} x {rows} pixels", f"must be {MIN_FRAME_SIDE} to {MAX_FRAME_SIDE} wide and high")
    return header


def luminance(frame: Any, bits: int) -> Frames:
    """Return the luminance plane of a decoded frame, (rows, columns)."""
    name = frame.format.name
    if name.startswith(("yuv", "gray", "nv")) and "be" not in name:
        plane = frame.planes[0]
        kind = np.dtype(np.uint8 if bits == 8 else "<u2")
        lines: Frames = np.frombuffer(plane, kind).reshape(-1, plane.line_size // kind.itemsize)  # type: ignore[assignment]
        return lines[:frame.height, :frame.width]
    grey: Frames = frame.to_ndarray(format="gray" if bits == 8 else "gray16le")
    return grey


def stamp_doubts(times: FloatArray, header: Header) -> list[Doubt]:
    """Return what uneven time stamps say: a variable rate, dropped or repeated frames."""
    steps = np.diff(times[np.isfinite(times)])
    if steps.size < 4:
        return []
    usual_step = float(np.median(steps))
    if usual_step <= 0 or (steps <= 0).any():
        return [Doubt("time stamps", "they do not increase: the order of frames cannot be trusted")]
    # Containers round time stamps to 1 ms or so: a step may differ by 0.6 ms at both of its ends.
    uneven = np.flatnonzero(np.abs(steps / usual_step - 1) > max(TIME_STAMP_TOLERANCE, 0.6e-3 / usual_step * 2))
    if uneven.size == 0:
        return []
    step_ratio = np.round(steps[uneven] / usual_step)
    if uneven.size < 0.1 * steps.size and (np.abs(steps[uneven] / usual_step - step_ratio)
                                           < 0.1).all() and (step_ratio > 1).all():
        missing_count = int((step_ratio - 1).sum())
        return [Doubt("time stamps",
                      f"{missing_count} frames are missing by the time stamps, first after frame {int(uneven[0])}: all "
                      "later times are wrong by as many frames", "cut the clip there", figure=missing_count / times.size)]
    return [Doubt("variable frame rate", f"steps between frames are {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms, and "
                  "frequencies and damping rest on equal steps", "record with a fixed rate")]


def _header_doubts(header: Header, frame_rate: float) -> list[Doubt]:
    doubts: list[Doubt] = []
    if header.codec not in LOSSLESS_CODECS:
        doubts.append(Doubt("video", f"compressed with loss ({header.codec}): small motion is smoothed, damping comes out too "
                            "large, and lines appear that are no modes; intervals are widened by what the noise has lost, by "
                            "experience with x264", "record without loss"))
    if header.stated_rate and abs(header.stated_rate / frame_rate - 1) > 0.02:
        doubts.append(Doubt("frame rate", f"the camera wrote a rate of {header.stated_rate:g} frames/s into the file, "
                            f"{frame_rate:g} was stated", "all frequencies scale with it"))
    # A rate above every player's cannot be the rate of playback by mistake.
    elif frame_rate <= MAX_PLAYBACK_RATE and abs(header.played_rate / frame_rate - 1) < 0.02:
        doubts.append(Doubt("frame rate", f"the stated rate, {frame_rate:g} frames/s, is that at which the file is played: a "
                            "high-speed video is filmed faster, and all frequencies scale with the rate",
                            "state that of the camera"))
    if header.interlaced:
        doubts.append(Doubt("interlaced video", "odd and even rows were filmed at different times, so rates and shapes are "
                            "doubtful", "record whole frames"))
    return doubts


def _bits(frame: Any) -> int:
    components = frame.format.components
    return int(min(16, max(8, components[0].bits))) if components else 8


def _turns(frame: Any) -> int:
    """Return by how many quarter turns, counter-clockwise, the picture is to be turned to stand upright."""
    angle = round(float(getattr(frame, "rotation", 0) or 0))
    if angle % 90:
        fail("path", f"a rotation of {angle} degrees", "must be a multiple of 90")
    return (angle // 90) % 4


def library() -> Any:
    """Return PyAV; say how to install it where it is missing."""
    try:
        import av
    except ImportError:
        raise ToolpointError("video: reading video files needs PyAV; install it with  pip install 'toolpoint[video]'  or "
                             "convert the video to a folder of PNG images") from None
    av.logging.set_level(av.logging.PANIC)
    return av
