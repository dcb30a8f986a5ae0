"""Shaker tests: random, burst, swept and pseudo-random excitation, one or several forces -> frequency responses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, fail, one_of, positive
from toolpoint.signals.estimators import (
    Spectra,
    average,
    multiple_coherence,
    ordinary_coherence,
    responses,
    variance,
    with_choice,
)
from toolpoint.signals.hammer import RESPONSE_QUANTITIES
from toolpoint.signals.windows import hann, independent_blocks
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

EXCITATIONS = ("random", "burst", "swept", "pseudo-random")


def shaker_test(
    record: Record | Sequence[Record], resolution: float, *, excitation: str = "random", estimator: str = "H1",
    band: tuple[float, float] | None = None, settle: int = 0,
) -> Frf:
    """Return the frequency responses from records of one or several forces at once.

    Parameters
    ----------
    record : Record, or several of the same channels
        SI; channels of quantity ``force`` are the inputs, all others the outputs. Blocks of all records are averaged.
    resolution : float
        Line spacing, Hz. With `band` this is the zoom: a fine spacing over a part of the axis; only its lines are kept.
    excitation : str
        ``random``: Hann window, half overlap. ``burst`` and ``swept``: one burst or sweep to a block, no window (both
        must have died away by the end of the block). ``pseudo-random``: periodic in the block, no window.
    estimator : str
        ``H1``, ``H2`` or ``Hv``.
    band : (low, high) in Hz, optional
        0 to the sample rate over 2.56 where left out.
    settle : int
        Blocks to leave out at the start, until a periodic response is steady.

    Returns
    -------
    Frf
        With the multiple coherence of every output in `coherence` (the ordinary one, for one input) and the variance
        of H1.

    Raises
    ------
    ToolpointError
        For records shorter than a block, fewer blocks than forces, or channels that do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import shaker_test
    >>> from toolpoint.vibration import Record
    >>> force = np.random.default_rng(1).standard_normal(4096)
    >>> record = Record(np.column_stack([force, 0.5 * force]), 1024.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    >>> frf = shaker_test(record, resolution=4.0, band=(20.0, 200.0))
    >>> bool(np.allclose(frf.values, 0.5))  # a mass of 2 kg: accelerance 1/m
    True
    """
    one_of("excitation", excitation, EXCITATIONS)
    records = [record] if isinstance(record, Record) else list(record)
    first = _first_of(records)
    forces, outputs, quantity = split_channels(first)
    averages = _average_blocks(records, resolution, excitation, estimator=estimator, band=band, settle=settle)
    multiple = multiple_coherence(averages)[:, :, None] if averages.blocks > len(forces) else None
    coherence = None if multiple is None else np.repeat(multiple, len(forces), axis=2)
    values = responses(averages, estimator)
    return Frf(averages.frequency, values, tuple(first.channels[i] for i in outputs),
               tuple(first.channels[i] for i in forces), quantity, coherence=coherence,
               variance=with_choice(values, responses(averages), variance(averages)),
               notes=() if len(forces) == 1 else ("coherence is the multiple coherence of each output",))


def _first_of(records: Sequence[Record]) -> Record:
    """Return the first record; refuse none, and records of other channels or sample rates."""
    if not records:
        fail("record", "none", "must be one at least")
    for other in records[1:]:
        if (other.channels, other.quantities, other.sample_rate) != (
                records[0].channels, records[0].quantities, records[0].sample_rate):
            fail("record", f"{other.name or 'a record'} has other channels or another sample rate",
                 f"must have those of {records[0].name or 'the first'}", remedy="give the records of each set-up apart")
    return records[0]


def count_blocks(records: Sequence[Record], resolution: float, excitation: str = "random", *, settle: int = 0) -> float:
    """Return how many independent blocks the records hold; overlapping ones count less.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals.shaker import count_blocks
    >>> from toolpoint.vibration import Record
    >>> record = Record(np.zeros((4096, 2)), 1024.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    >>> count_blocks([record], 1.0, "burst", settle=1)
    3.0
    """
    block = round(records[0].sample_rate / resolution)
    step = block // 2 if excitation == "random" else block
    counts = [max((record.samples.shape[0] - settle * block - block) // step + 1, 0) for record in records]
    if excitation != "random":
        return float(sum(counts))
    return float(sum(independent_blocks(count, hann(block), step) for count in counts if count))


def _average_blocks(records: Sequence[Record], resolution: float, excitation: str, *, estimator: str,
                    band: tuple[float, float] | None, settle: int) -> Spectra:
    """Return the averaged spectra of the blocks of all records on the lines of the band."""
    rate, (forces, outputs, _) = records[0].sample_rate, split_channels(records[0])
    block = round(rate / positive("resolution", resolution))
    window = hann(block) if excitation == "random" else np.ones(block)
    step = block // 2 if excitation == "random" else block
    starts = [np.arange(settle * block, record.samples.shape[0] - block + 1, step) for record in records]
    count = sum(part.size for part in starts)
    if count == 0:
        longest = max(record.duration for record in records)
        fail("resolution", f"{resolution:g} Hz needs blocks of {block / rate:g} s",
             f"must not exceed the record of {longest:g} s less {settle} blocks")
    if count < len(forces):
        fail("record", f"{count} blocks for {len(forces)} forces", "must be at least one block for each",
             remedy="measure longer or choose a coarser resolution")
    frequency = np.asarray(np.arange(block // 2 + 1) * (rate / block), float)
    band_min, band_max = (0.0, rate / 2.56) if band is None else band
    in_band = (frequency >= band_min - 1e-9) & (frequency <= band_max + 1e-9)
    if not in_band.any():
        fail("band", f"{band_min:g} .. {band_max:g} Hz", f"must overlap 0 .. {frequency[-1]:g} Hz")
    spectra = np.concatenate([_transform_blocks(record, part, block, window, in_band)
                              for record, part in zip(records, starts, strict=True) if part.size])
    blocks = count_blocks(records, resolution, excitation, settle=settle)
    return average(frequency[in_band], spectra[:, :, forces], spectra[:, :, outputs], blocks=blocks, full=estimator == "H2")


def coherences(record: Record, resolution: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return frequency, ordinary (n_f, n_o, n_i) and multiple (n_f, n_o) coherence of a random record.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import coherences
    >>> from toolpoint.vibration import Record
    >>> force = np.random.default_rng(1).standard_normal(4096)
    >>> record = Record(np.column_stack([force, 0.5 * force]), 1024.0, ["1:+z", "1:+z"], ["force", "acceleration"])
    >>> frequency, ordinary, multiple = coherences(record, resolution=4.0)
    >>> float(ordinary.min().round(9))
    1.0
    """
    forces, outputs, _ = split_channels(record)
    block = round(record.sample_rate / positive("resolution", resolution))
    window = hann(block)
    starts = np.arange(0, record.samples.shape[0] - block + 1, block // 2)
    if starts.size <= len(forces):
        fail("resolution", f"{starts.size} blocks for {len(forces)} forces", "must be more blocks than forces")
    frequency = np.asarray(np.arange(block // 2 + 1) * (record.sample_rate / block), float)
    spectra = _transform_blocks(record, starts, block, window, np.ones(frequency.size, bool))
    averages = average(frequency, spectra[:, :, forces], spectra[:, :, outputs])
    return frequency, ordinary_coherence(averages), multiple_coherence(averages)


def _transform_blocks(record: Record, starts: Array, block: int, window: FloatArray, in_band: Array) -> ComplexArray:
    """Return the spectra of all blocks, (n_blocks, n_f, n_channels)."""
    offset = record.samples.mean(axis=0)
    return np.stack([np.fft.rfft((record.samples[start:start + block] - offset) * window[:, None], axis=0)[in_band]
                     for start in starts.tolist()])


def split_channels(record: Record) -> tuple[list[int], list[int], str]:
    """Return force channels, response channels and the quantity of the responses."""
    forces = [i for i, quantity in enumerate(record.quantities) if quantity == "force"]
    others = [i for i in range(len(record.quantities)) if i not in forces]
    if not forces or not others:
        fail("record", f"{len(forces)} force channels and {len(others)} others", "must have forces and responses")
    kinds = {record.quantities[i] for i in others}
    if len(kinds) > 1 or not kinds <= RESPONSE_QUANTITIES.keys():
        fail("record", f"responses of quantity {', '.join(sorted(kinds))}", f"must be one of {', '.join(RESPONSE_QUANTITIES)}")
    return forces, others, RESPONSE_QUANTITIES[kinds.pop()]
