"""Survey of a clip in a first pass: brightness, saturation, repeated, quiet and reference frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint._doubt import Doubt
from toolpoint.vision.clip import Clip

SURVEY_BLOCK_SIDE = 16  # pixels of a block
MAX_BLOCK_MEANS = 60_000_000  # block means of a clip that are held: 240 MB
MIN_CLIP_FRAMES = 16
QUIET_FRAME_COUNT = 64  # frames from which the noise is taken
MAX_SATURATED_FRACTION = 0.02  # of a window or picture: share of black or white pixels
MOVING_BLOCK_COUNT = 200  # blocks that change most, by which places of the machine are compared
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Survey:
    """Result of the first pass over a clip.

    frames : how many; means : (frames, rows, columns) of blocks of `side` pixels, grey levels; saturated : (rows, columns)
    share of the frames in which a pixel is black or white; repeats : frames equal to the one before; quiet : first and
    last (excluded) of the frames with the least motion; reference_frames : numbers of frames in which the machine is at the
    same place; doubts : what is wrong with time stamps and the file.
    """

    frames: int
    side: int
    means: FloatArray
    saturated: FloatArray
    repeats: tuple[int, ...]
    quiet: tuple[int, int]
    reference_frames: IndexArray
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
    side = SURVEY_BLOCK_SIDE if min(rows, columns) >= 4 * SURVEY_BLOCK_SIDE else max(4, min(rows, columns) // 4)
    extremes = np.zeros((rows, columns), np.int32)
    parts: list[FloatArray] = []
    repeats: list[int] = []
    last_frame, frame_index, sampled_count = None, 0, 0
    for frames in clip.chunks():
        if (frame_index + len(frames)) * (rows // side) * (columns // side) > MAX_BLOCK_MEANS:
            fail("clip", f"more than {frame_index} frames of {columns} x {rows} pixels", "is too long to be surveyed at once",
                 remedy="cut it to the decay, or state a region")
        means = np.empty((len(frames), rows // side, columns // side), np.float32)
        sum_blocks(frames, side, means, extremes, clip.white)
        previous_frames = [last_frame, *frames[:-1]] if last_frame is not None else [None, *frames[:-1]]
        repeats += [frame_index + k for k, (frame, previous) in enumerate(zip(frames, previous_frames, strict=True))
                    if previous is not None and _equal(frame, previous)]
        parts.append(means)
        last_frame, frame_index = frames[-1].copy(), frame_index + len(frames)
        sampled_count = sampled_count + -(-len(frames) // 8)
        if progress is not None:
            progress("reading frames", frame_index, 0)
    if frame_index < MIN_CLIP_FRAMES:
        fail("clip", f"{frame_index} frames", f"must be {MIN_CLIP_FRAMES} at least", remedy="film longer")
    block_means = np.concatenate(parts)
    return Survey(frame_index, side, block_means, extremes / max(sampled_count, 1), tuple(repeats),
                  _find_quiet_run(block_means), _choose_reference_frames(block_means),
                  _time_stamp_doubts(clip))


def _equal(first: np.ndarray, second: np.ndarray) -> bool:
    middle = first.shape[0] // 2
    return bool((first[middle] == second[middle]).all()) and bool((first == second).all())


def _find_quiet_run(means: FloatArray) -> tuple[int, int]:
    """Return the run of frames whose block means keep closest to each other: least motion, and no lamp takes part."""
    frames = len(means)
    run = min(QUIET_FRAME_COUNT, frames // 2)
    flat = means.reshape(frames, -1)
    flat = flat / np.maximum(flat.mean(axis=1, keepdims=True), 1e-9)
    change = np.abs(np.diff(flat, axis=0)).mean(axis=1)
    energy = np.convolve(change, np.ones(run - 1) / (run - 1), "valid")
    start = int(np.argmin(energy))
    return start, start + run


def _choose_reference_frames(means: FloatArray) -> IndexArray:
    """Return the frames nearest to the middle place of the motion: their mean is sharp, however large the motion.

    Places are compared by the first three principal components of the block means that change most.
    """
    flat = means.reshape(len(means), -1)
    flat = flat / np.maximum(flat.mean(axis=1, keepdims=True), 1e-9)
    flat = flat - np.median(flat, axis=0)
    moving_blocks = np.argsort(-flat.var(axis=0))[:MOVING_BLOCK_COUNT]
    components, singular_values, _ = np.linalg.svd(flat[:, moving_blocks], full_matrices=False)
    distance = ((components[:, :3] * singular_values[:3]) ** 2).sum(axis=1)
    frame_count = min(max(QUIET_FRAME_COUNT // 4, len(means) // 8), QUIET_FRAME_COUNT)
    return np.sort(np.argsort(distance, kind="stable")[:frame_count])


def _time_stamp_doubts(clip: Clip) -> tuple[Doubt, ...]:
    times = getattr(clip.source, "times", None)
    header = getattr(clip.source, "header", None)
    if times is None or header is None:
        return ()
    from toolpoint.vision.reading.video import stamp_doubts

    return tuple(stamp_doubts(np.asarray(times, float), header))
