"""Doubts about the stated views, where an updated machine does not explain the videos.

Planes that are exchanged and a scale that is off are numbers as good as any: only the machine shows it. Its misfit (reduced
chi-square) is 1 where all is right, grows with the square of the scale's error, and falls to 1 again with the right statement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.studies.video.video_update import VideoUpdate
from toolpoint.vision.view import View

# Reduced chi-square above which what was stated is questioned, and the least factor by which another statement lowers it.
MAX_TRUSTED_MISFIT, MIN_MISFIT_GAIN = 3.0, 4.0
# Relative step of the scale to either side by which the better side is known, and the largest error that is looked for.
SCALE_STEP, MAX_SCALE_ERROR = 0.06, 0.25

Repeat = Callable[[Sequence[View]], VideoUpdate]


def question_views(update: VideoUpdate, repeat: Repeat) -> tuple[Doubt, ...]:
    """Return doubts of the stated planes and scale where others explain the videos far better.

    Parameters
    ----------
    update : VideoUpdate
        By the views as stated.
    repeat : callable
        Studies and update by other views.
    """
    misfit = _misfit(update)
    if misfit <= MAX_TRUSTED_MISFIT:
        return ()
    views = [video.view for video in update.videos]
    return tuple([*_question_planes(views, misfit, repeat), *_question_scale(views, misfit, repeat)][:1])


def _misfit(update: VideoUpdate) -> float:
    value = update.update.fit.reduced_chi_square
    return float(value) if np.isfinite(value) else np.inf


def _misfit_by(views: Sequence[View], repeat: Repeat) -> float:
    """Return the misfit by other views, infinite where nothing can be updated by them."""
    try:
        return _misfit(repeat(views))
    except ToolpointError:
        return np.inf


def _question_planes(views: Sequence[View], misfit: float, repeat: Repeat) -> list[Doubt]:
    """Return the doubt that the planes of two videos were stated in the wrong order."""
    if len(views) != 2 or (views[0].right, views[0].down) == (views[1].right, views[1].down):
        return []
    first, second = views
    turned = [replace(first, right=second.right, down=second.down), replace(second, right=first.right, down=first.down)]
    other = _misfit_by(turned, repeat)
    if other * MIN_MISFIT_GAIN > misfit:
        return []
    return [Doubt("views", f"exchanged, the machine explains the videos (misfit {other:.2g}, {misfit:.3g} as stated): the "
                  f"first video shows {second.right} to the right, as was stated of the second",
                  "exchange the videos or the views")]


def _question_scale(views: Sequence[View], misfit: float, repeat: Repeat) -> list[Doubt]:
    """Return the doubt that the scale is off, with the one that explains the videos best."""
    misfit_by_step = {step: _misfit_by(_by_scale(views, 1 + step), repeat) for step in (-SCALE_STEP, SCALE_STEP)}
    side = min(misfit_by_step, key=lambda step: misfit_by_step[step])
    distance, side_distance = (np.sqrt(max(value - 1.0, 0.0)) for value in (misfit, misfit_by_step[side]))
    if not side_distance < distance:
        return []
    # The root of what is above 1 goes with the distance: the least lies beyond the better side, or before it.
    tried = {float(np.clip(side * distance / way, -MAX_SCALE_ERROR, MAX_SCALE_ERROR)): np.inf
             for way in (distance - side_distance, distance + side_distance)}
    tried = {step: _misfit_by(_by_scale(views, 1 + step), repeat) for step in tried}
    best = min(tried, key=lambda step: tried[step])
    if tried[best] * MIN_MISFIT_GAIN > misfit:
        return []
    other = tried[best]
    stated, better_scale = 1e3 * views[0].metres, 1e3 * views[0].metres * (1 + best)
    return [Doubt("scale",
                  f"{better_scale:.4g} mm a pixel explains the videos (misfit {other:.2g}), {stated:.4g} as stated does not "
                  f"({misfit:.3g})", "measure a known length in the picture", figure=better_scale)]


def _by_scale(views: Sequence[View], factor: float) -> list[View]:
    return [replace(view, scale=view.metres * factor) for view in views]
