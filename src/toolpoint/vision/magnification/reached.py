"""How much a magnified mode moves in the frames that were drawn, over what was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.vision.clip import FrameArray
from toolpoint.vision.displacement.measure import measure
from toolpoint.vision.displacement.points import BLIND
from toolpoint.vision.displacement.templates import TemplateProducts
from toolpoint.vision.magnification.warp import ShapeWarp

# Frames from rest to the largest motion, windows that are followed, largest motion that they can follow (pixels a frame), and
# how far a gain may be from what was asked.
RAMP, FOLLOWED, FASTEST, NEAR = 12, 60, 0.7, 0.1


def measure_gain(warp: ShapeWarp, mode: int, factor: float) -> float:
    """Return the gain that drawn frames reach, followed as a clip is: not a number where no window could be followed."""
    windows, shapes = warp.field.windows, warp.field.shapes
    seen = np.flatnonzero(windows.sight > BLIND)
    values = shapes.shape[seen][:, :, mode]
    ratio = (np.abs(values) / np.maximum(shapes.deviation()[seen][:, :, mode], 1e-12)).max(axis=1)
    seen = seen[np.argsort(-ratio)[:FOLLOWED]]
    turn = np.exp(-0.5j * np.angle((shapes.shape[seen][:, :, mode] ** 2).sum()))
    moved = (shapes.shape[seen][:, :, mode] * turn).real
    largest = float(np.abs(moved).max(initial=0.0))
    if largest <= 0:
        return float("nan")
    # A motion that windows can follow: the drawing is the same at every factor, its errors grow with it.
    most = min(factor, FASTEST * RAMP / largest)
    drawn = np.stack([warp.still(mode, most, turn * k / RAMP) for k in range(RAMP + 1)])
    source = FrameArray(drawn, warp.scan.clip.source.bits)
    scan = replace(warp.scan, clip=replace(warp.scan.clip, source=source, region=None),
                   survey=replace(warp.scan.survey, frames=len(drawn)))
    field = measure(scan, windows.selected(seen), TemplateProducts(4))
    weight = (field.windows.sight > BLIND)[:, None] / np.maximum(np.trace(field.covariance, axis1=1, axis2=2), 1e-9)[:, None]
    want, have = most * moved, field.values[-1] - field.values[0]
    power = float((weight * want**2).sum())
    return factor / most * float((weight * want * have).sum()) / power * most if power > 0 else float("nan")


def gain_doubt(warp: ShapeWarp, mode: int, factor: float) -> Doubt | None:
    """Return a doubt where the frames do not reach the asked gain within a tenth."""
    gain = measure_gain(warp, mode, factor)
    if np.isfinite(gain) and abs(gain / factor - 1) <= NEAR:
        return None
    what = f"reaches a gain of {gain:.3g} for {factor:g}" if np.isfinite(gain) else "cannot be checked: no window follows it"
    return Doubt("magnified clip", what, "state the bodies (--body), so that each moves as one",
                 figure=abs(gain / factor - 1))

