"""measure: one call from a clip to displacement, for every method; progress, doubts and background motion on the way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail, one_of
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Clip
from toolpoint.vision.displacement.lucas_kanade import LucasKanade
from toolpoint.vision.displacement.phase import LocalPhase
from toolpoint.vision.displacement.points import BLIND, Windows
from toolpoint.vision.displacement.reference import Reference, take_reference
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.displacement.survey import Progress, Survey, survey_clip
from toolpoint.vision.displacement.templates import TemplateProducts

METHODS: dict[str, TemplateProducts | LucasKanade | LocalPhase] = {
    "templates": TemplateProducts(), "lucas-kanade": LucasKanade(), "phase": LocalPhase()}
Method = TemplateProducts | LucasKanade | LocalPhase
LOST = 0.01


@dataclass(frozen=True, eq=False)
class Scan:
    """A clip that was looked through: its survey and its picture at rest."""

    clip: Clip
    survey: Survey
    reference: Reference


def scan(clip: Clip, progress: Progress | None = None) -> Scan:
    """Return the survey and the reference of a clip: what every measurement in it begins with."""
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
    """
    chosen = METHODS[one_of("method", method, METHODS)] if isinstance(method, str) else method
    if len(windows.corners) == 0:
        fail("windows", "none", "must be one at least", remedy="choose points where the picture has texture")
    clip = scanned.clip
    run, covariance, lost = chosen.prepare(scanned.reference, windows)
    values = np.empty((scanned.survey.frames, len(windows.corners), 2), np.float32)
    at = 0
    for frames in clip.chunks():
        values[at:at + len(frames)] = run(frames)
        at += len(frames)
        if progress is not None:
            progress("measuring displacement", at, scanned.survey.frames)
    seen = windows.measured_with(covariance)
    faint = int((windows.sight > BLIND).sum() - (seen.sight > BLIND).sum()) if isinstance(chosen, TemplateProducts) else 0
    windows, values = _without_lost(seen, values, lost)
    doubts = _doubts(windows, lost, scanned.survey.frames, faint=faint)
    return DisplacementField(windows, values, covariance, clip.frame_rate, clip.row_delay, lost, chosen.name, tuple(doubts))


def _without_lost(windows: Windows, values: FloatArray, lost: IndexArray) -> tuple[Windows, FloatArray]:
    """Return the windows with those blind that were lost for more than a hundredth of the frames."""
    gone = lost > LOST * len(values)
    if not gone.any():
        return windows, values
    values[:, gone] = 0.0
    return replace(windows, sight=np.where(gone, BLIND, windows.sight),
                   bound=np.where(gone[:, None], np.inf, windows.bound)), values


def _doubts(windows: Windows, lost: IndexArray, frames: int, *, faint: int) -> list[Doubt]:
    doubts: list[Doubt] = []
    if faint:
        doubts.append(Doubt("windows", f"{faint} of {len(lost)} windows are left out: a change of the light, or noise of the "
                            "picture at rest, explains their texture as well as motion", "more texture or more light",
                            figure=faint / len(lost)))
    gone = int((lost > LOST * frames).sum())
    if gone:
        doubts.append(Doubt("windows", f"{gone} of {len(lost)} windows were lost for more than {100 * LOST:g} % of the frames "
                            "and are left out", "they moved out of the picture, or too far from frame to frame",
                            figure=gone / len(lost)))
    clipped = int((windows.saturated > 0.02).sum())
    if clipped:
        doubts.append(Doubt("windows", f"{clipped} of {len(lost)} windows are saturated (black or white pixels) and are left "
                            "out", "change the exposure or the light", figure=clipped / len(lost)))
    return doubts
