"""Study of one or more videos of a machine: modes of each, the machine's interfaces ranked or the machine updated."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from toolpoint._check import ToolpointWarning, fail
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.description import MachineDescription
from toolpoint.studies.video.interfaces import InterfaceRanking, rank_interfaces
from toolpoint.studies.video.record_poles import poles_of
from toolpoint.studies.video.response_error import compare_updated, points_missing
from toolpoint.studies.video.stated_views import question_views
from toolpoint.studies.video.video_study import VideoStudy, study_video
from toolpoint.studies.video.video_update import VideoUpdate, seen_places, update_from_videos
from toolpoint.vibration import Frf, Modes, Record
from toolpoint.vibration.geometry import Geometry
from toolpoint.vision.clip import Clip, Frames
from toolpoint.vision.displacement.survey import Progress
from toolpoint.vision.magnification.phase_based import PhaseMagnification
from toolpoint.vision.magnification.reached import gain_doubt
from toolpoint.vision.magnification.warp import ShapeWarp
from toolpoint.vision.view import View

UNPLACED_NOTE = "places of the points are not in the file of modes: the video has no scale (millimetres a pixel, `scale`)"


@dataclass(frozen=True, eq=False)
class FilmedMachine(NotebookText):
    """Results of videos of a machine: the study of each, and the ranking or the update of the machine, None without one."""

    videos: tuple[VideoStudy, ...]
    machine: Machine | None = None
    answer: VideoUpdate | InterfaceRanking | None = None

    @property
    def notes(self) -> list[str]:
        """Processing of the videos, in words."""
        return [note for study in self.videos for note in study.notes]

    @property
    def modes(self) -> Modes:
        """The modes of the first video: at the machine's points that it shows, without a machine at its windows."""
        first = self.videos[0]
        return first.modes if self.machine is None else first.modes_at(seen_places(self.machine, first))

    @property
    def places(self) -> Geometry | None:
        """Places of the points of `modes`, m: the machine's, else the windows in the picture's plane; None without a scale."""
        first = self.videos[0]
        if self.machine is None:
            return first.places
        return Geometry({name: place for name, (_, place) in seen_places(self.machine, first).items()}, [])

    @property
    def nouns(self) -> dict[str, Modes | Geometry]:
        """Modes and, where they are known, the places of their points: the contents of a file of modes.

        Modes without places say so in a note, which the next command repeats.
        """
        places = self.places
        return {"modes": self.modes.noted(UNPLACED_NOTE)} if places is None else {"modes": self.modes, "places": places}

    @property
    def updated(self) -> Machine:
        """The machine updated to the videos."""
        if not isinstance(self.answer, VideoUpdate):
            fail("updated", "the machine was not updated", "study the videos with update=True")
        return self.answer.machine

    @property
    def updated_file(self) -> MachineDescription:
        """Description of the updated machine, marked with its doubts."""
        if not isinstance(self.answer, VideoUpdate):
            fail("updated_file", "the machine was not updated", "study the videos with update=True")
        return self.answer.machine_file

    def table(self) -> str:
        """Return the modes of every video, and the answer for the machine, as text."""
        return "\n".join([*(study.table() for study in self.videos), *([] if self.answer is None else [self.answer.table()])])

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain data."""
        return {"videos": [study.to_dict() for study in self.videos],
                "machine": None if self.answer is None else self.answer.to_dict()}


def study_videos(
    clips: Iterable[Clip], machine: Machine | None = None, *, views: Sequence[View] = (), update: bool = False,
    record: Frf | Record | Modes | None = None, band: tuple[float, float] | None = None, progress: Progress | None = None,
    **how: Any,
) -> FilmedMachine:
    """Return the results of one or more videos, two of orthogonal planes mostly.

    Parameters
    ----------
    clips : iterable of Clip
        Each is read when its turn comes.
    machine : Machine, optional
        Its interfaces are ranked; with `update` it is updated to the videos.
    views : sequence of View
        Of each video; the last one holds for all further videos.
    record : Frf, Record or Modes, optional
        From beside the camera: gives the poles of all videos.
    band : (low, high), optional
        Hz.
    how
        What `study_video` takes besides.

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    poles = None if record is None else poles_of(record, band)
    view_list = views or (None,)

    def report(name: str, finished: int, total: int) -> None:
        if progress is not None:
            progress(name, finished, max(total, finished))  # a clip may say too few frames

    def studied(clip: Clip, view: View | None) -> VideoStudy:
        return study_video(clip, view=view, machine=machine, band=band, poles=poles, progress=report, **how)

    videos = tuple(studied(clip, view_list[min(number, len(view_list) - 1)]) for number, clip in enumerate(clips))
    if machine is None:
        return FilmedMachine(videos)
    if not update:
        return FilmedMachine(videos, machine, rank_interfaces(machine, videos))
    answer = update_from_videos(machine, videos)

    def repeat(others: Sequence[View]) -> VideoUpdate:
        return update_from_videos(machine, [studied(video.scan.clip, view) for video, view in zip(videos, others, strict=True)])

    return FilmedMachine(videos, machine, _with_responses(replace(answer, stated=question_views(answer, repeat)), machine,
                                                          record, band))


def _with_responses(answer: VideoUpdate, machine: Machine, record: Frf | Record | Modes | None, band: tuple[float, float] | None
                    ) -> VideoUpdate:
    """Return the update with measured responses beside the machine's, where they were measured at its points."""
    if not isinstance(record, Frf):
        return answer
    if absent_points := points_missing(machine, record):
        return replace(answer, response_note=f"FRAC: {', '.join(absent_points[:4])} of the measured responses are no points of "
                                             "the machine; name them in its file under 'points:'")
    return replace(answer, responses=compare_updated(machine, answer.machine, record, band=band))


def shape_warp(video: VideoStudy) -> ShapeWarp:
    """Return the magnification by the shapes of a study."""
    return ShapeWarp(video.scan, video.poles.poles, video.bodies, video.picture, video.decay.first)


def magnify_motion(video: VideoStudy, factor: float = 20.0, *, mode: int = 1, band: tuple[float, float] | None = None,
                   attenuation: float = 0.5) -> Iterator[Frames]:
    """Return the frames of a video with the motion of a mode magnified by its shape, or that in a band by phase.

    mode : 1 is the first; band : Hz; attenuation : of noise, 0 .. 1. Warns where drawn frames miss the factor by more than a
    tenth.

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    if band is not None:
        return PhaseMagnification(*band, factor, attenuation).frames(video.scan)
    if not 1 <= mode <= video.poles.count:
        fail("`mode`", str(mode), f"the video has {video.poles.count} modes")
    warp = shape_warp(video)
    if factor > 0 and (doubt := gain_doubt(warp, mode - 1, factor)):
        warnings.warn(str(doubt), ToolpointWarning, stacklevel=2)
    return warp.frames(mode - 1, factor, attenuation=attenuation)
