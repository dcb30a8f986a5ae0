"""A camera and moving bodies that share no code with the package: textures painted in ink, seen by supersampling, 8 bit.

Bodies are painted eight times finer than the pixels and looked up where each moves; a pixel is the mean of sub-samples after
the lens's blur, so no shift of a picture is computed as the package computes it. Light has photon noise, the sensor read noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from scipy.ndimage import gaussian_filter

# Ink is soft by half a pixel: sharper ink would alias in the sub-samples, which a pixel of glass and silicon does not do.
FINE, SUB, RIM, LENS = 8, 3, 6, 4.0


@dataclass
class Body:
    """A box (left, top, width, height), its ink (FINE samples a pixel) and its motion for unit amplitude of every mode.

    field : (modes, 2, 6) over (1, a, b, a^2, a b, b^2), a and b pixels from the centre over the half length; or 2-D motion.
    """

    name: str
    box: tuple[int, int, int, int]
    ink: np.ndarray
    field: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Centre, column and row (pixel centres are whole numbers)."""
        left, top, width, height = self.box
        return np.array([left + (width - 1) / 2, top + (height - 1) / 2])

    @property
    def extent(self) -> float:
        """Half length."""
        return max(self.box[2:]) / 2

    def motion(self, place: np.ndarray) -> np.ndarray:
        """Motion (modes, 2) of the material at a place."""
        a, b = (place - self.centre) / self.extent
        return self.field @ np.array([1, a, b, a * a, a * b, b * b])


@dataclass
class Light:
    """Camera and light; times in s."""

    rate: float
    shape: tuple[int, int]
    photons: float = 60.0  # electrons a grey level
    read: float = 1.0  # grey levels
    blur: float = 0.9
    row_delay: float = 0.0
    exposure: float = 0.0  # share of the frame's time in which the shutter is open
    flicker: float = 0.0
    mains: float = 50.0
    slope: float = 0.0  # of the lamp over the picture's width
    shake: Callable[[np.ndarray], np.ndarray] | None = None
    zoom: Callable[[np.ndarray], np.ndarray] | None = field(default=None)  # out-of-plane motion of all bodies


