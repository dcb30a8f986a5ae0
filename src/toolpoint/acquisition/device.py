"""Device interface: what every input gives, whatever its hardware: channels, rate, ranges, and blocks of samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt

INSTALL = "pip install 'toolpoint[acquisition]'"


class DeviceFault(ToolpointError):
    """A device that went away, or that delivers something else than it was opened for; what came before it stays."""


@dataclass(frozen=True)
class DeviceDescription:
    """Device that could be opened: its address for `device`, its name, its number of inputs and its default rate (Hz).

    Examples
    --------
    >>> from toolpoint.acquisition import DeviceDescription
    >>> DeviceDescription("sound:0", "USB interface", 2, 48000.0, "shares of the full scale").address
    'sound:0'
    """

    address: str
    name: str
    inputs: int
    rate: float
    ranges: str


@dataclass(frozen=True, eq=False)
class SampleBlock:
    """Samples that follow each other without a gap.

    Parameters
    ----------
    samples : (n, n_channels) floats
        In the unit of the device: V, or shares of the full scale.
    start : int
        Samples delivered before the block, lost ones not counted.
    arrival : float
        When the block came, s, of a clock that never steps back.
    has_overflow : bool
        Whether the driver says that samples were lost before or inside the block.
    lost_count : int
        Samples that the clock has found lost since `lost_since` (a number of samples, as `start`); 0 where none.
    is_record : bool
        Whether the block is a whole record that nothing follows, such as a file of another program.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.acquisition import SampleBlock
    >>> SampleBlock(np.zeros((480, 2)), start=960, arrival=0.03).stop
    1440
    """

    samples: FloatArray
    start: int
    arrival: float
    has_overflow: bool = False
    lost_count: int = 0
    lost_since: int = 0
    is_record: bool = False
    name: str = ""

    @property
    def stop(self) -> int:
        """Number of the sample behind the block."""
        return self.start + self.samples.shape[0]


class SampledInput(Protocol):
    """An input that is read block by block. `rate` in Hz; `ranges`: largest value of each channel, None where unknown.

    `doubts`: what this kind of input may falsify whatever is measured.

    Examples
    --------
    >>> from toolpoint.acquisition import RecordPlayer, SampledInput
    >>> import numpy as np
    >>> device: SampledInput = RecordPlayer([np.zeros((1000, 2))], 1000.0, speed=None)
    >>> device.rate
    1000.0
    """

    rate: float
    names: tuple[str, ...]
    units: tuple[str, ...]
    ranges: tuple[float | None, ...]
    doubts: tuple[Doubt, ...]

    def open(self) -> None:
        """Begin to deliver samples."""
        ...

    def read(self, timeout: float) -> SampleBlock | None:
        """Return the next block, None where none came within `timeout` (s); raises StopIteration behind the last one, and
        DeviceFault where the device is gone."""
        ...

    def close(self) -> None:
        """Stop, and let go of the device."""
        ...
