r"""Magnification by the identified shape (the default): every pixel is moved on by its mode's motion times the factor less one.

The motion of mode r at a pixel is :math:`\Re(\phi_r e^{s_r t})` with the shape of its body (or a smooth field of the windows
where no bodies are stated), so nothing but that mode is magnified, noise is not, and what stands still stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from toolpoint._check import ComplexArray, FloatArray, fail, scalar
from toolpoint.vision.clip import Frames
from toolpoint.vision.displacement.measure import Scan
from toolpoint.vision.displacement.points import BLIND_SIGHT, EDGE_SIGHT, FULL_SIGHT
from toolpoint.vision.modes.bodies import EDGE_MARGIN, BodyMotion
from toolpoint.vision.modes.full_field import FullField

SHAPE_SMOOTHING = 0.7  # windows, standard deviation of the smoothing of shapes
BODY_RIM = 2  # pixels around a body that move with it: its blurred edge
# Owners of pixels that no body covers: the wall, and its part close to a body, where the body's edge may show.
WALL_OWNER, NEAR_BODY_OWNER = -1, -2
MAX_MAGNIFICATION = 1e4  # motion in the result over that in the clip
# Number of windows outside all bodies that must move, by how many deviations, and by what share of the largest motion.
MIN_MOVING_WINDOWS, MIN_MOTION_DEVIATIONS, MIN_MOTION_FRACTION = 3, 5.0, 0.05


@dataclass(frozen=True, eq=False)
class ShapeWarp:
    """Magnification of one mode by its shape.

    Parameters
    ----------
    scan : Scan
    poles : (r,) complex, rad/s
        Of all modes; phases from frame `first` on.
    bodies : sequence of BodyMotion
        Where empty, `field` is taken.
    field : FullField
    first : int
    """

    scan: Scan
    poles: ComplexArray
    bodies: tuple[BodyMotion, ...]
    field: FullField
    first: int = 0

    def frames(self, mode: int, factor: float, *, attenuation: float = 0.5,
               numbers: Sequence[int] | None = None) -> Iterator[Frames]:
        """Yield magnified frames.

        Parameters
        ----------
        mode : int
            Index of the mode.
        factor : float
            Motion in the result over that in the clip.
        attenuation : float
            0 .. 1, part of each frame that comes from the picture at rest, moved by all modes: it has no noise.
        numbers : sequence of int, optional
            Frames of the clip; all from the start of the decay on where left out.
        """
        _check(mode, self.poles.size, factor, attenuation)
        chosen_frames = None if numbers is None else set(numbers)
        draw = self._create_drawing()
        frame_index = 0
        for frames in self.scan.clip.chunks():
            for k, frame in enumerate(frames, start=frame_index):
                if k >= self.first and (chosen_frames is None or k in chosen_frames):
                    gains = np.exp(self.poles * (k - self.first) / self.scan.clip.frame_rate)
                    yield draw(frame, gains, mode, factor, attenuation)
            frame_index += len(frames)

    def deform_reference(self, mode: int, factor: float, phase: complex = 1.0) -> Frames:
        """Return the picture at rest deformed by one mode alone, at a phase of its motion."""
        _check(mode, self.poles.size, factor, 1.0)
        gains = np.zeros(self.poles.size, complex)
        gains[mode] = phase
        reference = self.scan.reference.picture
        levels = np.uint8 if self.scan.clip.source.bits == 8 else np.uint16
        return self._create_drawing()(np.clip(reference + 0.5, 0, self.scan.clip.white).astype(levels), gains, mode, factor,
                                      1.0)

    def _create_drawing(self) -> _Layers | _Field:
        known_bodies = [body for body in self.bodies if "unknown" not in body.orders]
        if not known_bodies:
            return _Field(self.scan, self.field)
        return _Layers(self.scan, known_bodies, _Field(self.scan, self.field) if self._background_moves(known_bodies) else None)

    def _background_moves(self, bodies: Sequence[BodyMotion]) -> bool:
        """Return whether windows outside all bodies move, beyond doubt and by a share of the largest motion."""
        windows, shapes = self.field.windows, self.field.shapes
        is_outside = windows.sight > BLIND_SIGHT
        half = windows.side / 2 + EDGE_MARGIN
        for body in bodies:
            x, y = windows.centres[:, 0] - body.region.left, windows.centres[:, 1] - body.region.top
            is_outside &= (x < -half) | (y < -half) | (x > body.region.width + half) | (y > body.region.height + half)
        if not is_outside.any():
            return False
        size, deviation = np.abs(shapes.shape[is_outside]), shapes.deviation()[is_outside]
        largest = np.abs(shapes.shape[windows.sight > BLIND_SIGHT]).max(axis=(0, 1))
        moving = ((size > MIN_MOTION_DEVIATIONS * deviation) & (size > MIN_MOTION_FRACTION * largest)).any(axis=(1, 2))
        return int(moving.sum()) >= MIN_MOVING_WINDOWS


def _check(mode: int, count: int, factor: float, attenuation: float) -> None:
    if not 0 <= mode < count:
        fail("mode", str(mode + 1), f"must be 1 .. {count}")
    if not 0 <= scalar("factor", factor) <= MAX_MAGNIFICATION:
        fail("factor", f"{factor:g}", f"must be 0 .. {MAX_MAGNIFICATION:g}")
    if not 0 <= scalar("attenuation", attenuation) <= 1:
        fail("attenuation", f"{attenuation:g}", "must be 0 .. 1")


class _Layers:
    """Draws frames of which each body is a layer."""

    def __init__(self, scanned: Scan, bodies: Sequence[BodyMotion], background_field: _Field | None = None) -> None:
        self.background_field = background_field
        reference = np.ascontiguousarray(scanned.reference.picture, np.float32)
        self.reference = reference
        # Edges are blurred over a pixel or two outside: they move with the body.
        self.boxes = np.array([(b.region.left - BODY_RIM, b.region.top - BODY_RIM, b.region.width + 2 * BODY_RIM,
                                b.region.height + 2 * BODY_RIM)
                               for b in bodies])
        is_near_body = _pixels_near(self.boxes, reference.shape)
        self.owner = np.where(is_near_body, NEAR_BODY_OWNER, WALL_OWNER).astype(np.int16)
        for k, (left, first_row, width, height) in enumerate(self.boxes):
            self.owner[max(0, first_row):first_row + height, max(0, left):left + width] = k
        self.wall = _fill_from_nearest(reference, is_near_body)
        self.fills = np.stack([_fill_from_nearest(reference, self.owner != k) if (self.owner == k).any() else reference
                               for k in range(len(bodies))])
        self.fields = np.stack([_in_pixels(body) for body in bodies])

    def __call__(self, frame: Frames, gains: ComplexArray, mode: int, factor: float, attenuation: float) -> Frames:
        from toolpoint.vision.magnification.kernels import draw_layers, draw_wall

        parts = (self.fields * gains[:, None, None]).real  # (bodies, modes, 2, 6)
        mode_shift = (factor - 1) * parts[:, mode]
        grey, rest_share = frame.astype(np.float32), np.float32(attenuation)
        out = np.empty_like(grey)
        if self.background_field is None:
            draw_wall(grey, self.reference, self.wall, self.owner, rest_share, out)
        else:
            background = self.background_field(frame, gains, mode, factor, attenuation).astype(np.float32)
            draw_wall(background, background, self.wall, self.owner, np.float32(0), out)
        draw_layers(grey, self.reference, self.fills, self.owner, self.boxes, mode_shift, parts.sum(axis=1) + mode_shift,
                    rest_share, out)
        return _rounded(out, frame)


class _Field:
    """Draws frames by a smooth field of the windows' shapes."""

    def __init__(self, scanned: Scan, field: FullField) -> None:
        self.reference = np.ascontiguousarray(scanned.reference.picture, np.float32)
        self.maps = smooth_shapes(field, self.reference.shape)

    def __call__(self, frame: Frames, gains: ComplexArray, mode: int, factor: float, attenuation: float) -> Frames:
        from toolpoint.vision.magnification.kernels import draw_field

        mode_shift = ((factor - 1) * (self.maps[mode] * gains[mode]).real).astype(np.float32)
        total_shift = (np.tensordot(gains, self.maps, axes=(0, 0)).real + mode_shift).astype(np.float32)
        grey = frame.astype(np.float32)
        out = np.empty_like(grey)
        draw_field(grey, self.reference, mode_shift, total_shift, np.float32(attenuation), out)
        return _rounded(out, frame)


