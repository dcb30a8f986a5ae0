"""Gain of a magnified mode: motion in the drawn frames over the motion in the clip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.vision.clip import FrameArray
from toolpoint.vision.displacement.measure import measure
from toolpoint.vision.displacement.points import BLIND_SIGHT
from toolpoint.vision.displacement.templates import TemplateProducts
from toolpoint.vision.magnification.warp import ShapeWarp

# Frames from rest to the largest motion, windows that are followed, largest motion that they can follow (pixels a frame), and
# how far a gain may be from what was asked.
RAMP_FRAMES, MAX_GAIN_WINDOWS, MAX_PIXELS_PER_FRAME, GAIN_TOLERANCE = 12, 60, 0.7, 0.1


def measure_gain(warp: ShapeWarp, mode: int, factor: float) -> float:
    """Return the gain of the drawn frames, measured as a clip is; NaN where no window could be followed."""
    windows, shapes = warp.field.windows, warp.field.shapes
    visible = np.flatnonzero(windows.sight > BLIND_SIGHT)
    values = shapes.shape[visible][:, :, mode]
    ratio = (np.abs(values) / np.maximum(shapes.deviation()[visible][:, :, mode], 1e-12)).max(axis=1)
    visible = visible[np.argsort(-ratio)[:MAX_GAIN_WINDOWS]]
    phase = np.exp(-0.5j * np.angle((shapes.shape[visible][:, :, mode] ** 2).sum()))
    moved = (shapes.shape[visible][:, :, mode] * phase).real
    largest = float(np.abs(moved).max(initial=0.0))
    if largest <= 0:
        return float("nan")
    # A motion that windows can follow: the drawing is the same at every factor, its errors grow with it.
    drawn_factor = min(factor, MAX_PIXELS_PER_FRAME * RAMP_FRAMES / largest)
    drawn_frames = np.stack([warp.deform_reference(mode, drawn_factor, phase * k / RAMP_FRAMES)
                             for k in range(RAMP_FRAMES + 1)])
    source = FrameArray(drawn_frames, warp.scan.clip.source.bits)
    ramp = replace(warp.scan, clip=replace(warp.scan.clip, source=source, region=None),
                   survey=replace(warp.scan.survey, frames=len(drawn_frames)))
    field = measure(ramp, windows.selected(visible), TemplateProducts(4))
    weight = (field.windows.sight > BLIND_SIGHT)[:, None] / np.maximum(np.trace(field.covariance, axis1=1, axis2=2),
                                                                       1e-9)[:, None]
    expected, measured = drawn_factor * moved, field.values[-1] - field.values[0]
    power = float((weight * expected**2).sum())
    return factor / drawn_factor * float((weight * expected
                                          * measured).sum()) / power * drawn_factor if power > 0 else float("nan")


def gain_doubt(warp: ShapeWarp, mode: int, factor: float) -> Doubt | None:
    """Return a doubt where the frames do not reach the asked gain within a tenth."""
    gain = measure_gain(warp, mode, factor)
    if np.isfinite(gain) and abs(gain / factor - 1) <= GAIN_TOLERANCE:
        return None
    what = f"reaches a gain of {gain:.3g} for {factor:g}" if np.isfinite(gain) else "cannot be checked: no window follows it"
    return Doubt("magnified clip", what, "state the bodies (--body), so that each moves as one",
                 figure=abs(gain / factor - 1))

