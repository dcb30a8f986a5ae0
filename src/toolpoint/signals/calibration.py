"""Volts to SI: sensitivities of hammers and accelerometers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import fail, floats
from toolpoint.vibration.record import Record


def calibrate(record: Record, sensitivity: Sequence[float], quantities: Sequence[str]) -> Record:
    """Return a record in SI from one in volts.

    Parameters
    ----------
    record : Record
        V.
    sensitivity : (n_channels,) floats
        V per SI unit of each channel (V/N, V/(m/s^2)); for a sensor in mV/g divide its value by 9806.65. A negative
        value turns the sign of a channel.
    quantities : sequence of str
        What each channel is: ``force``, ``acceleration`` ..

    Raises
    ------
    ToolpointError
        For a sensitivity of zero.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.signals import calibrate
    >>> from toolpoint.vibration import Record
    >>> volts = Record(np.array([[0.0, 0.0], [0.5, 0.1]]), 1000.0, ["1:+z", "2:+z"], ["voltage", "voltage"])
    >>> calibrate(volts, [0.01, 0.05], ["force", "acceleration"]).samples[1].tolist()  # N, m/s^2
    [50.0, 2.0]
    """
    factor = floats("sensitivity", sensitivity, (record.samples.shape[1],))
    if (factor == 0).any():
        fail("sensitivity", f"zero for channel {record.channels[int(np.argmin(np.abs(factor)))]}", "must not be zero")
    return replace(record, samples=record.samples / factor, quantities=tuple(quantities), units=())
