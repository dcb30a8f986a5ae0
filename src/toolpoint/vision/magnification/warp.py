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
from toolpoint.vision.displacement.points import BLIND, BOTH, EDGE
from toolpoint.vision.modes.bodies import EDGE_MARGIN, BodyMotion
from toolpoint.vision.modes.full_field import FullField

SMOOTH = 0.7  # windows
RIM = 2
# Owners of pixels that no body covers: the wall, and its part close to a body, where the body's edge may show.
NOWHERE, BESIDE = -1, -2
LARGEST_FACTOR = 1e4
# Windows outside all bodies that must move, by how many deviations, and by what share of the largest motion.
FEWEST_MOVING, CLEAR, ELSEWHERE = 3, 5.0, 0.05


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
        chosen = None if numbers is None else set(numbers)
        draw = self._drawing()
        at = 0
        for frames in self.scan.clip.chunks():
            for k, frame in enumerate(frames, start=at):
                if k >= self.first and (chosen is None or k in chosen):
                    gains = np.exp(self.poles * (k - self.first) / self.scan.clip.frame_rate)
                    yield draw(frame, gains, mode, factor, attenuation)
            at += len(frames)

    def still(self, mode: int, factor: float, phase: complex = 1.0) -> Frames:
        """Return the picture at rest deformed by one mode alone, at a phase of its motion."""
        _check(mode, self.poles.size, factor, 1.0)
        gains = np.zeros(self.poles.size, complex)
        gains[mode] = phase
        rest = self.scan.reference.picture
        levels = np.uint8 if self.scan.clip.source.bits == 8 else np.uint16
        return self._drawing()(np.clip(rest + 0.5, 0, self.scan.clip.white).astype(levels), gains, mode, factor, 1.0)

    def _drawing(self) -> _Layers | _Field:
        known = [body for body in self.bodies if "unknown" not in body.orders]
        if not known:
            return _Field(self.scan, self.field)
        return _Layers(self.scan, known, _Field(self.scan, self.field) if self._moves_elsewhere(known) else None)

    def _moves_elsewhere(self, bodies: Sequence[BodyMotion]) -> bool:
        """Return whether windows outside all bodies move, beyond doubt and by a share of the largest motion."""
        windows, shapes = self.field.windows, self.field.shapes
        free = windows.sight > BLIND
        half = windows.side / 2 + EDGE_MARGIN
        for body in bodies:
            x, y = windows.centres[:, 0] - body.region.left, windows.centres[:, 1] - body.region.top
            free &= (x < -half) | (y < -half) | (x > body.region.width + half) | (y > body.region.height + half)
        if not free.any():
            return False
        size, sure = np.abs(shapes.shape[free]), shapes.deviation()[free]
        largest = np.abs(shapes.shape[windows.sight > BLIND]).max(axis=(0, 1))
        moving = ((size > CLEAR * sure) & (size > ELSEWHERE * largest)).any(axis=(1, 2))
        return int(moving.sum()) >= FEWEST_MOVING


def _check(mode: int, count: int, factor: float, attenuation: float) -> None:
    if not 0 <= mode < count:
        fail("mode", str(mode + 1), f"must be 1 .. {count}")
    if not 0 <= scalar("factor", factor) <= LARGEST_FACTOR:
        fail("factor", f"{factor:g}", f"must be 0 .. {LARGEST_FACTOR:g}")
    if not 0 <= scalar("attenuation", attenuation) <= 1:
        fail("attenuation", f"{attenuation:g}", "must be 0 .. 1")


class _Layers:
    """Draws frames of which each body is a layer."""

    def __init__(self, scanned: Scan, bodies: Sequence[BodyMotion], elsewhere: _Field | None = None) -> None:
        self.elsewhere = elsewhere
        rest = np.ascontiguousarray(scanned.reference.picture, np.float32)
        self.rest = rest
        # Edges are blurred over a pixel or two outside: they move with the body.
        self.boxes = np.array([(b.region.left - RIM, b.region.top - RIM, b.region.width + 2 * RIM, b.region.height + 2 * RIM)
                               for b in bodies])
        around = _grown(self.boxes, rest.shape)
        self.owner = np.where(around, BESIDE, NOWHERE).astype(np.int16)
        for k, (left, top, width, height) in enumerate(self.boxes):
            self.owner[max(0, top):top + height, max(0, left):left + width] = k
        self.wall = _filled(rest, around)
        self.fills = np.stack([_filled(rest, self.owner != k) if (self.owner == k).any() else rest for k in range(len(bodies))])
        self.fields = np.stack([_in_pixels(body) for body in bodies])

    def __call__(self, frame: Frames, gains: ComplexArray, mode: int, factor: float, attenuation: float) -> Frames:
        from toolpoint.vision.magnification.kernels import draw_layers, draw_wall

        parts = (self.fields * gains[:, None, None]).real  # (bodies, modes, 2, 6)
        further = (factor - 1) * parts[:, mode]
        grey, share = frame.astype(np.float32), np.float32(attenuation)
        out = np.empty_like(grey)
        if self.elsewhere is None:
            draw_wall(grey, self.rest, self.wall, self.owner, share, out)
        else:
            drawn = self.elsewhere(frame, gains, mode, factor, attenuation).astype(np.float32)
            draw_wall(drawn, drawn, self.wall, self.owner, np.float32(0), out)
        draw_layers(grey, self.rest, self.fills, self.owner, self.boxes, further, parts.sum(axis=1) + further, share, out)
        return _rounded(out, frame)


