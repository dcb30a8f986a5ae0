"""A machine updated to videos: interfaces ranked, those that move freed, fitted to the modes of all planes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.modal_identification import real_modes
from toolpoint.studies.measured.machine_update import MachineUpdate, update
from toolpoint.studies.video.interfaces import InterfaceRanking, rank_interfaces
from toolpoint.studies.video.video_study import VideoStudy
from toolpoint.updating import Targets
from toolpoint.vibration import Frf


@dataclass(frozen=True, eq=False)
class VideoUpdate(NotebookText):
    """The ranking of the interfaces and, where any of them moves, the machine updated to the videos."""

    ranking: InterfaceRanking
    update: MachineUpdate
    videos: tuple[VideoStudy, ...]

    @property
    def machine(self) -> Machine:
        """The updated machine."""
        return self.update.machine

    def table(self) -> str:
        """Return ranking, fit and agreement as text."""
        return self.ranking.table() + "\n\n" + self.update.report()

    def to_dict(self) -> dict[str, Any]:
        """Return ranking and fitted values (SI) as plain data."""
        return {"ranking": self.ranking.to_dict(), "values": self.update.fit.values, "status": self.update.fit.status}


def update_from_videos(
    machine: Machine, videos: Sequence[VideoStudy], *, paths: Sequence[str] = (), frf: Frf | None = None,
    pose: Mapping[str, float] | None = None, influence: float = 0.02,
) -> VideoUpdate:
    """Return a machine updated to the modes of one or more videos.

    Parameters
    ----------
    machine : Machine
        With named points on the bodies that are seen.
    videos : sequence of VideoStudy
        Each with a view of known scale and the machine's bodies; mostly two orthogonal planes.
    paths : sequence of str
        Parameters; where left out, stiffness and damping of the interfaces that move.
    frf : Frf, optional
        Hammer responses at points of the machine, fitted beside the modes.
    pose : mapping, optional

    Raises
    ------
    ToolpointError
        Where no interface moves beyond doubt, or no point of the machine lies on a body that is seen.
    """
    ranking = rank_interfaces(machine, videos, pose)
    if not paths and not ranking.moving:
        fail("videos", "no interface moves beyond doubt", "must be one at least to update",
             remedy="strike harder, put texture on both bodies, or name the parameters")
    damped = all(video.gives_damping for video in videos)
    names = list(paths) or [
        f"joints.{name}.{kind}.{way}" for name in ranking.moving for kind in (("stiffness",
                                                                               "damping") if damped else ("stiffness",))
        for way in getattr(machine.description.joints[name], kind)]
    targets = []
    for video in videos:
        modes = real_modes(video.modes_at(seen_places(machine, video, pose)))
        targets.append(Targets(modes, None, damping=damped and any(".damping." in n for n in names), mac=len(modes.dofs) > 2))
    if frf is not None:
        targets.append(Targets(None, frf))
    return VideoUpdate(ranking, update(machine, names, targets=targets, pose=[pose] * len(targets), least_influence=influence),
                       tuple(videos))


def seen_places(machine: Machine, video: VideoStudy, pose: Mapping[str, float] | None = None
                ) -> dict[str | int, tuple[str, FloatArray]]:
    """Return the machine's named points on bodies that the video shows: name to (body, place in m)."""
    place, shown = place_machine(machine, pose), {body.name for body in video.bodies}
    seen: dict[str | int, tuple[str, FloatArray]] = {
        name: (point.body, np.array(place.position(point)[0])) for name, point in machine.description.points.items()
        if point.body in shown}
    if not seen:
        fail("machine", f"no named point on a body seen in {video.scan.clip.name}", "must have one at least",
             remedy="write points on the bodies under 'points:'")
    return seen
