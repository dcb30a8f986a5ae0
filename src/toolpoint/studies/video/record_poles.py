"""Poles from a hammer or accelerometer record beside the camera, for shapes by the video, also above half its rate."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ToolpointError, fail
from toolpoint.modal_identification import Identification, identify
from toolpoint.signals import hammer_test
from toolpoint.vibration import Dof, Frf, Modes, Record

RECORD_BLOCK_SECONDS = 1.0  # s, at most
RECORDED_BLOW_TIME = 0.005  # s after the largest sample


def poles_of(measured: Frf | Record | Modes, band: tuple[float, float] | None = None) -> Modes:
    """Return the poles of responses, of a hammer record, of a free decay without force, or those of modes as they are.

    Raises
    ------
    ToolpointError
        Where no mode is found; for a record with several forces.

    Examples
    --------
    >>> poles_of(Modes([80.0, 120.0], [0.02, 0.03], [[0.1, 0.05]], ["tool:+x"])).frequency.tolist()
    [80.0, 120.0]
    """
    if isinstance(measured, Modes):
        return measured
    frf = measured if isinstance(measured, Frf) else _responses(measured)
    result: Identification = identify(frf, band=band)
    keep = [int(i) for i in result.dominant if not result.doubtful[i]]
    if not keep:
        raise ToolpointError("record: no mode stands out of it; " + "; ".join(result.advice[:2]))
    return result.modes.selected(keep)


def _responses(record: Record) -> Frf:
    forces = [i for i, quantity in enumerate(record.quantities) if quantity == "force"]
    if len(forces) > 1:
        fail("record", f"{len(forces)} forces", "must be one hammer or none")
    if forces:
        return hammer_test(record, min(RECORD_BLOCK_SECONDS, 0.8 * record.duration)).frf
    samples = record.samples - record.samples.mean(axis=0)
    energy = (samples**2).sum(axis=1)
    first = int(np.argmax(energy)) + round(RECORDED_BLOW_TIME * record.sample_rate)
    part = samples[first:]
    if len(part) < 64:
        fail("record", f"{len(part)} samples after the largest", "must be 64 at least", remedy="record longer after the blow")
    part = part - part.mean(axis=0)
    spectra = np.fft.rfft(part, axis=0)[1:] / record.sample_rate
    frequency = np.fft.rfftfreq(len(part), 1 / record.sample_rate)[1:]
    keep = frequency < 0.4 * record.sample_rate
    return Frf(frequency[keep], spectra[keep][:, :, None], record.channels, (Dof("blow", "+x"),), "receptance")