def _rounded(picture: FloatArray, like: Frames) -> Frames:
    """Return a picture as whole grey levels of the kind of another one."""
    picture += 0.5
    return np.clip(picture, 0, np.iinfo(like.dtype).max, out=picture).astype(like.dtype)


def smooth_shapes(field: FullField, shape: tuple[int, ...]) -> ComplexArray:
    """Return shapes at every pixel, (r, rows, columns, 2): windows weighted by their information, zero where none sees."""
    windows, shapes = field.windows, field.shapes
    is_used = windows.sight > BLIND_SIGHT
    side = windows.side
    rows, columns = shape[0] // side + 2, shape[1] // side + 2
    place = np.round((windows.centres[is_used] - side / 2) / side).astype(int)
    inverse = np.zeros((is_used.sum(), 2, 2))
    both = windows.sight[is_used] == FULL_SIGHT
    inverse[both] = np.linalg.inv(shapes.covariance[is_used][both])
    edge = windows.sight[is_used] == EDGE_SIGHT
    normal = windows.normal[is_used][edge]
    spread = np.einsum("ni,nij,nj->n", normal, shapes.covariance[is_used][edge], normal)
    inverse[edge] = normal[:, :, None] * normal[:, None, :] / spread[:, None, None]
    gram, moment = np.zeros((rows, columns, 2, 2)), np.zeros((rows, columns, 2, shapes.shape.shape[2]), complex)
    np.add.at(gram, (place[:, 1], place[:, 0]), inverse)
    np.add.at(moment, (place[:, 1], place[:, 0]), inverse @ shapes.shape[is_used])
    blurred = gaussian_filter(gram, (SHAPE_SMOOTHING, SHAPE_SMOOTHING, 0, 0), mode="constant")
    has_window = np.trace(gram, axis1=2, axis2=3) > 0
    # A window that knows its shape worse than the largest motion tells nothing; no other one may lose of its motion.
    spread = float(np.trace(shapes.basis.covariance, axis1=1, axis2=2).min())
    largest = float((np.abs(shapes.shape[is_used]) ** 2).sum(axis=1).max(initial=0.0))
    blurred = blurred + spread / max(largest, 1e-12) * np.eye(2)
    blurred_moment = gaussian_filter(moment.real, (SHAPE_SMOOTHING, SHAPE_SMOOTHING, 0, 0),
                                     mode="constant") + 1j * gaussian_filter(
        moment.imag, (SHAPE_SMOOTHING, SHAPE_SMOOTHING, 0, 0), mode="constant")
    window_shapes = np.where(has_window[:, :, None, None], np.linalg.solve(blurred.astype(complex), blurred_moment), 0.0)
    return _enlarged(np.moveaxis(window_shapes, -1, 0), side, shape)


