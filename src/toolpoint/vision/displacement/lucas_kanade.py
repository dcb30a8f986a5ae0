"""Lucas-Kanade: windows followed by Gauss-Newton steps on interpolated frames, as point trackers do; light is not fitted.

Source: Lucas, Kanade, IJCAI 1981; Baker, Matthews, IJCV 56 (2004) 221 (inverse compositional).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vision.clip import Frames
from toolpoint.vision.displacement.points import FULL_SIGHT, Windows
from toolpoint.vision.displacement.reference import Reference
from toolpoint.vision.displacement.templates import Pass


@dataclass(frozen=True)
class LucasKanade:
    """Lucas-Kanade steps until they are shorter than `tolerance` pixels; windows that see both directions only.

    >>> LucasKanade(tolerance=1e-4).name
    'Lucas-Kanade'
    """

    tolerance: float = 1e-3

    @property
    def name(self) -> str:
        """Name in messages."""
        return "Lucas-Kanade"

    def prepare(self, reference: Reference, windows: Windows) -> tuple[Pass, FloatArray, IndexArray]:
        """Return the pass over a chunk of frames, the covariance (n, 2, 2) of a frame, and the counts of lost frames (n,)."""
        from toolpoint.vision.displacement.kernels import follow

        n, side = len(windows.corners), windows.side
        picture, right, down = reference.moved(0.0, 0.0)
        y, x = windows.corners[:, 0], windows.corners[:, 1]
        window_arrays = [np.ascontiguousarray(sliding_window_view(part, (side, side))[y, x], np.float32)
                         for part in (picture, -right, -down, reference.variance)]
        slopes = np.stack(window_arrays[1:3], axis=1)
        gram = np.einsum("nihw,njhw->nij", slopes, slopes).astype(float)
        usable = windows.sight == FULL_SIGHT
        gram[~usable] = np.eye(2)
        inverse = np.linalg.inv(gram)
        inverse[~usable] = 0.0
        noise = np.einsum("nihw,nhw,njhw->nij", slopes, window_arrays[3], slopes)
        covariance = inverse @ noise @ inverse
        state, lost_frames = np.zeros((n, 2)), np.zeros(n, np.int64)
        corners = np.ascontiguousarray(windows.corners)

        def measure(frames: Frames) -> FloatArray:
            result = np.zeros((len(frames), n, 2), np.float32)
            # The templates are the unmoved texture: light that changes is not fitted, unlike in `templates`.
            follow(frames, corners, window_arrays[0], slopes, inverse, self.tolerance, state, result, lost_frames)
            return result
        return measure, covariance, lost_frames
