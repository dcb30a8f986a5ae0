"""Measurement of displacement in one call, by every method, with progress and doubts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, one_of
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Clip
from toolpoint.vision.displacement.lucas_kanade import LucasKanade
from toolpoint.vision.displacement.phase import LocalPhase
from toolpoint.vision.displacement.points import BLIND_SIGHT, Windows
from toolpoint.vision.displacement.reference import Reference, take_reference
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.displacement.survey import Progress, Survey, survey_clip
from toolpoint.vision.displacement.templates import TemplateProducts

METHODS: dict[str, TemplateProducts | LucasKanade | LocalPhase] = {
    "templates": TemplateProducts(), "lucas-kanade": LucasKanade(), "phase": LocalPhase()}
Method = TemplateProducts | LucasKanade | LocalPhase
MAX_LOST_FRACTION = 0.01  # of the frames


@dataclass(frozen=True, eq=False)
class Scan:
    """A clip that was looked through: its survey and its picture at rest.

    A clip before anything is measured in it:

    >>> from toolpoint.vision import clip_of
    >>> frames = np.random.default_rng(0).integers(90, 160, (60, 48, 64)).astype(np.uint8)
    >>> scan(clip_of(frames, 200.0)).clip.frame_rate
    200.0
    """

    clip: Clip
    survey: Survey
    reference: Reference


def scan(clip: Clip, progress: Progress | None = None) -> Scan:
    """Return the survey and the reference of a clip: what every measurement in it begins with.

    >>> from scipy import ndimage
    >>> from toolpoint.vision import clip_of
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> scanned.survey.frames, scanned.reference.picture.shape
    (60, (48, 64))
    """
    survey = survey_clip(clip, progress)
    return Scan(clip, survey, take_reference(clip, survey))


def measure(scanned: Scan, windows: Windows, method: str | Method = "templates", *,
            progress: Progress | None = None) -> DisplacementField:
    """Return the displacement of windows of the picture in every frame.

    Parameters
    ----------
    scanned : Scan
        See `scan`.
    windows : Windows
        From `choose_points`, `grid_windows` or `windows_at`.
    method : str or method object
        ``templates`` (default), ``lucas-kanade``, ``phase``, or one with its own settings, e.g. ``LocalPhase(wavelength=10)``.

    >>> from scipy import ndimage
    >>> from toolpoint.vision import choose_points, clip_of
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> field = measure(scanned, choose_points(scanned.reference, scanned.survey, 4, side=15))
    >>> bool(np.abs(field.values[:, :, 0] - decay[:, None] - (field.values[:, :, 0].mean() - decay.mean())).max() < 0.03)
    True
    """
    tracker = METHODS[one_of("method", method, METHODS)] if isinstance(method, str) else method
    if len(windows.corners) == 0:
        fail("windows", "none", "must be one at least", remedy="choose points where the picture has texture")
    clip = scanned.clip
    run, covariance, lost_frames = tracker.prepare(scanned.reference, windows)
    values = np.empty((scanned.survey.frames, len(windows.corners), 2), np.float32)
    frame_index = 0
    for frames in clip.chunks():
        values[frame_index:frame_index + len(frames)] = run(frames)
        frame_index += len(frames)
        if progress is not None:
            progress("measuring displacement", frame_index, scanned.survey.frames)
    visible_windows = windows.measured_with(covariance)
    faint_count = int((windows.sight > BLIND_SIGHT).sum()
                      - (visible_windows.sight > BLIND_SIGHT).sum()) if isinstance(tracker, TemplateProducts) else 0
    windows, values = _without_lost(visible_windows, values, lost_frames)
    doubts = _doubts(windows, lost_frames, scanned.survey.frames, faint_count=faint_count)
    return DisplacementField(windows, values, covariance, clip.frame_rate, clip.row_delay, lost_frames, tracker.name,
                             tuple(doubts))


def _without_lost(windows: Windows, values: FloatArray, lost_frames: IndexArray) -> tuple[Windows, FloatArray]:
    """Return the windows with sight removed from those lost for more than `MAX_LOST_FRACTION` of the frames."""
    is_lost = lost_frames > MAX_LOST_FRACTION * len(values)
    if not is_lost.any():
        return windows, values
    values[:, is_lost] = 0.0
    return replace(windows, sight=np.where(is_lost, BLIND_SIGHT, windows.sight),
                   bound=np.where(is_lost[:, None], np.inf, windows.bound)), values


def _doubts(windows: Windows, lost_frames: IndexArray, frames: int, *, faint_count: int) -> list[Doubt]:
    doubts: list[Doubt] = []
    if faint_count:
        doubts.append(Doubt("windows",
                            f"{faint_count} of {len(lost_frames)} windows are left out: a change of the light, or noise of the "
                            "picture at rest, explains their texture as well as motion", "more texture or more light",
                            figure=faint_count / len(lost_frames)))
    lost_count = int((lost_frames > MAX_LOST_FRACTION * frames).sum())
    if lost_count:
        doubts.append(Doubt("windows", f"{lost_count} of {len(lost_frames)} windows were lost for more than "
                            f"{100 * MAX_LOST_FRACTION:g} % of the frames and are left out",
                            "they moved out of the picture, or too far from frame to frame",
                            figure=lost_count / len(lost_frames)))
    saturated_count = int((windows.saturated > 0.02).sum())
    if saturated_count:
        doubts.append(Doubt("windows", f"{saturated_count} of {len(lost_frames)} windows are saturated (black or white pixels) "
                            "and are left out", "change the exposure or the light", figure=saturated_count / len(lost_frames)))
    return doubts
