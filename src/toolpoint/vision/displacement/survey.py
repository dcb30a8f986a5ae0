"""Survey: the first pass over a clip, what its frames are like before anything is measured in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Clip

SIDE = 16
MOST_VALUES = 60_000_000
FEWEST_FRAMES = 16
QUIET_FRAMES = 64
SATURATED = 0.02
LIVELY = 200
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Survey:
    """What the first pass tells.

    frames : how many; means : (frames, rows, columns) of blocks of `side` pixels, grey levels; saturated : (rows, columns)
    share of the frames in which a pixel is black or white; repeats : frames equal to the one before; quiet : first and
    last (excluded) of the frames with the least motion; alike : numbers of frames in which the machine is at the same place;
    doubts : what is wrong with time stamps and the file.
    """

    frames: int
    side: int
    means: FloatArray
    saturated: FloatArray
    repeats: tuple[int, ...]
    quiet: tuple[int, int]
    alike: IndexArray
    doubts: tuple[Doubt, ...]

    @property
    def brightness(self) -> FloatArray:
        """Relative brightness of every frame less one, (frames,)."""
        level = self.means.reshape(self.frames, -1).mean(axis=1)
        return level / level.mean() - 1


def survey_clip(clip: Clip, progress: Progress | None = None) -> Survey:
    """Read a clip once and return what it is like.

    Raises
    ------
    ToolpointError
        For fewer than 16 frames, or a clip too long for its block means to be held.
    """
    from toolpoint.vision.displacement.kernels import sum_blocks

    rows, columns = clip.shape
    side = SIDE if min(rows, columns) >= 4 * SIDE else max(4, min(rows, columns) // 4)
    extremes = np.zeros((rows, columns), np.int32)
    parts: list[FloatArray] = []
    repeats: list[int] = []
    last, at, sampled = None, 0, 0
    for frames in clip.chunks():
        if (at + len(frames)) * (rows // side) * (columns // side) > MOST_VALUES:
            fail("clip", f"more than {at} frames of {columns} x {rows} pixels", "is too long to be surveyed at once",
                 remedy="cut it to the decay, or state a region")
        means = np.empty((len(frames), rows // side, columns // side), np.float32)
        sum_blocks(frames, side, means, extremes, clip.white)
        before = [last, *frames[:-1]] if last is not None else [None, *frames[:-1]]
        repeats += [at + k for k, (frame, old) in enumerate(zip(frames, before, strict=True))
                    if old is not None and _equal(frame, old)]
        parts.append(means)
        last, at, sampled = frames[-1].copy(), at + len(frames), sampled + -(-len(frames) // 8)
        if progress is not None:
            progress("reading frames", at, 0)
    if at < FEWEST_FRAMES:
        fail("clip", f"{at} frames", f"must be {FEWEST_FRAMES} at least", remedy="film longer")
    whole = np.concatenate(parts)
    return Survey(at, side, whole, extremes / max(sampled, 1), tuple(repeats), _quiet(whole), _alike(whole),
                  _stamps(clip))


def _equal(first: np.ndarray, second: np.ndarray) -> bool:
    middle = first.shape[0] // 2
    return bool((first[middle] == second[middle]).all()) and bool((first == second).all())


def _quiet(means: FloatArray) -> tuple[int, int]:
    """Return the run of frames whose block means keep closest to each other: least motion, and no lamp takes part."""
    frames = len(means)
    run = min(QUIET_FRAMES, frames // 2)
    flat = means.reshape(frames, -1)
    flat = flat / np.maximum(flat.mean(axis=1, keepdims=True), 1e-9)
    change = np.abs(np.diff(flat, axis=0)).mean(axis=1)
    energy = np.convolve(change, np.ones(run - 1) / (run - 1), "valid")
    start = int(np.argmin(energy))
    return start, start + run


def _alike(means: FloatArray) -> IndexArray:
    """Return the frames nearest to the middle place of the motion: their mean is sharp, however large the motion.

    Places are compared by the first three principal components of the block means that change most.
    """
    flat = means.reshape(len(means), -1)
    flat = flat / np.maximum(flat.mean(axis=1, keepdims=True), 1e-9)
    flat = flat - np.median(flat, axis=0)
    lively = np.argsort(-flat.var(axis=0))[:LIVELY]
    left, size, _ = np.linalg.svd(flat[:, lively], full_matrices=False)
    distance = ((left[:, :3] * size[:3]) ** 2).sum(axis=1)
    number = min(max(QUIET_FRAMES // 4, len(means) // 8), QUIET_FRAMES)
    return np.sort(np.argsort(distance, kind="stable")[:number])


def _stamps(clip: Clip) -> tuple[Doubt, ...]:
    times = getattr(clip.source, "times", None)
    header = getattr(clip.source, "header", None)
    if times is None or header is None:
        return ()
    from toolpoint.vision.reading.video import stamp_doubts

    return tuple(stamp_doubts(np.asarray(times, float), header))