def _enlarged(coarse: ComplexArray, side: int, shape: tuple[int, ...]) -> ComplexArray:
    """Return coarse maps (r, rows, columns, 2) at every pixel, linear between window centres."""
    y = np.clip((np.arange(shape[0]) - 4 - side / 2) / side, 0, coarse.shape[1] - 1.001)
    x = np.clip((np.arange(shape[1]) - 4 - side / 2) / side, 0, coarse.shape[2] - 1.001)
    iy, ix = y.astype(int), x.astype(int)
    fy, fx = (y - iy)[None, :, None, None], (x - ix)[None, None, :, None]
    rows = coarse[:, iy] * (1 - fy) + coarse[:, iy + 1] * fy
    return np.asarray(rows[:, :, ix] * (1 - fx) + rows[:, :, ix + 1] * fx)


def _in_pixels(body: BodyMotion) -> ComplexArray:
    """Return coefficients (r, 2, 6) over pixels from the box' centre."""
    half = max(body.region.width, body.region.height) / 2
    return np.asarray(body.coefficients.reshape(-1, 2, 6) / half ** np.array([0, 1, 1, 2, 2, 2]))


def _pixels_near(boxes: np.ndarray, shape: tuple[int, ...], margin: int = 2) -> np.ndarray:
    """Return the pixels within `margin` of a box, (rows, columns) bool."""
    inside = np.zeros(shape, bool)
    for first_column, first_row, width, height in boxes:
        inside[max(0, first_row - margin):first_row + height + margin,
               max(0, first_column - margin):first_column + width + margin] = True
    return inside


def _fill_from_nearest(picture: FloatArray, hidden: np.ndarray) -> FloatArray:
    """Return a picture whose hidden pixels take the value of the nearest visible one."""
    if not hidden.any() or hidden.all():
        return picture
    nearest_pixels = distance_transform_edt(hidden, return_distances=False, return_indices=True)
    return np.ascontiguousarray(picture[nearest_pixels[0], nearest_pixels[1]])
