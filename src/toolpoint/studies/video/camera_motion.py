"""Motion of the camera itself, by parts of the picture at rest, stated or found around the bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint._check import BoolArray, fail
from toolpoint.vision.clip import Region
from toolpoint.vision.displacement.background import MIN_BACKGROUND_DIRECTIONS, CameraMotion, camera_motion, windows_inside
from toolpoint.vision.displacement.measure import Method, Scan, measure
from toolpoint.vision.displacement.points import BLIND_SIGHT, Windows, grid_windows
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.displacement.templates import TemplateProducts

# Pixels around the bodies that are left out: their edges move with them, and regions are rough.
BODY_CLEARANCE_PIXELS = 6
# Share of the picture's width and height that windows around the bodies must span; how far a body's share of the camera's
# motion may be from all of it.
MIN_SPAN_FRACTION, SHARED_MOTION_TOLERANCE = 0.6, 0.25


def find_camera_motion(scanned: Scan, points: DisplacementField, stated: Sequence[Region], *, bodies: Mapping[str, Region],
                       side: int, method: str | Method) -> CameraMotion | None:
    """Return the motion of the camera by the stated background, else by the surroundings of the bodies.

    Around bodies it is None where nothing has texture, the windows do not span the picture or move as one, nothing stands out
    of the noise, the motion dies out, or a body lacks it: then nothing is taken off. points : of the whole picture.

    Raises
    ------
    ToolpointError
        For a stated background without texture.
    """
    windows = grid_windows(scanned.reference, scanned.survey, side)
    windows = windows.selected(np.flatnonzero(windows.sight > BLIND_SIGHT))
    if stated:
        stated_windows = windows.selected(np.flatnonzero(windows_inside(windows, stated)))
        if len(stated_windows.corners) == 0:
            fail("background", "no texture in it", "must show whether the camera moves",
                 remedy="a plain wall shows no motion: put a fixed pattern there, or use a stiff tripod")
        return camera_motion(measure(scanned, stated_windows, TemplateProducts(4) if method == "templates" else method))
    free = windows.selected(np.flatnonzero(_clear_of(windows, bodies)))
    if not bodies or len(free.corners) < MIN_BACKGROUND_DIRECTIONS:
        return None
    field = _drop_movers(measure(scanned, free, TemplateProducts(4)))
    if field.measured()[0].shape[1] < 2 * MIN_BACKGROUND_DIRECTIONS or not _spans(field.windows, scanned.clip.shape):
        return None
    camera = camera_motion(field)
    if not camera.stands_out or camera.fades:
        return None
    for body in bodies.values():
        on = points.selected(np.flatnonzero(windows_inside(points.windows, [body]) & (points.windows.sight > BLIND_SIGHT)))
        if len(on.windows.corners) and abs(camera.shared_by(on) - 1) > SHARED_MOTION_TOLERANCE:
            return None
    return camera


def _spans(windows: Windows, shape: tuple[int, int]) -> bool:
    """Return whether windows lie on both sides of a picture, and above and below."""
    return bool((np.ptp(windows.centres, axis=0) > MIN_SPAN_FRACTION * np.array(shape[::-1])).all())


def _clear_of(windows: Windows, bodies: Mapping[str, Region]) -> BoolArray:
    """Return which windows keep clear of all bodies."""
    half = windows.side / 2 + BODY_CLEARANCE_PIXELS
    x, y = windows.centres.T
    clear = np.ones(len(windows.corners), bool)
    for body in bodies.values():
        clear &= ((x + half < body.left) | (x - half > body.left + body.width)
                  | (y + half < body.top) | (y - half > body.top + body.height))
    return clear


def _drop_movers(field: DisplacementField) -> DisplacementField:
    """Return the half of the windows nearest to their common motion: windows that move by themselves are no background."""
    values = field.values - field.values.mean(axis=0)
    deviation = np.sqrt(((values - np.median(values, axis=1)[:, None]) ** 2).mean(axis=(0, 2)))
    noise = np.sqrt(np.trace(field.covariance, axis1=1, axis2=2) / 2)
    ratio = deviation / np.maximum(noise, 1e-9)
    return field.selected(np.flatnonzero(ratio <= max(float(np.median(ratio)), 1.5)))
