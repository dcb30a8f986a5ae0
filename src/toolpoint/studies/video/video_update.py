"""Update of a machine to videos: interfaces ranked, the moving ones freed, fitted to the modes of all planes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.machine.description import MachineDescription
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.measured.machine_update import MachineUpdate, agreements, update
from toolpoint.studies.measured.measured_update import MIN_UPDATED_MAC
from toolpoint.studies.text_table import text_table
from toolpoint.studies.video.interfaces import InterfaceRanking, rank_interfaces
from toolpoint.studies.video.response_error import UpdatedResponses
from toolpoint.studies.video.video_study import VideoStudy
from toolpoint.updating import Targets
from toolpoint.updating.fits.wide_search import name_undetermined, search_widely
from toolpoint.vibration import Frf

NO_RESPONSES = ("no measured responses: FRAC and the error over each joint parameter need them at points of the machine "
                "(--record)")
VALUES_HEADER = ("parameter", "value, SI", "95 % interval")
# Deviation of a shape's entries over its root mean square that rigid bodies in a picture have at least. Of ten films of random
# mills, bodies with few windows were off by up to 1.5 % of it; with half of this floor, stiffnesses that rest on the motion of
# such a body alone were off by up to twice their intervals.
MIN_SHAPE_DEVIATION = 0.01


@dataclass(frozen=True, eq=False)
class VideoUpdate(NotebookText):
    """Ranking of the interfaces and, where any of them moves, the machine updated to the videos.

    stated : doubts of what was stated of the views, where others explain the videos (`question_views`); responses : measured
    ones beside the machine's before and after, None where none were measured at its points; response_note : why.
    """

    ranking: InterfaceRanking
    update: MachineUpdate
    videos: tuple[VideoStudy, ...]
    stated: tuple[Doubt, ...] = ()
    responses: UpdatedResponses | None = None
    response_note: str = NO_RESPONSES

    @property
    def machine(self) -> Machine:
        """The updated machine."""
        return self.update.machine

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the fit, about modes that the updated machine lacks, and about the videos."""
        status = self.update.fit.status
        fitted = [] if status == "converged" else [Doubt("update", status.removeprefix("doubtful: "))]
        return tuple(dict.fromkeys((*self.stated, *fitted, *self._unlike_modes, *self.ranking.doubts)))

    @property
    def _unlike_modes(self) -> list[Doubt]:
        """Modes of the videos that the updated machine does not have."""
        return [Doubt(f"update, {video.scan.clip.name or 'video'}", f"MAC of the mode at {after.measured[r]:.4g} Hz is "
                      f"{after.mac[r]:.3f} with the updated machine's at {after.predicted[r]:.4g} Hz: it lacks this mode",
                      "another joint or another body moves, a view is wrong, or the fit ended in a wrong minimum",
                      figure=float(after.mac[r]))
                for video, after in zip(self.videos, self.update.all_after, strict=False)
                for r in np.flatnonzero(after.mac < MIN_UPDATED_MAC).tolist()]

    @property
    def machine_file(self) -> MachineDescription:
        """The updated machine to be written, marked with the doubts."""
        return replace(self.machine.description, doubts=self.doubts)

    def rows(self) -> list[list[str]]:
        """Return the fitted values with their 95 % intervals; values that rest on assumptions are marked."""
        fit, assumed = self.update.fit, name_undetermined(self.update.fit)
        result = []
        for name in fit.values:
            words = "left as it was"
            if name in fit.free:
                lower, upper = fit.interval(name)
                words = f"{lower:.3g} .. {upper:.3g} (assumed, the videos do not determine it)" if name in assumed else (
                    f"{lower:.5g} .. {upper:.5g}")
            result.append([name, f"{fit.values[name]:.{3 if name in assumed else 5}g}", words])
        return result

    def table(self) -> str:
        """Return ranking, fit and agreement as text."""
        marks = mark_notes(doubt for doubt in self.doubts if doubt not in self.ranking.doubts)
        return "\n".join([*marks, self.ranking.table(), "",
                          text_table("Updated to the videos", VALUES_HEADER, self.rows()), "", self.update.report(), "",
                          self.response_note if self.responses is None else self.responses.table()])

    def to_dict(self) -> dict[str, Any]:
        """Return ranking and fitted values (SI) as plain data."""
        fit = self.update.fit
        return {"doubts": list(self.doubts), "ranking": self.ranking.to_dict(), "values": fit.values,
                "intervals": {name: list(fit.interval(name)) for name in fit.free},
                "responses": None if self.responses is None else self.responses.to_dict(),
                "undetermined": list(name_undetermined(fit)), "status": fit.status,
                "mac": [agreement.mac.tolist() for agreement in self.update.all_after]}


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

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    ranking = rank_interfaces(machine, videos, pose)
    if not paths and not ranking.moving:
        fail("videos", "no interface moves beyond doubt", "must be one at least to update",
             remedy="strike harder, put texture on both bodies, or name the parameters")
    # Damping that a compressed clip cannot state is no target.
    damped = all(video.gives_damping for video in videos)
    names = list(paths) or [
        f"joints.{name}.{kind}.{way}" for name in ranking.moving for kind in (("stiffness",
                                                                               "damping") if damped else ("stiffness",))
        for way in getattr(machine.description.joints[name], kind)]
    targets = []
    for video in videos:
        places = seen_places(machine, video, pose)
        modes = video.modes_at(places)
        targets.append(Targets(modes, None, damping=damped and any(".damping." in n for n in names), shape=len(modes.dofs) > 2,
                               shape_covariance=video.shape_covariance_at(places, floor=MIN_SHAPE_DEVIATION)))
    if frf is not None:
        targets.append(Targets(None, frf))
    local = update(machine, names, targets=targets, pose=[pose] * len(targets), least_influence=influence)
    # A local fit may end in another minimum: the search starts from many others.
    fit = search_widely(local.problem, local.fit)
    best = replace(local, machine=machine.with_values(fit.values), fit=fit, all_after=agreements(local.problem, fit.x))
    return VideoUpdate(ranking, best, tuple(videos))


def seen_places(machine: Machine, video: VideoStudy, pose: Mapping[str, float] | None = None
                ) -> dict[str | int, tuple[str, FloatArray]]:
    """Return the machine's named points on bodies that the video shows: name to (body, place in m).

    Examples
    --------
    Runs in ``examples/films_of_a_machine_to_its_joints.py``.
    """
    place, body_names = place_machine(machine, pose), {body.name for body in video.bodies}
    places: dict[str | int, tuple[str, FloatArray]] = {
        name: (point.body, np.array(place.position(point)[0])) for name, point in machine.description.points.items()
        if point.body in body_names}
    if not places:
        fail("machine", f"no named point on a body seen in {video.scan.clip.name}", "must have one at least",
             remedy="write points on the bodies under 'points:'")
    return places
