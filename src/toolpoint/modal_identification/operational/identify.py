"""identify_operational: one call from records of a machine at work to modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import count, fail, one_of
from toolpoint._doubt import Doubt
from toolpoint._threads import on_one_thread
from toolpoint.modal_identification.operational.band_modes import OPERATIONAL_METHODS, BandModes, Subspace, identify_band
from toolpoint.modal_identification.operational.bands import plan_bands
from toolpoint.modal_identification.operational.harmonics import Harmonic, number_orders, remove_harmonics
from toolpoint.modal_identification.operational.line_remainders import remainders_of_lines
from toolpoint.modal_identification.operational.record_doubts import question_modes, question_records, usable_channels
from toolpoint.modal_identification.operational.result import OperationalIdentification
from toolpoint.modal_identification.operational.setups import check_setups, join_setups
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record

DISPLACEMENT_POWERS = {"displacement": 0, "velocity": 1, "acceleration": 2}  # of s, from displacement


@on_one_thread
def identify_operational(records: Record | Sequence[Record], method: str | Subspace = "ssi-cov", *,
                         references: Sequence[str] | None = None, band: tuple[float, float] | None = None,
                         keep_harmonics: bool = False) -> OperationalIdentification:
    """Return the modes of a structure from its motion at work alone, found without user input.

    Loads may be unknown but must be random, broad, and not move; harmonics of rotating parts are found and taken off first. The
    modes are `unscaled`: see `mass_scaling` for their scale.

    Parameters
    ----------
    records : Record or sequence of Record
        Accelerations, velocities or displacements. Records of the same channels are one test; records of other channels are
        further set-ups of roving sensors, which must share at least one channel (the references) with all others.
    method : str or Subspace
        ``ssi-cov`` (default), ``ssi-data``, or a `Subspace` with its own settings.
    references : labels, optional
        Channels that the others are correlated with: all where left out; those that all set-ups share, of several.
    band : (low, high) in Hz, optional
        Up to the sample rate over 2.56 where left out.
    keep_harmonics : bool
        Leave harmonics in the records; they then show as poles without damping.

    Raises
    ------
    ToolpointError
        For channels that do not measure motion, a band outside the data, a record too short for its lowest band, set-ups
        without a common channel, or no mode at all.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from toolpoint.modal_identification import identify_operational
    >>> from toolpoint.vibration import Record
    >>> rng, rate, pole = np.random.default_rng(1), 100.0, np.exp((-0.02 + 1j) * 2 * np.pi * 12.0 / 100.0)
    >>> y = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], rng.standard_normal(20000))
    >>> found = identify_operational(Record(y[:, None], rate, ["tool:+x"], "acceleration"))
    >>> bool(abs(found.modes.frequency[0] - 12.0) < 2 * found.modes.frequency_interval[0])
    True
    """
    settings = OPERATIONAL_METHODS[one_of("method", method, OPERATIONAL_METHODS)] if isinstance(method, str) else method
    count("method.order", settings.order, 2)
    setups = check_setups([records] if isinstance(records, Record) else list(records), references)
    parts = [_identify_setup(setup.records, setup.references, settings, band=band, keep_harmonics=keep_harmonics)
             for setup in setups]
    result = parts[0] if len(parts) == 1 else join_setups(parts, setups)
    if result.modes.count == 0:
        fail("records", f"no mode found by {settings.name}", "at least one resonance must stand out of the noise",
             remedy="record longer, with stronger or broader loads, or widen the band")
    return result


def _identify_setup(records: Sequence[Record], references: Sequence[str], settings: Subspace, *,
                    band: tuple[float, float] | None, keep_harmonics: bool) -> OperationalIdentification:
    """Return the identification of records of the same channels."""
    usable, notes = usable_channels(records)
    rate = usable[0].sample_rate
    samples, harmonics = _without_harmonics(usable, keep_harmonics=keep_harmonics)
    labels = [str(dof) for dof in usable[0].channels]
    columns = [labels.index(name) for name in references if name in labels] or list(range(len(labels)))
    plan = plan_bands([part.shape[0] for part in samples], rate, settings.rows, blocks=settings.blocks, band=band)
    parts = [identify_band(samples, usable[0].channels, columns, settings=settings, rate=rate, band=item) for item in plan]
    modes, order = _join_bands(parts, usable[0])
    share = np.concatenate([part.power_share for part in parts])[order]
    is_remainder, of_lines = remainders_of_lines(modes, share, harmonics)
    if is_remainder.any():
        names = ", ".join(f"{frequency:.4g} Hz" for frequency in modes.frequency[is_remainder])
        notes.append(f"remainders of removed lines, no modes: {names}")
    modes, order = modes.selected(np.flatnonzero(~is_remainder).tolist()), order[~is_remainder]
    fields = {name: np.concatenate([getattr(part, name) for part in parts])[order]
              for name in ("support", "power_share", "confirmed")}
    result = OperationalIdentification(
        modes, harmonics, spectra=tuple(part.spectra for part in parts), diagrams=tuple(part.diagram for part in parts),
        method=settings.name, duration=float(sum(record.duration for record in records)), **fields)
    doubts: list[Doubt] = [*question_records(usable), *(doubt for part in parts for doubt in part.doubts), *of_lines,
                           *question_modes(result)]
    return OperationalIdentification(**{**vars(result), "doubts": tuple(doubts), "notes": tuple(notes)})


def _without_harmonics(records: Sequence[Record], *, keep_harmonics: bool) -> tuple[list[np.ndarray], tuple[Harmonic, ...]]:
    """Return the samples of every record less its harmonics, and the harmonics of all records, numbered."""
    samples: list[np.ndarray] = []
    harmonics: list[Harmonic] = []
    for record in records:
        if keep_harmonics:
            samples.append(record.samples - record.samples.mean(axis=0))
            continue
        cleaned, lines = remove_harmonics(record.samples, record.sample_rate)
        samples.append(cleaned)
        harmonics += [line for line in lines
                      if all(abs(line.frequency - other.frequency) > 4 / record.duration for other in harmonics)]
    ordered = tuple(sorted(harmonics, key=lambda h: h.frequency))
    return samples, number_orders(ordered, 1 / min(record.duration for record in records))


def _join_bands(parts: Sequence[BandModes], record: Record) -> tuple[Modes, np.ndarray]:
    """Return the modes of all bands, lowest first, as shapes of displacement, and the order in which they stand."""
    frequency = np.concatenate([part.frequency for part in parts])
    order = np.argsort(frequency, kind="stable")
    shape = np.concatenate([part.shape for part in parts], axis=1)[:, order]
    variance = np.concatenate([part.shape_variance for part in parts], axis=1)[:, order]
    poles = np.concatenate([part.poles for part in parts])[order]
    powers = np.array([DISPLACEMENT_POWERS[quantity] for quantity in record.quantities])
    to_displacement = poles ** (powers.min() - powers)[:, None]
    modes = Modes(frequency[order], np.concatenate([part.damping_ratio for part in parts])[order], shape * to_displacement,
                  record.channels, "unscaled", covariance=np.concatenate([part.covariance for part in parts])[order],
                  shape_variance=variance * np.abs(to_displacement) ** 2)
    return modes, order
