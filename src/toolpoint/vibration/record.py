"""Record: time histories of several channels at one sample rate."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive, scalar
from toolpoint._notebook import NotebookText
from toolpoint.vibration.dof import Dof, check_labels, positions


@dataclass(frozen=True, eq=False)
class Record(NotebookText):
    """Time histories of several channels.

    Parameters
    ----------
    samples : (n_samples, n_channels) floats
        Values in the unit of each channel (SI).
    sample_rate : float
        Samples per second, Hz.
    channels : sequence of Dof
        Where and in which direction each channel was taken.
    quantities : sequence of str
        What each channel is: ``force``, ``acceleration``, ``velocity``, ``displacement``, or another word.
    units : sequence of str, optional
        Unit of each channel; the SI unit of the quantity where left out.
    start : float
        Time of the first sample, s.
    name : str
        What the record is.

    Raises
    ------
    ToolpointError
        For a wrong shape, values that are not finite, a sample rate that is not positive, or repeated labels.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.vibration import Record
    >>> record = Record(np.zeros((1000, 1)), 500.0, ["tool:+x"], "acceleration")
    >>> record.duration, record.units
    (2.0, ('m/s^2',))
    """

    samples: FloatArray
    sample_rate: float
    channels: tuple[Dof, ...]
    quantities: tuple[str, ...]
    units: tuple[str, ...] = ()
    start: float = 0.0
    name: str = ""

    SI = {"force": "N", "acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "torque": "N m"}

    def __post_init__(self) -> None:
        samples = floats("Record.samples", self.samples, (None, None))
        if samples.ndim != 2 or samples.shape[0] == 0:
            fail("Record.samples", f"shape {samples.shape}", "must be (n_samples, n_channels) with at least one sample")
        count = samples.shape[1]
        quantities = (self.quantities,) * count if isinstance(self.quantities, str) else tuple(self.quantities)
        units = tuple(self.units) or tuple(self.SI.get(quantity, "") for quantity in quantities)
        if len(quantities) != count or len(units) != count:
            fail("Record.quantities", f"{len(quantities)} quantities, {len(units)} units", f"must be {count} of each")
        object.__setattr__(self, "samples", samples)
        object.__setattr__(self, "sample_rate", positive("Record.sample_rate", self.sample_rate))
        labels = check_labels("Record.channels", self.channels, count) if len(set(quantities)) == 1 else self._labels()
        object.__setattr__(self, "channels", labels)
        object.__setattr__(self, "quantities", quantities)
        object.__setattr__(self, "units", units)
        object.__setattr__(self, "start", scalar("Record.start", self.start))

    def _labels(self) -> tuple[Dof, ...]:
        # A force and an acceleration may share one driving point, so labels may repeat across quantities.
        from_text = tuple(dof if isinstance(dof, Dof) else Dof.parse(dof) for dof in self.channels)
        if len(from_text) != np.shape(self.samples)[1]:
            fail("Record.channels", f"{len(from_text)} labels", f"must be {np.shape(self.samples)[1]}")
        return from_text

    @property
    def time(self) -> FloatArray:
        """Time of every sample, s, shape (n_samples,)."""
        return self.start + np.arange(self.samples.shape[0]) / self.sample_rate

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return self.samples.shape[0] / self.sample_rate

    def selected(self, channels: Iterable[Dof | str | int]) -> Record:
        """Return the record of these channels (labels or indices)."""
        columns = positions("channels", channels, self.channels)
        return replace(
            self, samples=self.samples[:, columns], channels=tuple(self.channels[i] for i in columns),
            quantities=tuple(self.quantities[i] for i in columns), units=tuple(self.units[i] for i in columns),
        )

    def between(self, start: float, stop: float) -> Record:
        """Return the samples with start <= time <= stop (s)."""
        is_inside = (self.time >= start) & (self.time <= stop)
        if not is_inside.any():
            fail("between", f"{start:g} .. {stop:g} s", f"must overlap {self.time[0]:g} .. {self.time[-1]:g} s")
        return replace(self, samples=self.samples[is_inside], start=float(self.time[is_inside][0]))

    def __repr__(self) -> str:
        kinds = ", ".join(dict.fromkeys(self.quantities))
        count, channels = self.samples.shape
        return f"Record({channels} channels: {kinds}; {count} samples at {self.sample_rate:g} Hz, {self.duration:.4g} s)"
