"""Length of the blocks of a hammer test: as long as the records and the time between hits allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from toolpoint._check import fail
from toolpoint.signals.hits import HitRules, find_pulses
from toolpoint.vibration.record import Record

MIN_BLOW_INTERVAL = 0.3  # of the typical time between pulses: nearer ones belong to one blow
MIN_ROOM_RATIO = 0.6  # of the typical room behind a hit: records with less do not set the length


def fit_block(records: Sequence[Record], force_at: int, rules: HitRules) -> tuple[int, tuple[str, ...]]:
    """Return the longest block (samples) that fits behind the hits of nearly all records, and this decision in words.

    Bounces are no hits here, and a record that ends far sooner than the others does not shorten their blocks: its hit is
    refused, as its block ends behind the record.
    """
    rooms: list[int] = []
    for record in records:
        rooms += _rooms(record, force_at, rules)
    if not rooms:
        fail("records", "no force pulse", "must hold hits",
             remedy="check the channel assignment; records of a shaker need its excitation and resolution")
    typical = float(np.median(rooms))
    full_rooms = [room for room in rooms if room >= MIN_ROOM_RATIO * typical]
    block = int(scipy.fft.prev_fast_len(max(int(min(full_rooms)), 8), real=True))
    block -= block % 2
    rate = records[0].sample_rate
    return block, (f"blocks of {block / rate:.4g} s, lines of {rate / block:.4g} Hz: the longest that fit behind the hits",)


def _rooms(record: Record, force_at: int, rules: HitRules) -> list[int]:
    """Return the number of samples that each blow of a record has until the next one or the end, its pretrigger included."""
    length = record.samples.shape[0]
    starts = find_pulses(record.samples[:, force_at], rules)
    if not starts:
        return []
    gaps = np.diff([*starts, length])
    intervals = gaps[gaps >= MIN_BLOW_INTERVAL * gaps.max()]
    typical_interval = float(np.median(intervals))
    blows = [starts[0]]
    for start in starts[1:]:
        if start - blows[-1] >= MIN_BLOW_INTERVAL * typical_interval:
            blows.append(start)
    # The pretrigger of the next hit begins before its pulse.
    ends = [*(int(blow - rules.pretrigger * typical_interval) for blow in blows[1:]), length]
    return [end - max(blow - int(rules.pretrigger * (end - blow)), 0) for blow, end in zip(blows, ends, strict=True)]
