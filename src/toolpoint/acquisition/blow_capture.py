"""Blows cut out of a stream of samples: a ring of what came before, a trigger on the force, a block of fixed length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.acquisition.channels import InputChannels
from toolpoint.acquisition.device import SampleBlock

PRETRIGGER_SHARE = 0.03  # of the block, kept before the trigger; `HitRules.pretrigger` needs 0.02 of it
TRIGGER_MARGIN_SHARE = 0.01  # of the block, kept longer: files are triggered at a tenth of the peak, a little later
QUIET_SECONDS = 0.5  # s of noise that set the trigger
TRIGGER_NOISE_RATIO = 12.0  # of the trigger over the standard deviation of the noise
TRIGGER_RANGE_SHARE = 0.002  # of the range of the force channel: the least trigger
NORMAL_DEVIATION = 1.4826  # of a standard deviation over the median of absolute deviations


@dataclass(frozen=True, eq=False)
class CapturedBlow:
    """Samples around one blow, as they are kept (V), with what only the acquisition knows of them.

    start : number of its first sample; lost : whether samples were lost inside; overloads : channels at the end of their range;
    arrival : when its last sample came (s), as `SampleBlock.arrival`; name : of the file it came from, if any.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.acquisition import CapturedBlow
    >>> CapturedBlow(np.zeros((100, 2)), 1000.0, start=50, is_torn=True).set_aside
    'samples were lost within the blow'
    """

    volts: FloatArray
    rate: float
    start: int = 0
    is_torn: bool = False
    overloads: tuple[str, ...] = ()
    arrival: float = 0.0
    name: str = ""

    @property
    def stop(self) -> int:
        """Number of the sample behind the blow."""
        return self.start + self.volts.shape[0]

    @property
    def set_aside(self) -> str:
        """The reason against the blow that its samples do not show; empty where there is none."""
        if self.is_torn:
            return "samples were lost within the blow"
        return f"overload: {', '.join(self.overloads)} reached the end of the range" if self.overloads else ""


class BlowCapture:
    """Cuts blows out of blocks of samples.

    Parameters
    ----------
    inputs : InputChannels
        One force and the responses.
    rate : float
        Hz.
    duration : float
        Length of the block behind the pretrigger, s.
    trigger : float, optional
        Force that opens a blow, N; twelve times the noise of the first half second where left out.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.acquisition import BlowCapture, InputChannel, InputChannels, SampleBlock
    >>> from toolpoint.vibration import Dof
    >>> dof = Dof("tip", "+x")
    >>> capture = BlowCapture(InputChannels((InputChannel(0, "force", dof), InputChannel(1, "acceleration", dof))), 1000.0, 0.5)
    >>> force = np.zeros(2000)
    >>> force[900:904] = [5.0, 9.0, 9.5, 4.0]
    >>> [blow] = capture.feed(SampleBlock(np.column_stack([force, 0.1 * force]), 0, 2.0))
    >>> blow.start, blow.volts.shape
    (885, (510, 2))
    """

    def __init__(self, inputs: InputChannels, rate: float, duration: float, *, trigger: float | None = None) -> None:
        self.inputs, self.rate = inputs, positive("rate", rate)
        block = round(positive("duration", duration) * self.rate)
        if block < 100:
            fail("duration", f"{duration:g} s", f"must hold 100 samples at least, {100 / rate:.2g} s")
        self._pretrigger = round(PRETRIGGER_SHARE * block)
        self._size = self._pretrigger + block - round((0.02 - TRIGGER_MARGIN_SHARE) * block)
        self._force = inputs.channels[inputs.force_at]
        self._level = None if trigger is None else positive("trigger", trigger) / abs(self._force.factor)
        self._ring: FloatArray = np.zeros((0, len(inputs.channels)))
        self._ring_start = 0
        self._parts, self._needed = list[FloatArray](), 0
        self._noise = list[FloatArray]()

    @property
    def trigger(self) -> float | None:
        """Force that opens a blow, N; None while the noise is still measured."""
        return None if self._level is None else self._level * abs(self._force.factor)

    @property
    def is_open(self) -> bool:
        """Whether a blow has begun and its block is not yet full."""
        return bool(self._parts)

    def feed(self, block: SampleBlock) -> Iterator[CapturedBlow]:
        """Yield the blows that end in a block; a block that is a whole record is one blow."""
        volts = self.inputs.kept(block.samples)
        if block.is_record:
            yield CapturedBlow(volts, self.rate, block.start, False, self.inputs.overloads(volts), block.arrival, block.name)
            return
        if block.has_overflow:
            yield from self._tear(block.arrival)
        if self._level is None:
            self._measure_noise(volts)
        yield from self._cut(volts, block)

    def _tear(self, arrival: float) -> Iterator[CapturedBlow]:
        """Forget what came before a gap, so that nothing is spliced over it; an open blow ends there."""
        if self.is_open:
            yield self._finish(arrival, is_torn=True)
        self._ring = self._ring[:0]

    def _measure_noise(self, volts: FloatArray) -> None:
        """Set the trigger once half a second of noise is there; a blow within it does not move a median."""
        self._noise.append(volts[:, self.inputs.force_at])
        if sum(part.size for part in self._noise) < QUIET_SECONDS * self.rate:
            return
        noise = np.concatenate(self._noise)
        deviation = NORMAL_DEVIATION * float(np.median(np.abs(noise - np.median(noise))))
        lower_limit = 0.0 if self._force.limit is None else TRIGGER_RANGE_SHARE * self._force.limit * self._force.volts
        self._level = max(TRIGGER_NOISE_RATIO * deviation, lower_limit, np.finfo(float).tiny)
        self._noise.clear()

    def _cut(self, volts: FloatArray, block: SampleBlock) -> Iterator[CapturedBlow]:
        """Yield the blows that end in the samples of a block, and keep the ring for the next one."""
        place = 0
        while place < volts.shape[0]:
            if not self.is_open:
                rise = self._find_rise(volts[place:])
                if rise is None:
                    self._remember(volts[place:], block.start + place)
                    return
                self._remember(volts[place:place + rise], block.start + place)
                self._parts, self._needed = [self._ring], self._size - self._pretrigger
                place += rise
            part = volts[place:place + self._needed]
            self._parts.append(part)
            self._needed -= part.shape[0]
            place += part.shape[0]
            if self._needed == 0:
                blow = self._finish(block.arrival)
                self._ring, self._ring_start = blow.volts[-self._pretrigger:], blow.stop - self._pretrigger
                yield blow

    def _find_rise(self, volts: FloatArray) -> int | None:
        """Return the first sample above the trigger, relative to the offset of what came before; None where there is none."""
        if self._level is None:
            return None
        force = volts[:, self.inputs.force_at]
        past = self._ring[:, self.inputs.force_at]
        offset = float(np.median(past if past.size else force))
        above = np.flatnonzero(np.abs(force - offset) > self._level)
        return int(above[0]) if above.size else None

    def _remember(self, volts: FloatArray, start: int) -> None:
        """Keep the last samples for the pretrigger of the next blow."""
        ring = np.concatenate([self._ring, volts])[-self._pretrigger:]
        self._ring, self._ring_start = ring, start + volts.shape[0] - ring.shape[0]

    def _finish(self, arrival: float, is_torn: bool = False) -> CapturedBlow:
        """Return the open blow, and open the next one at the next trigger."""
        volts, self._parts = np.concatenate(self._parts), []
        return CapturedBlow(volts, self.rate, self._ring_start, is_torn, self.inputs.overloads(volts), arrival)
