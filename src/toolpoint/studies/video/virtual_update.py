"""Machine updated to virtual videos of a machine of known truth: two planes filmed, modes, interfaces, update, FRAC."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine, assemble
from toolpoint.studies.text_table import text_table
from toolpoint.studies.video.response_error import ResponseError, sweep_response_error
from toolpoint.studies.video.video_study import VideoStudy, study_video
from toolpoint.studies.video.video_update import VALUES_HEADER, VideoUpdate, update_from_videos
from toolpoint.studies.video.virtual_video import VirtualVideo, film_machine
from toolpoint.vibration import Dof, Frf, correlation, frequency_response
from toolpoint.vision.clip import Clip
from toolpoint.vision.modes.bodies import RIGID_ORDERS
from toolpoint.vision.rendering.scene import Camera
from toolpoint.vision.view import View

FILMED_BAND = (5.0, 100.0)
FRAC_LINES = 476
# A picture of 1.08 m by 0.96 m, as wide as the source's, with the floor near its lower edge.
PICTURE_SHAPE, PICTURE_SCALE, PICTURE_ORIGIN = (432, 384), 2.5e-3, (192.0, 400.0)
# What the filmed mill of the package has in place of its file's values: chosen, so that each plane has a mode near 13 Hz and
# one near 64 Hz, as published.
FILMED_TRUTH: Mapping[str, float] = {
    "joints.floor_base.stiffness.rx": 1.12e6, "joints.floor_base.stiffness.ry": 1.13e6,
    "joints.column_housing.stiffness.rx": 8.9e5, "joints.column_housing.stiffness.ry": 1.72e5,
    "joints.floor_base.damping.rx": 560.0, "joints.floor_base.damping.ry": 560.0,
    "joints.column_housing.damping.rx": 66.0, "joints.column_housing.damping.ry": 13.0}


@dataclass(frozen=True, eq=False)
class VirtualUpdate(NotebookText):
    """The videos, the update, and responses at the struck point: of the truth, before and after, with FRAC of each plane.

    error : of the updated machine's responses beside the truth's, over each joint parameter; true_values : of the filmed
    machine, by path, SI.
    """

    videos: tuple[VideoStudy, ...]
    update: VideoUpdate
    truth: tuple[Frf, ...]
    before_update: tuple[Frf, ...]
    after_update: tuple[Frf, ...]
    error: ResponseError
    true_values: Mapping[str, float] = field(default_factory=dict)

    @property
    def frac(self) -> FloatArray:
        """FRAC before and after, (planes, 2)."""
        return np.array([[float(correlation.frac(t, part)[0, 0]) for part in (b, a)]
                         for t, b, a in zip(self.truth, self.before_update, self.after_update, strict=True)])

    def table(self) -> str:
        """Return modes, ranking, fitted values and FRAC as text."""
        rows = [[str(truth.outputs[0]), f"{b:.4f}", f"{a:.5f}"] for truth, (b, a) in zip(self.truth, self.frac, strict=True)]
        # Only a virtual mill has a truth to stand beside the fitted values.
        values = [[*row, f"{self.true_values[row[0]]:.5g}" if row[0] in self.true_values else ""] for row in self.update.rows()]
        return "\n".join([*(video.table() for video in self.videos), self.update.ranking.table(),
                          text_table("Updated to the videos", (*VALUES_HEADER, "filmed machine"), values),
                          text_table("Responses against the truth", ("point", "FRAC before", "FRAC after"), rows),
                          self.error.table()])

    def to_dict(self) -> dict[str, Any]:
        """Return videos, ranking, values and FRAC as plain data."""
        return {"videos": [video.to_dict() for video in self.videos], "update": self.update.to_dict(),
                "frac": self.frac.tolist(), "error": self.error.to_dict()}


def update_from_virtual_videos(
    machine: Machine, truth: Mapping[str, float], point: str, *, rng: np.random.Generator, method: str = "templates",
    camera: Camera | None = None, frames: int = 960, planes: Sequence[str] = ("xz", "yz"),
    step: Callable[[str], None] | None = None,
    recorded: Callable[[VirtualVideo, str], Clip] | None = None,
) -> VirtualUpdate:
    """Return a machine updated to videos of the same machine with other values, filmed in two planes.

    Parameters
    ----------
    machine : Machine
        Before the update.
    truth : path to value
        What the filmed machine has instead.
    point : str
        Point that is struck, in each plane's horizontal direction.
    rng : numpy.random.Generator
    method : str
        Of displacement.
    camera : Camera, optional
    frames : int
    planes : ``xz``, ``yz``
    step : function of the name of the part that begins, optional
    recorded : function of a video and its plane to the clip that is measured, optional
        For example one that writes it compressed and reads it again.

    Examples
    --------
    Runs in ``examples/find_the_soft_joints_in_two_videos.py``.
    """
    camera = camera or Camera(shape=PICTURE_SHAPE)
    filmed = machine.with_values(dict(truth))
    videos = []
    for plane in planes:
        if step is not None:
            step(f"filming the {plane} plane")
        video = film_machine(filmed, View.of_plane(plane, PICTURE_SCALE, PICTURE_ORIGIN), Dof(point, "+" + plane[0]), rng=rng,
                             camera=camera,
                             frames=frames)
        clip = video.clip if recorded is None else recorded(video, plane)
        if step is not None:
            step(f"modes of the {plane} plane")
        videos.append(study_video(clip, view=video.view, bodies=video.regions, band=FILMED_BAND, method=method,
                                  orders=RIGID_ORDERS))
    if step is not None:
        step("update")
    update = update_from_videos(machine, videos)
    lines = np.linspace(*FILMED_BAND, FRAC_LINES)
    responses = [[frequency_response.direct(assemble(model, None, (Dof(point, "+" + plane[0]),)), lines) for plane in planes]
                 for model in (filmed, machine, update.machine)]
    true_responses, before_update, after_update = (tuple(part) for part in responses)
    return VirtualUpdate(tuple(videos), update, true_responses, before_update, after_update,
                         sweep_response_error(update.machine, true_responses), dict(truth))