class _Field:
    """Draws frames by a smooth field of the windows' shapes."""

    def __init__(self, scanned: Scan, field: FullField) -> None:
        self.rest = np.ascontiguousarray(scanned.reference.picture, np.float32)
        self.maps = smooth_shapes(field, self.rest.shape)

    def __call__(self, frame: Frames, gains: ComplexArray, mode: int, factor: float, attenuation: float) -> Frames:
        from toolpoint.vision.magnification.kernels import draw_field

        further = ((factor - 1) * (self.maps[mode] * gains[mode]).real).astype(np.float32)
        whole = (np.tensordot(gains, self.maps, axes=(0, 0)).real + further).astype(np.float32)
        grey = frame.astype(np.float32)
        out = np.empty_like(grey)
        draw_field(grey, self.rest, further, whole, np.float32(attenuation), out)
        return _rounded(out, frame)


def _rounded(picture: FloatArray, like: Frames) -> Frames:
    """Return a picture as whole grey levels of the kind of another one."""
    picture += 0.5
    return np.clip(picture, 0, np.iinfo(like.dtype).max, out=picture).astype(like.dtype)


def smooth_shapes(field: FullField, shape: tuple[int, ...]) -> ComplexArray:
    """Return shapes at every pixel, (r, rows, columns, 2): windows weighted by their certainty, zero where none sees."""
    windows, shapes = field.windows, field.shapes
    used = windows.sight > BLIND
    side = windows.side
    rows, columns = shape[0] // side + 2, shape[1] // side + 2
    place = np.round((windows.centres[used] - side / 2) / side).astype(int)
    inverse = np.zeros((used.sum(), 2, 2))
    both = windows.sight[used] == BOTH
    inverse[both] = np.linalg.inv(shapes.covariance[used][both])
    edge = windows.sight[used] == EDGE
    normal = windows.normal[used][edge]
    spread = np.einsum("ni,nij,nj->n", normal, shapes.covariance[used][edge], normal)
    inverse[edge] = normal[:, :, None] * normal[:, None, :] / spread[:, None, None]
    gram, moment = np.zeros((rows, columns, 2, 2)), np.zeros((rows, columns, 2, shapes.shape.shape[2]), complex)
    np.add.at(gram, (place[:, 1], place[:, 0]), inverse)
    np.add.at(moment, (place[:, 1], place[:, 0]), inverse @ shapes.shape[used])
    blurred = gaussian_filter(gram, (SMOOTH, SMOOTH, 0, 0), mode="constant")
    seen = np.trace(gram, axis1=2, axis2=3) > 0
    # A window that knows its shape worse than the largest motion tells nothing; no other one may lose of its motion.
    spread = float(np.trace(shapes.basis.covariance, axis1=1, axis2=2).min())
    largest = float((np.abs(shapes.shape[used]) ** 2).sum(axis=1).max(initial=0.0))
    blurred = blurred + spread / max(largest, 1e-12) * np.eye(2)
    mixed = gaussian_filter(moment.real, (SMOOTH, SMOOTH, 0, 0), mode="constant") + 1j * gaussian_filter(
        moment.imag, (SMOOTH, SMOOTH, 0, 0), mode="constant")
    coarse = np.where(seen[:, :, None, None], np.linalg.solve(blurred.astype(complex), mixed), 0.0)
    return _enlarged(np.moveaxis(coarse, -1, 0), side, shape)


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


def _grown(boxes: np.ndarray, shape: tuple[int, ...], by: int = 2) -> np.ndarray:
    inside = np.zeros(shape, bool)
    for left, top, width, height in boxes:
        inside[max(0, top - by):top + height + by, max(0, left - by):left + width + by] = True
    return inside


def _filled(picture: FloatArray, hidden: np.ndarray) -> FloatArray:
    """Return a picture whose hidden pixels are those nearest to them that are not."""
    if not hidden.any() or hidden.all():
        return picture
    at = distance_transform_edt(hidden, return_distances=False, return_indices=True)
    return np.ascontiguousarray(picture[at[0], at[1]])