def speckle(rng: np.random.Generator, box: tuple[int, int, int, int], *, grey: float, contrast: float, grain: float = 3.0
            ) -> np.ndarray:
    """Paint spots of random size and place: (height + 2 RIM, width + 2 RIM) times FINE."""
    rows, columns = (box[3] + 2 * RIM) * FINE, (box[2] + 2 * RIM) * FINE
    coarse = rng.standard_normal((rows // 4 + 2, columns // 4 + 2))
    coarse = gaussian_filter(coarse, grain * FINE / 8)
    paint = np.kron(np.where(coarse > 0, 1.0, -1.0), np.ones((4, 4)))[:rows, :columns]
    return (grey + contrast * gaussian_filter(paint, LENS)).astype(np.float32)


def stripes(rng: np.random.Generator, box: tuple[int, int, int, int], *, grey: float, contrast: float, period: float
            ) -> np.ndarray:
    """Paint a chequered pattern that repeats every `period` pixels both ways."""
    y, x = np.mgrid[:(box[3] + 2 * RIM) * FINE, :(box[2] + 2 * RIM) * FINE] / FINE
    turn = rng.uniform(0, 0.4)
    u, v = x * np.cos(turn) + y * np.sin(turn), -x * np.sin(turn) + y * np.cos(turn)
    paint = np.sign(np.sin(2 * np.pi * u / period)) * np.sign(np.sin(2 * np.pi * v / period))
    return (grey + contrast * gaussian_filter(paint, LENS)).astype(np.float32)


@njit(cache=True)
def _look(fine, ink, left, top, width, height, extent, moves, wall):
    # fine: (rows SUB, columns SUB), one body over it; moves (rows, 2, 6): every row has its own time.
    centre_x, centre_y = left + (width - 1) / 2, top + (height - 1) / 2
    for i in range(max(0, (top - 4) * SUB), min(fine.shape[0], (top + height + 4) * SUB)):
        y = (i + 0.5) / SUB - 0.5
        m = moves[i // SUB]
        for j in range(max(0, (left - 4) * SUB), min(fine.shape[1], (left + width + 4) * SUB)):
            x = (j + 0.5) / SUB - 0.5
            at_x, at_y = x, y
            for _ in range(2):
                a, b = (at_x - centre_x) / extent, (at_y - centre_y) / extent
                u = m[0, 0] + m[0, 1] * a + m[0, 2] * b + m[0, 3] * a * a + m[0, 4] * a * b + m[0, 5] * b * b
                v = m[1, 0] + m[1, 1] * a + m[1, 2] * b + m[1, 3] * a * a + m[1, 4] * a * b + m[1, 5] * b * b
                at_x, at_y = x - u, y - v
            # A sub-sample on the rim is covered in part: rims move smoothly, not by sub-samples.
            inside = min(at_x - left + 0.5, left + width - 0.5 - at_x, at_y - top + 0.5, top + height - 0.5 - at_y)
            share = 1.0 if wall else min(1.0, max(0.0, inside * SUB + 0.5))
            if share == 0.0:
                continue
            p, q = (at_y - top + 0.5 + RIM) * FINE - 0.5, (at_x - left + 0.5 + RIM) * FINE - 0.5
            k, l = int(np.floor(p)), int(np.floor(q))
            if k < 0 or l < 0 or k + 1 >= ink.shape[0] or l + 1 >= ink.shape[1]:
                continue
            f, g = p - k, q - l
            paint = ((1 - f) * ((1 - g) * ink[k, l] + g * ink[k, l + 1])
                     + f * ((1 - g) * ink[k + 1, l] + g * ink[k + 1, l + 1]))
            fine[i, j] = (1 - share) * fine[i, j] + share * paint


def film(bodies: list[Body], wall: Body, modal: Callable[[np.ndarray], np.ndarray], light: Light, frames: int,
         rng: np.random.Generator) -> np.ndarray:
    """Return the frames (n, rows, columns), uint8; `modal` gives amplitudes (times, modes) at times in s."""
    rows, columns = light.shape
    result = np.empty((frames, rows, columns), np.uint8)
    places = (0.0,) if light.exposure == 0 else (-0.28868, 0.28868)  # Gauss's points of the open time
    for n in range(frames):
        picture = np.zeros((rows, columns))
        for place in places:
            t = (n + place * light.exposure) / light.rate + np.arange(rows) * light.row_delay
            picture += _seen(bodies, wall, modal, light, t) / len(places)
        # So many electrons (thousands a pixel) that their Poisson law is normal.
        spread = np.sqrt(np.maximum(picture, 0) / light.photons + light.read**2)
        noisy = picture + spread * rng.standard_normal((rows, columns))
        result[n] = np.clip(np.round(noisy), 0, 255)
    return result


def _seen(bodies: list[Body], wall: Body, modal: Callable[[np.ndarray], np.ndarray], light: Light, t: np.ndarray) -> np.ndarray:
    rows, columns = light.shape
    fine = np.zeros((rows * SUB, columns * SUB), np.float32)
    amplitude = modal(t)
    shake = np.zeros((rows, 2)) if light.shake is None else light.shake(t)
    zoom = np.zeros(rows) if light.zoom is None else light.zoom(t)
    for body in (wall, *bodies):
        moves = np.einsum("tr,rik->tik", amplitude, body.field) if body is not wall else np.zeros((rows, 2, 6))
        moves[:, :, 0] += shake
        if body is not wall:
            moves[:, 0, 1] += zoom
            moves[:, 1, 2] += zoom
        _look(fine, body.ink, *body.box, body.extent, moves, body is wall)
    soft = gaussian_filter(fine, light.blur * SUB, truncate=3.5, mode="nearest")
    picture = soft.reshape(rows, SUB, columns, SUB).mean(axis=(1, 3))
    lamp = 1 + light.flicker * np.cos(4 * np.pi * light.mains * t)[:, None] * (
        1 + light.slope * np.linspace(-1, 1, columns)[None, :])
    return picture * lamp


def ringing(poles: np.ndarray, size: np.ndarray, start: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return modal amplitudes after a blow at `start` s: velocities jump, so sines."""
    def at(times: np.ndarray) -> np.ndarray:
        t = np.asarray(times)[:, None] - start
        return np.where(t > 0, size * np.exp(poles.real * np.maximum(t, 0)) * np.sin(poles.imag * t), 0.0)
    return at
