r"""Template inner products: displacement as the product of a window's pixels with two fixed patterns (the default).

In a window, :math:`I_t = (1 + g) I_\delta + o - \nabla I_\delta \cdot (d - \delta) + n` with gain and offset of the light:
linear least squares, weighted with the noise, gives :math:`d = \delta + P I_t` with P (2 x pixels) computed once. As P is
orthogonal to the texture and to a constant, light cancels. Templates for the texture moved by quarters of a pixel keep
the linear model near its truth; whole pixels move the window. Source: Lucas, Kanade, IJCAI 1981; Hager, Belhumeur,
IEEE PAMI 20 (1998) 1025 (gain and offset).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from toolpoint._check import BoolArray, FloatArray, IndexArray
from toolpoint.vision.clip import Frames
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, MIN_TEXTURE_RATIO, Windows
from toolpoint.vision.displacement.reference import Reference

WINDOW_BATCH_SIZE = 400  # windows that are solved at once: bounds the memory
# Count of lost frames of a window whose texture cannot be measured at a part of a pixel that it has reached.
UNMEASURABLE_LOST_FRAMES = 1 << 40
Pass = Callable[[Frames], FloatArray]


@dataclass(frozen=True)
class TemplateProducts:
    """Displacement by template inner products with joint gain and offset.

    step : templates a pixel each way; more follow the texture closer and take more memory.
    """

    step: int = 4

    @property
    def name(self) -> str:
        """Name in messages."""
        return "template products"

    def prepare(self, reference: Reference, windows: Windows) -> tuple[Pass, FloatArray, IndexArray]:
        """Return the pass over a chunk of frames, the covariance (n, 2, 2) of a frame, and the counts of lost frames (n,)."""
        from toolpoint.vision.displacement.kernels import track

        n, side, step = len(windows.corners), windows.side, self.step
        padded_width = -(-side // 8) * 8  # whole vectors: the columns beyond the window have no weight
        templates = np.zeros((n, step, step, 2, side, padded_width), np.float32)
        covariance = np.zeros((n, 2, 2))
        ready, is_unmeasurable = np.zeros((step, step), np.int8), np.zeros(n, bool)
        batches = np.array_split(np.arange(n), -(-n // WINDOW_BATCH_SIZE))

        def build(i: int, j: int) -> BoolArray:
            moved, blind = self._secants(reference, j / step, i / step), np.zeros(n, bool)
            for part in batches:
                templates[part, i, j, :, :, :side], spread = solve_windows(moved, reference, windows.selected(part))
                covariance[part] = spread if i == j == 0 else covariance[part]
                blind[part] = np.trace(spread, axis1=1, axis2=2) <= 0
            ready[i, j] = 1
            return blind

        build(0, 0)
        state, lost_frames = np.zeros((n, 2)), np.zeros(n, np.int64)
        corners, normal = np.ascontiguousarray(windows.corners), np.ascontiguousarray(windows.normal)
        edges, unmeasured = windows.sight == EDGE_SIGHT, np.trace(covariance, axis1=1, axis2=2) <= 0

        def measure(frames: Frames) -> FloatArray:
            result = np.zeros((len(frames), n, 2), np.float32)
            chunk_state = state.copy(), lost_frames.copy()
            while True:
                track(frames, corners, templates, ready, step, 0.75 / step, edges, normal, state, result, lost_frames)
                needed_cells = np.argwhere(ready == 2)
                if needed_cells.size == 0:
                    return result
                # Templates for other parts of a pixel are built when motion first comes there, and the chunk is done again.
                for i, j in needed_cells:
                    is_unmeasurable[:] |= build(int(i), int(j)) & ~unmeasured
                state[:], lost_frames[:] = chunk_state[0], np.where(is_unmeasurable, UNMEASURABLE_LOST_FRAMES, chunk_state[1])
        return measure, covariance, lost_frames

    def _secants(self, reference: Reference, right: float, down: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the moved texture and its change per pixel of motion over three quarters of a cell.

        Against a tangent the slope of the result keeps to one over the cell.
        """
        # Secants over the way on which a template is used, not slopes at its middle: they err least over that reach.
        h = 0.375 / self.step
        picture = reference.moved(right, down)[0]
        by_right = (reference.moved(right + h, down)[0] - reference.moved(right - h, down)[0]) / (2 * h)
        by_down = (reference.moved(right, down + h)[0] - reference.moved(right, down - h)[0]) / (2 * h)
        return picture, by_right, by_down


def solve_windows(
    moved: tuple[FloatArray, FloatArray, FloatArray], reference: Reference, windows: Windows
) -> tuple[FloatArray, FloatArray]:
    """Return the templates (n, 2, side, side) and the covariance (n, 2, 2) for one place of the texture.

    Both are zero for a window whose texture gain and offset of the light, or noise of the reference, explain as well as motion
    does: its normal matrix is not positive beyond them, and no variance can be stated.
    """
    side, n = windows.side, len(windows.corners)
    y, x = windows.corners[:, 0], windows.corners[:, 1]
    window_arrays = [sliding_window_view(part, (side, side))[y, x].reshape(n, -1).astype(float)
                     for part in (*moved, reference.variance)]
    picture, right, down, noise = window_arrays
    weight = 1 / noise
    gradients = np.stack([right, down], axis=2)
    normal = windows.normal
    edge = np.einsum("npk,nk->np", gradients, normal)
    # One unknown along the normal where only that shows; the other column is left empty.
    gradients = np.where((windows.sight == EDGE_SIGHT)[:, None, None], np.stack([edge, np.zeros_like(edge)], axis=2), gradients)
    gradients = _remove_light(np.stack([np.ones_like(picture), picture - picture.mean(axis=1, keepdims=True)], axis=2),
                              gradients, weight)
    gram = np.einsum("npi,np,npj->nij", gradients, weight, gradients)
    # Noise in the reference looks like texture and would make every motion a little too small.
    noise_information = reference.false_information(side)
    gram[:, 0, 0] -= noise_information
    gram[:, 1, 1] -= np.where(windows.sight == EDGE_SIGHT, 0.0, noise_information)
    gram[windows.sight == EDGE_SIGHT, 1, 1] = gram[windows.sight == EDGE_SIGHT, 0, 0]
    measured = (windows.sight > BLIND_SIGHT) & (np.linalg.eigvalsh(gram)[:, 0] > MIN_TEXTURE_RATIO * noise_information)
    gram[~measured] = np.eye(2)
    inverse = np.linalg.inv(gram)
    rows = np.einsum("nij,npj,np->nip", inverse, gradients, weight)
    back_rotation = np.where((windows.sight == EDGE_SIGHT)[:, None, None], np.stack([normal, np.zeros_like(normal)], axis=2),
                             np.eye(2))
    back_rotation = np.where(measured[:, None, None], back_rotation, 0.0)
    inverse[windows.sight == EDGE_SIGHT, 1, 1] = 0.0
    covariance = back_rotation @ inverse @ np.swapaxes(back_rotation, 1, 2)
    return (back_rotation @ rows).reshape(n, 2, side, side).astype(np.float32), covariance


def _remove_light(nuisance: FloatArray, columns: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the columns less the part that gain and offset of the light explain, in the weighted sense."""
    gram = np.einsum("npi,np,npj->nij", nuisance, weight, nuisance)
    # A window without texture has a singular matrix, which must not stop the solution of the others.
    gram += 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(gram.shape[1])
    share = np.linalg.solve(gram, np.einsum("npi,np,npj->nij", nuisance, weight, columns))
    return columns - nuisance @ share

