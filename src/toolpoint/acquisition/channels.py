"""Inputs of a test: what each channel of a device measures, where, in which unit; their samples as a Record in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint.vibration import Dof, Record

OVERLOAD_FRACTION = 0.999  # of the range of an input, from which its samples may be cut off


@dataclass(frozen=True)
class InputChannel:
    """Channel of a device.

    Parameters
    ----------
    column : int
        Its column in the blocks of the device.
    quantity : str
        ``force``, ``acceleration`` ..
    dof : Dof
    factor : float
        SI units in one unit that is kept (V).
    volts : float
        Kept units in one unit of the device: volts of the full scale where the device gives shares of it.
    limit : float, optional
        Largest value of the device, in its unit.

    Examples
    --------
    >>> from toolpoint.acquisition import InputChannel
    >>> from toolpoint.vibration import Dof
    >>> round(InputChannel(0, "force", Dof("tip", "+x"), factor=1 / 2.25e-3, limit=10.0).factor, 1)  # N/V
    444.4
    """

    column: int
    quantity: str
    dof: Dof
    factor: float = 1.0
    volts: float = 1.0
    limit: float | None = None

    def __str__(self) -> str:
        return f"channel {self.column + 1} ({self.quantity} at {self.dof})"


@dataclass(frozen=True)
class InputChannels:
    """Channels of a test in the order of their columns.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.acquisition import InputChannel, InputChannels
    >>> from toolpoint.vibration import Dof
    >>> inputs = InputChannels((InputChannel(0, "force", Dof("tip", "+x"), factor=500.0, limit=5.0),
    ...                         InputChannel(1, "acceleration", Dof("tip", "+x"), factor=100.0, limit=5.0)))
    >>> record = inputs.record(np.array([[0.0, 0.0], [0.4, 0.1]]), 1000.0)
    >>> record.samples[1].tolist()
    [200.0, 10.0]
    >>> inputs.overloads(np.array([[0.0, 5.0]]))
    ('channel 2 (acceleration at tip:+x)',)
    """

    channels: tuple[InputChannel, ...]

    def __post_init__(self) -> None:
        if not self.channels:
            fail("InputChannels.channels", "none", "must be at least one")

    @property
    def force_at(self) -> int:
        """Place of the only force channel; ToolpointError where there is none or several."""
        places = [k for k, channel in enumerate(self.channels) if channel.quantity == "force"]
        if len(places) != 1 or len(self.channels) < 2:
            fail("InputChannels.channels", f"{len(places)} force channels and {len(self.channels) - len(places)} responses",
                 "must be one force and some responses", remedy="say what each is: '1=force tip:+x 2.25mV/N'")
        return places[0]

    def kept(self, samples: FloatArray) -> FloatArray:
        """Return samples (n, n_device_channels) of the device as they are kept: the channels of the test, in volts."""
        scale = np.array([channel.volts for channel in self.channels])
        return samples[:, [channel.column for channel in self.channels]] * scale

    def record(self, volts: FloatArray, rate: float, name: str = "") -> Record:
        """Return kept samples (n, n_channels) as a Record in SI, as it is read from a file of them."""
        values = floats("volts", volts, (None, len(self.channels)))
        return Record(values * np.array([channel.factor for channel in self.channels]), rate,
                      tuple(channel.dof for channel in self.channels),
                      tuple(channel.quantity for channel in self.channels), name=name)

    def overloads(self, volts: FloatArray) -> tuple[str, ...]:
        """Return the channels, in words, whose kept samples reach the end of the device's range."""
        peaks = np.abs(volts).max(axis=0, initial=0.0)
        return tuple(str(channel) for channel, peak in zip(self.channels, peaks, strict=True)
                     if channel.limit is not None and peak >= OVERLOAD_FRACTION * channel.limit * channel.volts)
