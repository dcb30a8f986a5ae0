"""Poles from a hammer or accelerometer record beside the camera, for shapes by the video, also above half its rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import ToolpointError, fail
from toolpoint.modal_identification import Identification, identify
from toolpoint.signals import hammer_test
from toolpoint.vibration import Dof, Frf, Modes, Record
from toolpoint.vision.modes.decay import FreeDecay

# Of the motion of poles that a decay does not tell apart, up to which one of them is not in the video.
MAX_UNSEEN_SHARE = 0.01
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
    # A mode that another one outshines is a mode all the same, and the one that a plane shows: only doubtful ones go.
    keep = np.flatnonzero(~result.doubtful).tolist()
    if not keep:
        raise ToolpointError("record: no mode stands out of it; " + "; ".join(result.advice[:2]))
    return result.modes.selected(keep)


def part_poles(poles: Modes, decay: FreeDecay) -> tuple[Modes, tuple[str, ...]]:
    """Return the poles of a record that a video shows, and a note on each of a close pair that it does not.

    A record holds the modes of all planes, a video those of its own. Poles nearer to each other than the decay is long (1/T)
    are fitted together with shapes that noise decides: one that explains next to nothing beside its neighbours is left out.
    """
    frames = len(decay.components)
    notes: list[str] = []
    times, resolution = np.arange(frames) / decay.frame_rate, decay.frame_rate / frames
    kept = list(range(poles.count))

    def misfit(chosen: Sequence[int]) -> float:
        waves = np.exp(poles.poles[list(chosen)] * times[:, None])
        columns = np.concatenate([waves.real, waves.imag, np.ones((frames, 1)), times[:, None]], axis=1)
        columns = columns / np.linalg.norm(columns, axis=0)
        return float(np.sum((decay.components - columns @ np.linalg.lstsq(columns, decay.components, rcond=None)[0]) ** 2))

    while True:
        neighbours = {i: [k for k in kept if abs(poles.frequency[k] - poles.frequency[i]) < resolution] for i in kept}
        close = {i: group for i, group in neighbours.items() if len(group) > 1}
        all_misfit = misfit(kept)
        shares = {i: (misfit([k for k in kept if k != i]) - all_misfit) / max(
            misfit([k for k in kept if k not in group]) - all_misfit, 1e-300) for i, group in close.items()}
        if not shares or min(shares.values()) > MAX_UNSEEN_SHARE:
            return poles.selected(kept), tuple(notes)
        faintest = min(shares, key=lambda i: shares[i])
        kept.remove(faintest)
        neighbour_names = ", ".join(f"{poles.frequency[k]:.2f} Hz" for k in neighbours[faintest] if k != faintest)
        share = 100 * max(shares[faintest], 0.0)
        notes.append(f"{poles.frequency[faintest]:.2f} Hz of the record is left out: beside {neighbour_names} it explains "
                     f"{share:.1g} % of what this video shows there; {frames / decay.frame_rate:.2g} s do not part them")


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
    # Above four fifths of half the rate the anti-alias filter is in the response.
    keep = frequency < 0.4 * record.sample_rate
    return Frf(frequency[keep], spectra[keep][:, :, None], record.channels, (Dof("blow", "+x"),), "receptance")
