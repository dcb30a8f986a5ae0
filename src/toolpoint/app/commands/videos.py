"""The command video: modes from one or more videos, interfaces of a machine ranked and updated by them, motion magnified."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from toolpoint import io, pages, studies, vision
from toolpoint.app.declare import Help, Reading, command
from toolpoint.app.frame import Frame
from toolpoint.app.options import Band, Files
from toolpoint.app.values import NewFile, SourceFile, Span
from toolpoint.io.quantities.written import read_numbers, read_picture_shape


def _body(text: str) -> tuple[str, Any]:
    """Return name and region of a body."""
    name, _, box = text.partition("=")
    return name, vision.Region.parse(box)


Shape = Annotated[tuple[int, int], Reading(read_picture_shape, "ROWSxCOLUMNS, for example 720x1280")]
Region = Annotated[Any, Reading(lambda text: vision.Region.parse(text))]
Body = Annotated[tuple[str, Any], Reading(_body)]
Pixel = Annotated[tuple[float, float], Reading(lambda text: read_numbers(text, 2), "COLUMN,ROW, for example 640,700")]


@dataclass(frozen=True)
class Filming:
    """Settings of the camera, and the part of the videos that is used."""

    fps: Annotated[float, Help("True frames per second of the camera (not of the player).")]
    shape: Annotated[Shape | None, Help("Shape of plain binary frames (.raw, .bin).", metavar="ROWSxCOLUMNS")] = None
    bits: Annotated[int | None, Help("Bits of a pixel of raw frames.", minimum=8, maximum=16)] = None
    row_delay: Annotated[float, Help("Rolling shutter: microseconds between neighbouring rows.", scale=1e-6)] = 0.0
    region: Annotated[Region | None, Help("Part of the picture to use.", metavar="LEFT,TOP,WIDTH,HEIGHT")] = None
    background: Annotated[tuple[Region, ...], Help("Part that stands still and has texture: camera shake is taken off by it; "
                                                   "several times.", metavar="LEFT,TOP,WIDTH,HEIGHT")] = ()
    bodies: Annotated[tuple[Body, ...], Help("Where a body is seen, from back to front; several times. With --machine found by "
                                             "itself.", name="--body", metavar="NAME=LEFT,TOP,WIDTH,HEIGHT")] = ()
    method: Annotated[Literal["templates", "lucas-kanade", "phase"], Help("Of displacement.")] = "templates"
    points: Annotated[int, Help("Points on edges and corners.", minimum=10, maximum=5000)] = 300
    views: Annotated[tuple[Literal["xz", "yz", "xy"], ...], Help("Plane of each video; z (or y) is up.", name="--view")] = ()
    scale: Annotated[float | None, Help("Millimetres a pixel.", scale=1e-3)] = None
    origins: Annotated[tuple[Pixel, ...], Help("Where each video shows the machine's origin.", name="--origin",
                                               metavar="COLUMN,ROW")] = ()
    band: Band = None
    start: Annotated[float | None, Help("Start of the free decay, s; found where left out.")] = None
    stop: Annotated[float | None, Help("End of the free decay, s.")] = None
    record: Annotated[SourceFile | None, Help("Hammer or accelerometer record, FRFs or modes from beside the video: gives the "
                                              "poles.")] = None

    def view(self, number: int) -> vision.View:
        """Return the view of a video; the last one given holds for all further videos."""
        planes, origins = self.views or ("xz",), self.origins or ((0.0, 0.0),)
        return vision.View.of_plane(planes[min(number, len(planes) - 1)], self.scale, origins[min(number, len(origins) - 1)])

    def clips(self, files: Sequence[Path]) -> Iterator[vision.Clip]:
        """Read the videos one by one."""
        for path in files:
            yield vision.read_clip(path, self.fps, shape=self.shape, bits=self.bits, row_delay=self.row_delay,
                                   region=self.region)


@dataclass(frozen=True)
class Magnification:
    """A clip in which the motion of a mode, or of a band, is magnified."""

    file: Annotated[NewFile | None, Help("Write a magnified clip here (.mp4, .gif, .webp, or a folder of images).",
                                         name="--magnify")] = None
    which: Annotated[int, Help("Mode to magnify.", name="--mode", minimum=1)] = 1
    factor: Annotated[float, Help("Of magnification.")] = 20.0
    attenuation: Annotated[float, Help("Of noise in the magnified clip.", minimum=0, maximum=1)] = 0.5
    magnify_band: Annotated[Span | None, Help("Magnify this band (Hz) by phase instead of a mode by its shape; patents are on "
                                              "record for that method.", metavar="LOW:HIGH")] = None


@command(replace=True)
def video(run: Frame, files: Files, filming: Filming, *,
          machine: Annotated[SourceFile | None, Help("Machine file: interfaces are ranked by the videos.")] = None,
          written: Annotated[NewFile | None, Help("Update the machine to the videos and write it here.", name="--update",
                                                  needs="--machine, the machine to be updated")] = None,
          magnification: Magnification,
          modes: Annotated[NewFile | None, Help("Save the modes of the first video with the places of their points (HDF5): at "
                                                "the machine's points where there is one, else at the windows.",
                                                name="-m --modes")] = None) -> None:
    """Mode shapes, frequencies and damping from videos of a machine that rings after a blow.

    Videos (.mp4 .mov .avi .mkv, extra 'video'), folders of images, .npy or raw frames. Two videos of orthogonal planes and a
    machine file rank the machine's interfaces and update it.
    """
    built = None if machine is None else io.read_machine(machine)
    record = None if filming.record is None else io.read_measured([filming.record])
    clips = filming.clips(files)
    result = studies.study_videos(
        clips, built, views=list(map(filming.view, range(len(files)))), update=written is not None, record=record,
        band=filming.band, progress=run.progress_of_parts(), method=filming.method, points=filming.points,
        background=filming.background, bodies=dict(filming.bodies), start=filming.start, stop=filming.stop)
    if written is not None:
        run.write("Machine file", written, io.write_machine, result.updated_file)
    run.save(pages.video_page, result.videos, result.answer, warnings=run.warnings)
    if magnification.file is not None:
        run.write("Magnified clip", magnification.file, vision.write_frames, studies.magnify_motion(
            result.videos[0], magnification.factor, mode=magnification.which, band=magnification.magnify_band,
            attenuation=magnification.attenuation))
    nouns = {} if modes is None else result.nouns
    run.write("Modes", modes, io.write_nouns, nouns)
    run.show(result, [*result.notes, *(note for kept in nouns.values() for note in getattr(kept, "notes", ()))])
