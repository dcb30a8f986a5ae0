"""Sample of a film: a column with a head that ring after a blow, beside a floor that stands still, and a camera that shakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray

_FRAME_RATE_HZ, _FRAME_COUNT, _FILM_ROWS, _FILM_COLUMNS = 500.0, 500, 112, 128
_FILM_FREQUENCIES_HZ, _FILM_DAMPING_RATIOS = np.array([38.0, 71.0]), np.array([0.012, 0.018])
_HEAD_SHAPE, _COLUMN_SHAPE = np.array([1.0, 1.0]), np.array([0.5, -0.7])  # motion across the picture in either mode
_FILM_MOTION_PIXELS = np.array([0.25, 0.12])  # of the head just after the blow
_CAMERA_SHAKE_PIXELS, _GREY_NOISE_LEVELS, _SPECKLE_COUNT = 0.05, 1.5, 120
_BLOW_FRAME = 40


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the film; return what was put in, and the commands."""
    rng, time = np.random.default_rng(3), (np.arange(_FRAME_COUNT) - _BLOW_FRAME) / _FRAME_RATE_HZ
    decay = np.exp(-np.outer(time.clip(0), 2 * np.pi * _FILM_FREQUENCIES_HZ * _FILM_DAMPING_RATIOS))
    waves = np.sin(2 * np.pi * np.outer(time, _FILM_FREQUENCIES_HZ * np.sqrt(1 - _FILM_DAMPING_RATIOS**2)))
    ringing = np.where(time[:, None] < 0, 0.0, decay * waves)
    shake = _CAMERA_SHAKE_PIXELS * np.sin(2 * np.pi * 3.1 * time)
    head, column = (ringing @ (_FILM_MOTION_PIXELS * shape) for shape in (_HEAD_SHAPE, _COLUMN_SHAPE))
    # Rows of the head, of the column, and of the floor that stands still, each with a texture of its own.
    parts = [(0, 36, head + shake), (36, 76, column + shake), (76, _FILM_ROWS, shake)]
    film = np.empty((_FRAME_COUNT, _FILM_ROWS, _FILM_COLUMNS))
    for first, last, shift in parts:
        film[:, first:last] = _speckle(rng, last - first, shift)
    film += _GREY_NOISE_LEVELS * rng.normal(size=film.shape)
    np.save(folder / "film.npy", np.clip(np.round(film), 0, 255).astype(np.uint8))
    truth = [f"A head on a column after a blow from the side, filmed at {_FRAME_RATE_HZ:g} frames a second: modes at "
             f"{_FILM_FREQUENCIES_HZ[0]:g} Hz ({100 * _FILM_DAMPING_RATIOS[0]:g} %) and {_FILM_FREQUENCIES_HZ[1]:g} Hz "
             f"({100 * _FILM_DAMPING_RATIOS[1]:g} %).",
             "The column moves half as far as the head in the first mode, and 0.7 times against it in the second; at most a "
             "third of a pixel.",
             f"The camera shakes by {_CAMERA_SHAKE_PIXELS:g} pixels at 3.1 Hz; the floor in the lowest rows stands still."]
    return truth, [f"toolpoint video film.npy --fps {_FRAME_RATE_HZ:g} --body column=0,36,128,40 --body head=0,0,128,36 "
                   "--background 0,78,128,32 --scale 2 --view xz"]


def _speckle(rng: np.random.Generator, row_count: int, shift: FloatArray) -> FloatArray:
    """Return grey frames (n_frames, rows, columns) of round spots that move across by `shift` (n_frames,), pixels, exactly."""
    rows, columns = np.arange(row_count)[:, None], np.arange(_FILM_COLUMNS)
    frames = np.full((shift.size, row_count, _FILM_COLUMNS), 110.0)
    for _ in range(_SPECKLE_COUNT):
        row, column, level = rng.uniform(0, row_count), rng.uniform(0, _FILM_COLUMNS), rng.uniform(-90, 90)
        across = np.exp(-(columns - column - shift[:, None]) ** 2 / 5)
        frames += level * np.exp(-(rows - row) ** 2 / 5)[None] * across[:, None, :]
    return frames
