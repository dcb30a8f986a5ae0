"""Scene: bodies with textures before a background, each moved by modes; a virtual camera films it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.ndimage import gaussian_filter

from toolpoint._check import FloatArray, count, fail, floats
from toolpoint.vision.clip import Clip, FrameArray, Frames
from toolpoint.vision.rendering.texture import SPLINE_POINTS_PER_PIXEL

NOISE_POOL_SIZE = 1 << 22  # random numbers: frames draw their noise from one pool, which is quicker than new noise for each
Motion = Callable[[FloatArray], FloatArray]
TEXTURE_MARGIN = 12  # pixels around a body's box or the picture that its texture covers, so that motion finds texture there


@dataclass(frozen=True, eq=False)
class PicturedBody:
    """A body as the camera sees it.

    Parameters
    ----------
    name : str
    box : (left, top, width, height) in pixels
    texture : spline coefficients of the box and `TEXTURE_MARGIN` pixels around it, from `rendering.texture`
    field : (n_modes, 2, 6)
        Displacement (right, down) in pixels for unit modal amplitude over (1, a, b, a^2, a b, b^2), with a and b the
        distance from the box' centre to the right and down in units of `extent`.
    """

    name: str
    box: tuple[int, int, int, int]
    texture: FloatArray
    field: FloatArray

    def __post_init__(self) -> None:
        expected_shape = (SPLINE_POINTS_PER_PIXEL * (self.box[3] + 2 * TEXTURE_MARGIN),
                          SPLINE_POINTS_PER_PIXEL * (self.box[2] + 2 * TEXTURE_MARGIN))
        if self.texture.shape != expected_shape:
            fail("PicturedBody.texture", f"shape {self.texture.shape}",
                 f"must be {expected_shape}: {SPLINE_POINTS_PER_PIXEL} a pixel, the box and {TEXTURE_MARGIN} around it")
        object.__setattr__(self, "field", floats("PicturedBody.field", self.field, (None, 2, 6)))

    @property
    def extent(self) -> float:
        """Half the longer side of the box, pixels: the unit of `field`."""
        return max(self.box[2], self.box[3]) / 2

    @property
    def centre(self) -> tuple[float, float]:
        """Centre of the box, column and row."""
        return self.box[0] + (self.box[2] - 1) / 2, self.box[1] + (self.box[3] - 1) / 2

    def shape_at(self, points: FloatArray) -> FloatArray:
        """Return the true shapes at points (n, 2), column and row, pixels for unit amplitude, shape (n, 2, n_modes)."""
        return np.einsum("rik,nk->nir", self.field, quadratic_terms((points - self.centre) / self.extent))

    @cached_property
    def cover(self) -> FloatArray:
        """Covered fraction of each pixel, as spline coefficients like `texture`."""
        cover = np.zeros(self.texture.shape)
        edge = SPLINE_POINTS_PER_PIXEL * TEXTURE_MARGIN
        cover[edge:-edge, edge:-edge] = 1.0
        blurred = gaussian_filter(cover, SPLINE_POINTS_PER_PIXEL * 0.8)
        # Exactly nought and one away from edges, so that the kernel can skip the pixels that are all or none of a body.
        return np.where(blurred > 0.999, 1.0, np.where(blurred < 0.001, 0.0, blurred)).astype(np.float32)


def quadratic_terms(places: FloatArray) -> FloatArray:
    """Return (1, a, b, a^2, a b, b^2) of places (n, 2), shape (n, 6)."""
    a, b = places[..., 0], places[..., 1]
    return np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)


@dataclass(frozen=True, eq=False)
class Camera:
    """Rate, noise, shutter, light and shake of a virtual camera.

    Parameters
    ----------
    shape : rows and columns
    frame_rate : float
        Hz.
    noise : float
        Standard deviation of the sensor's noise, grey levels.
    row_delay : float
        Time between the exposures of neighbouring rows, s.
    flicker, flicker_frequency : float
        Relative amplitude and frequency (Hz) of the lamps.
    shake : function of times (n,), s, to displacements (n, 2) of the whole picture, pixels
    bits : int
        8 to 16; grey levels are those of 8 bits times 2^(bits - 8).
    """

    shape: tuple[int, int] = (720, 1280)
    frame_rate: float = 960.0
    noise: float = 2.0
    row_delay: float = 0.0
    flicker: float = 0.0
    flicker_frequency: float = 100.0
    shake: Motion | None = None
    bits: int = 8


@dataclass(frozen=True, eq=False)
class Scene2D:
    """Bodies, drawn in order, before a background, moved by modes.

    Parameters
    ----------
    bodies : sequence of PicturedBody
    amplitudes : function of times (n,), s, to modal amplitudes (n, n_modes)
    background : spline coefficients of the picture and `TEXTURE_MARGIN` pixels around it
    """

    bodies: tuple[PicturedBody, ...]
    amplitudes: Motion
    background: FloatArray

    def changed(self, amplitudes: Motion) -> Scene2D:
        """Return the scene with other motion."""
        return replace(self, amplitudes=amplitudes)


@dataclass(frozen=True, eq=False)
class RenderedFrames:
    """Frames drawn whenever they are read, the same each time: the seed determines the noise."""

    scene: Scene2D
    camera: Camera
    frames: int
    seed: int = 1
    noise_pool: FloatArray = field(default_factory=lambda: np.zeros(0, np.float32), repr=False)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.camera.shape

    @property
    def bits(self) -> int:
        """Bits of a pixel."""
        return self.camera.bits

    def chunks(self, size: int) -> Iterator[Frames]:
        """Yield the frames in order."""
        rng = np.random.default_rng(self.seed)
        rows, columns = self.shape
        factor = 2 ** (self.bits - 8)
        pool = (self.camera.noise * factor * rng.standard_normal(NOISE_POOL_SIZE + rows * columns, np.float32))
        for start in range(0, self.frames, size):
            yield self._drawn(range(start, min(start + size, self.frames)), pool, rng)

    def _drawn(self, numbers: range, pool: FloatArray, rng: np.random.Generator) -> Frames:
        from toolpoint.vision.rendering.kernels import expose

        camera, factor = self.camera, 2 ** (self.bits - 8)
        rows, columns = self.shape
        result = np.empty((len(numbers), rows, columns), np.uint8 if self.bits == 8 else np.uint16)
        times = np.asarray(numbers) / camera.frame_rate
        gain = factor * (1 + camera.flicker * np.sin(2 * np.pi * camera.flicker_frequency * times))
        for k, time in enumerate(times):
            start = int(rng.integers(NOISE_POOL_SIZE))
            expose(self.picture(float(time)), pool, start, np.float32(gain[k]), 2**self.bits - 1, result[k])
        return result

    def picture(self, time: float) -> FloatArray:
        """Return what the lens shows at a time (s), without noise, (rows, columns) in 8-bit grey levels."""
        from toolpoint.vision.rendering.kernels import draw_body

        scene, camera = self.scene, self.camera
        delays = np.arange(self.shape[0]) * camera.row_delay if camera.row_delay else np.zeros(1)
        amplitude = np.asarray(scene.amplitudes(time + delays), float)
        shake = np.zeros(2) if camera.shake is None else np.asarray(camera.shake(np.array([time])), float)[0]
        amplitude = np.concatenate([amplitude, np.broadcast_to(shake, (len(delays), 2))], axis=1)
        picture = np.zeros(self.shape, np.float32)
        rows, columns = self.shape
        if not hasattr(self, "_background_picture") or camera.shake is not None:
            draw_body(picture, scene.background, np.ones_like(scene.background), np.array([-TEXTURE_MARGIN, -TEXTURE_MARGIN]),
                      np.array([columns + 2 * TEXTURE_MARGIN, rows + 2 * TEXTURE_MARGIN]), np.zeros(2), 1.0, _SHAKE,
                      amplitude[:, -2:])
            object.__setattr__(self, "_background_picture", picture.copy())
        picture[:] = self._background_picture  # type: ignore[attr-defined]
        for body in scene.bodies:
            corner = np.array([body.box[0] - TEXTURE_MARGIN, body.box[1] - TEXTURE_MARGIN])
            size = np.array([body.box[2] + 2 * TEXTURE_MARGIN, body.box[3] + 2 * TEXTURE_MARGIN])
            motion_field = np.concatenate([body.field, _SHAKE])
            draw_body(picture, body.texture, body.cover, corner, size, np.array(body.centre), body.extent, motion_field,
                      amplitude)
        return picture


_SHAKE = np.zeros((2, 2, 6))
_SHAKE[0, 0, 0] = _SHAKE[1, 1, 0] = 1.0



def film(scene: Scene2D, camera: Camera, frames: int, *, rng: np.random.Generator, name: str = "rendered",
         keep: bool = True) -> Clip:
    """Return the clip that a camera takes of a scene.

    Parameters
    ----------
    scene : Scene2D
    camera : Camera
    frames : int
    rng : numpy.random.Generator
    keep : bool
        Hold the frames in memory; else they are drawn anew at every reading.
    """
    source = RenderedFrames(scene, camera, count("frames", frames, 2), int(rng.integers(2**31)))
    if not keep:
        return Clip(source, camera.frame_rate, camera.row_delay, name=name)
    stack = np.empty((frames, *camera.shape), np.uint8 if camera.bits == 8 else np.uint16)
    frame_index = 0
    for chunk in source.chunks(32):
        stack[frame_index:frame_index + len(chunk)] = chunk
        frame_index += len(chunk)
    return Clip(FrameArray(stack, camera.bits), camera.frame_rate, camera.row_delay, name=name)


def decays(frequency: Sequence[float], ratio: Sequence[float], start: float = 0.0) -> Motion:
    r"""Return modal amplitudes :math:`e^{-\zeta \omega t} \sin(\omega_d t)` of an impulse at `start` (s), zero before."""
    omega, zeta = 2 * np.pi * np.asarray(frequency, float), np.asarray(ratio, float)
    damped = omega * np.sqrt(1 - zeta**2)

    def amplitudes(times: FloatArray) -> FloatArray:
        t = np.asarray(times, float)[:, None] - start
        elapsed = np.maximum(t, 0.0)
        return np.where(t >= 0, np.exp(-zeta * omega * elapsed) * np.sin(damped * elapsed), 0.0)
    return amplitudes
