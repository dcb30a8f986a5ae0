r"""Doubts about shaker tests: what each kind of excitation assumes, and what the records say of it.

A block without a window assumes that force and motion begin and end at rest in it (burst, swept), or repeat from block to block
(pseudo-random). Random excitation has a window, which lowers sharp peaks: the finer the lines, the less, as the square of
their spacing. Forces of several shakers must differ, and a force that drops at resonance leaves noise in H1. Sources: Heylen,
Lammens, Sas, Modal Analysis Theory and Testing, section A.1; Bendat, Piersol, Random Data, 4th ed., section 8.5.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.signals.shaker import coherences, shaker_test, split_channels
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.record import Record

_MAX_END_LEVEL = 0.02  # rms at the end of a block over that of the block: above, what follows is cut off
_END_SHARE = 0.05  # of a block, its end
_MAX_CHANGE_BETWEEN_BLOCKS = 0.05  # rms of the difference of successive blocks of force over its rms: above, it does not repeat
_MAX_PEAK_BIAS = 0.03  # of a peak, by which the window lowers it
_PEAK_SHARE = 0.3  # of the largest response: lines above it are peaks
_MAX_FORCE_COHERENCE = 0.9  # between two forces, median over the lines: above, one shaker follows the other
_MAX_ESTIMATOR_SPREAD = 0.05  # of H2 over H1 at the peaks: above, noise decides which of them is right
_IMPULSE_CREST = 12.0  # largest force over its rms: above, the record is one of blows


@dataclass(frozen=True)
class ShakerSettings:
    """Settings of a shaker test: line spacing (Hz), excitation, estimator, band (Hz), and blocks left out at the start.

    Examples
    --------
    >>> from toolpoint.signals import ShakerSettings
    >>> ShakerSettings(0.5, "burst").estimator
    'H1'
    """

    resolution: float
    excitation: str = "random"
    estimator: str = "H1"
    band: tuple[float, float] | None = None
    settle: int = 0


def question_shaker(records: Sequence[Record], frf: Frf, settings: ShakerSettings) -> list[Doubt]:
    """Return the doubts about one set-up: whether its records are what its excitation assumes."""
    forces, outputs, _ = split_channels(records[0])
    blocks = _blocks(records, settings)
    doubts = [*_impulse_doubts(records, forces), *_force_doubts(records, settings, forces=forces)]
    if settings.excitation in ("burst", "swept"):
        doubts += _end_doubts(blocks, forces, outputs)
    elif settings.excitation == "pseudo-random":
        doubts += _repetition_doubts(blocks[:, :, forces])
    else:
        doubts += _peak_doubts(records, frf, settings)
    return [*doubts, *_noise_doubts(records, frf, settings)]


def _blocks(records: Sequence[Record], settings: ShakerSettings) -> FloatArray:
    """Return the blocks of all records one after the other, (b, n, channels), without their means."""
    size = round(records[0].sample_rate / settings.resolution)
    parts = [record.samples[settings.settle * size:] - record.samples.mean(axis=0) for record in records]
    return np.concatenate([part[:len(part) // size * size].reshape(-1, size, part.shape[1]) for part in parts])


def _impulse_doubts(records: Sequence[Record], forces: list[int]) -> list[Doubt]:
    crest = min(float(np.abs(record.samples[:, k]).max() / max(np.sqrt(np.mean(record.samples[:, k] ** 2)), 1e-300))
                for record in records for k in forces)
    if crest < _IMPULSE_CREST:
        return []
    return [Doubt("force", f"short blows ({crest:.3g} times its rms at the most), not a shaker's force",
                  "a hammer test needs no --excitation: its hits are judged one by one", figure=crest)]


def _force_doubts(records: Sequence[Record], settings: ShakerSettings, *, forces: list[int]) -> list[Doubt]:
    """Return doubts about forces that go together: their shares in the response cannot be told apart."""
    doubts = []
    for i, first in enumerate(forces):
        for second in forces[i + 1:]:
            record = records[0]
            pair = Record(record.samples[:, [first, second]], record.sample_rate,
                          (record.channels[first], record.channels[second]), ("force", "acceleration"))
            try:
                _, ordinary, _ = coherences(pair, settings.resolution)
            except ToolpointError:
                continue  # one block tells nothing of their coherence
            if (shared := float(np.median(ordinary))) > _MAX_FORCE_COHERENCE:
                names = f"forces {record.channels[first]} and {record.channels[second]}"
                doubts.append(Doubt(names, f"go together (coherence {shared:.2f}): which moves what cannot be told apart",
                                    "drive the shakers by sources of their own", grave=True, figure=shared))
    return doubts


def _end_doubts(blocks: FloatArray, forces: list[int], outputs: list[int]) -> list[Doubt]:
    last = max(round(_END_SHARE * blocks.shape[1]), 1)
    level = np.sqrt((blocks[:, -last:] ** 2).mean(axis=(0, 1)) / np.maximum((blocks**2).mean(axis=(0, 1)), 1e-300))
    doubts = []
    for name, channels in (("force", forces), ("responses", outputs)):
        if (largest := float(level[channels].max())) > _MAX_END_LEVEL:
            doubts.append(Doubt(name, f"still at {100 * largest:.3g} % of their rms at the end of a block: what follows is cut "
                                "off, and peaks are too wide", "longer blocks (a finer --resolution), or a shorter burst",
                                figure=largest))
    return doubts


def _repetition_doubts(forces: FloatArray) -> list[Doubt]:
    if len(forces) < 2:
        return []
    change = np.sqrt(((forces[1:] - forces[:-1]) ** 2).mean() / max(float((forces**2).mean()), 1e-300))
    if change <= _MAX_CHANGE_BETWEEN_BLOCKS:
        return []
    return [Doubt("force", f"differs from block to block by {100 * change:.3g} % of its rms: without a window it leaks",
                  "the --resolution must be one over the period of the source; or --excitation random", figure=float(change))]


def _peak_doubts(records: Sequence[Record], frf: Frf, settings: ShakerSettings) -> list[Doubt]:
    """Return a doubt about peaks that the window lowers, by the same records on lines twice as far apart."""
    if frf.frequency.size < 8:
        return []
    coarse = shaker_test(records, 2 * settings.resolution, estimator=settings.estimator, band=settings.band,
                         settle=settings.settle)
    fine_size, coarse_size = (np.sqrt((np.abs(part.values) ** 2).sum(axis=(1, 2))) for part in (frf, coarse))
    lines = np.arange(1, fine_size.size - 1)
    is_peak = (fine_size[lines] >= np.maximum(fine_size[lines - 1], fine_size[lines + 1])) & (
        fine_size[lines] > _PEAK_SHARE * fine_size.max())
    peaks = lines[is_peak]
    coarse_peaks = [coarse_size[np.abs(coarse.frequency - frequency) <= 2.01 * settings.resolution].max(initial=0.0)
            for frequency in frf.frequency[peaks]]
    # A bias that grows as the square of the spacing is a third of what doubling adds.
    bias = np.array([(fine_size[k] / size - 1) / 3 for k, size in zip(peaks, coarse_peaks, strict=True) if size > 0])
    if not bias.size or bias.max() <= _MAX_PEAK_BIAS:
        return []
    return [Doubt("resolution", f"{settings.resolution:g} Hz lowers the sharpest peak by about {100 * bias.max():.2g} %, and "
                  "makes its damping too large", "a finer --resolution, a burst, or a pseudo-random source",
                  figure=float(bias.max()))]


def _noise_doubts(records: Sequence[Record], frf: Frf, settings: ShakerSettings) -> list[Doubt]:
    """Return a doubt where H1 and H2 differ at the peaks: the force drops there, and noise on it counts."""
    if len(frf.inputs) != 1 or frf.coherence is None:
        return []
    # H2 / H1 is one over the coherence for one force.
    size = np.abs(frf.values)
    loud = size > _PEAK_SHARE * size.max(axis=0)
    spread = float(np.median(1 / np.maximum(frf.coherence[loud], 1e-6)) - 1)
    if spread <= _MAX_ESTIMATOR_SPREAD:
        return []
    return [Doubt("peaks", f"H2 is {100 * spread:.3g} % above H1 where responses are large: noise, or a force that drops at "
                  "resonance", "more force, more blocks, or --estimator Hv", figure=spread)]
