"""Force records of a cutting test: one feed each or with a column of the feed, folded on a revolution."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting.force.calibration import revolution
from toolpoint.vibration import Record

MAX_FIT_SAMPLES = 360  # of a revolution
MIN_TURN_SAMPLES = 24  # of a revolution, below which forces cannot be folded
MIN_REPEATING_FRACTION = 0.5  # of the forces' power that follows the revolution


def split_by_feed(records: Sequence[tuple[str, Record]], feeds: Sequence[float] | None) -> list[tuple[float, Record, str]]:
    """Return (feed per tooth in m, forces x, y and z where known, name) of every record or of every feed in its column."""
    if feeds is not None and len(feeds) != len(records):
        raise ToolpointError(f"`feed`: {len(feeds)} feeds for {len(records)} files; must be one for each file, in their order")
    result = []
    for i, (path, record) in enumerate(records):
        forces = _forces(path, record)
        if feeds is not None:
            parts = [(feeds[i], forces)]
        elif "feed" in record.quantities:
            parts = _steps(path, forces, record.samples[:, record.quantities.index("feed")])
        else:
            raise ToolpointError(f"`feed`: missing; {path} has no column 'feed' (m, or 'feed [mm]'); give the feed per tooth "
                                 "of each file in mm, for example `feed` 0.05,0.1")
        for feed, part in parts:
            # No tooth takes a chip of 10 mm: such a number is a feed in mm, or one per minute.
            if not 0 < feed <= 0.01:
                raise ToolpointError(f"{path}: feed per tooth {1e3 * feed:g} mm; must be above 0 and at most 10 mm")
            result.append((feed, part, Path(path).name))
    ways = min(part.samples.shape[1] for _, part, _ in result)
    return [(feed, part.selected(range(ways)), name) for feed, part, name in result]


def _forces(path: str, record: Record) -> Record:
    """Return the forces x, y and, where measured, z of a record in this order; raises for one without x or y."""
    columns = list(zip(record.channels, record.quantities, strict=True))
    column_of = {dof.direction: i for i, (dof, kind) in enumerate(columns) if kind == "force"}
    missing_directions = [way for way in "xy" if f"+{way}" not in column_of]
    if missing_directions:
        held = ", ".join(f"{dof} {kind}" for dof, kind in columns)
        raise ToolpointError(f"{path}: no force along {' and '.join(missing_directions)}; it holds {held}; name the columns "
                             f"Fx, Fy and Fz")
    return record.selected([column_of[f"+{way}"] for way in "xyz" if f"+{way}" in column_of])


def _steps(path: str, forces: Record, feed: FloatArray) -> list[tuple[float, Record]]:
    """Return the parts of a record over which the column of the feed stays the same."""
    ends = [0, *(np.flatnonzero(np.diff(feed) != 0) + 1).tolist(), feed.size]
    parts = []
    for first, last in pairwise(ends):
        if feed[first] > 0:
            parts.append((float(feed[first]), Record(forces.samples[first:last], forces.sample_rate, forces.channels,
                                                     forces.quantities, forces.units)))
    if not parts:
        raise ToolpointError(f"{path}: the column 'feed' is nowhere above zero; must be the feed per tooth, m, or 'feed [mm]'")
    return parts


def question_repetition(records: Sequence[tuple[float, Record, str]], speed: float, teeth: int) -> list[Doubt]:
    """Return a doubt on every record whose forces do not repeat with the revolution: its speed is another one."""
    lines = []
    for _, part, name in records:
        moving = part.samples - part.samples.mean(axis=0)
        bins = (np.arange(len(moving)) / part.sample_rate * speed / 60 % 1 * MIN_TURN_SAMPLES).astype(int)
        count = np.maximum(np.bincount(bins, minlength=MIN_TURN_SAMPLES), 1)
        means = np.stack([np.bincount(bins, moving[:, k], MIN_TURN_SAMPLES) / count for k in range(moving.shape[1])], axis=1)
        share = float((means[bins] ** 2).sum() / max(float((moving**2).sum()), 1e-300))
        if share < MIN_REPEATING_FRACTION and len(moving) * speed / 60 > 3 * part.sample_rate:
            power = (np.abs(np.fft.rfft(moving, axis=0)) ** 2).sum(axis=1)
            strongest = float(np.fft.rfftfreq(len(moving), 1 / part.sample_rate)[int(np.argmax(power))])
            lines.append(Doubt(name, f"only {100 * share:.0f} % of the forces repeat with a revolution at {speed:g} rev/min; "
                               f"the strongest line at {strongest:.4g} Hz is the tooth passing of "
                               f"{60 * strongest / teeth:.4g} rev/min", "check `speed` and `teeth`", figure=share))
    return lines


def fold(records: Sequence[tuple[float, Record, str]], speed: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return feeds (n,), angle (n_angle,) rad from the first sample, and forces (n, n_angle, d) averaged over revolutions."""
    samples = min(float(part.sample_rate) for _, part, _ in records) * 60 / speed
    if samples < MIN_TURN_SAMPLES:
        raise ToolpointError(f"forces: {samples:.1f} samples in a revolution at {speed:g} rev/min; must be at least "
                             f"{MIN_TURN_SAMPLES}; "
                             "measure with a higher sample rate")
    revolutions = [revolution(part, speed) for _, part, _ in records]
    count = min(MAX_FIT_SAMPLES, *(angle.size for angle, _ in revolutions))
    angle = 2 * np.pi * np.arange(count) / count
    courses = [np.stack([np.interp(angle, turned, mean[:, k], period=2 * np.pi) for k in range(mean.shape[1])], axis=1)
               for turned, mean in revolutions]
    return np.array([feed for feed, _, _ in records]), angle, np.stack(courses)
