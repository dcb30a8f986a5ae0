"""Full-field shapes: the video is projected on the poles first, then every window's shape is read from a few pictures.

The product of pixels and exponentials is a sum over frames that needs no tracking: two modes are four pictures. Linear in
the motion, so good to about half a pixel; beyond, tracked windows are better (`point_shapes`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from toolpoint._check import ComplexArray
from toolpoint.vision.displacement.measure import Scan
from toolpoint.vision.displacement.points import Windows, grid_windows
from toolpoint.vision.displacement.survey import Progress
from toolpoint.vision.displacement.templates import WINDOW_BATCH_SIZE, solve_windows
from toolpoint.vision.modes.projection import DecayBasis, PointShapes, decay_basis

# A window whose noise a frame is above this, pixels, adds nothing to a shape.
MAX_FIELD_DEVIATION = 3.0


@dataclass(frozen=True, eq=False)
class FullField:
    """Shapes of windows side by side over the whole picture, and the pictures that they came from.

    windows : Windows; shapes : PointShapes; pictures : (r, rows, columns) complex change of the grey levels by each mode.
    """

    windows: Windows
    shapes: PointShapes
    pictures: ComplexArray


def project_frames(scanned: Scan, basis: DecayBasis, first: int, *, progress: Progress | None = None) -> ComplexArray:
    """Return the change of the grey levels by every pole, (r, rows, columns) complex."""
    from toolpoint.vision.displacement.kernels import add_projection

    frames_of_basis = len(basis.columns)
    weight_count = 2 * basis.poles.size
    weights = basis.weights[:weight_count].astype(np.float32)
    total = np.zeros((weight_count, *scanned.clip.shape), np.float32)
    frame_index = 0
    for frames in scanned.clip.chunks():
        first_frame, end_frame = max(frame_index, first), min(frame_index + len(frames), first + frames_of_basis)
        if end_frame > first_frame:
            add_projection(frames[first_frame - frame_index:end_frame - frame_index],
                           np.ascontiguousarray(weights[:, first_frame - first:end_frame - first]), total)
        frame_index += len(frames)
        if progress is not None:
            progress("full-field shapes", frame_index, scanned.survey.frames)
    return np.asarray(total[0::2] + 1j * total[1::2])


def full_field(scanned: Scan, poles: ComplexArray, first: int = 0, *, side: int = 16, stop: int | None = None,
               skip: int = 0, progress: Progress | None = None) -> FullField:
    """Return the shapes of the whole picture for known poles (rad/s), frame `first` to `stop`; `skip` as in `point_shapes`.

    Examples
    --------
    Runs in ``examples/motion_of_a_whole_picture.py``.
    """
    end_frame = scanned.survey.frames if stop is None else stop
    basis = decay_basis(poles, np.arange(end_frame - first) / scanned.clip.frame_rate, skip=skip)
    pictures = project_frames(scanned, basis, first, progress=progress)
    windows = grid_windows(scanned.reference, scanned.survey, side, max_deviation=MAX_FIELD_DEVIATION)
    moved = scanned.reference.moved(0.0, 0.0)
    n = len(windows.corners)
    shape, covariance = np.empty((n, 2, basis.poles.size), complex), np.empty((n, 2, 2))
    for batch in np.array_split(np.arange(n), -(-n // WINDOW_BATCH_SIZE)):
        batch_windows = windows.selected(batch)
        templates, covariance[batch] = solve_windows(moved, scanned.reference, batch_windows)
        y, x = batch_windows.corners[:, 0], batch_windows.corners[:, 1]
        for r, picture in enumerate(pictures):
            window_pictures = sliding_window_view(picture, (side, side))[y, x]
            shape[batch, :, r] = np.einsum("nihw,nhw->ni", templates, window_pictures)
    delay = windows.centres[:, 1] * scanned.clip.row_delay
    shape *= np.exp(-basis.poles * delay[:, None])[:, None, :]
    return FullField(windows.measured_with(covariance), PointShapes(shape, covariance, basis, np.ones(n)), pictures)
