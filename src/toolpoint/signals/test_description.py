"""Description of a test by hammer or shaker as plain data, one to one with a test file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from toolpoint._check import fail
from toolpoint._quantity import Quantity
from toolpoint.signals.shaker_doubts import ShakerSettings

Motion = Literal["force", "acceleration", "velocity", "displacement", "ignored"]


@dataclass(frozen=True)
class ChannelDescription:
    """Channel of the records: its quantity, its place, and its sensor.

    `channel` is its name in the files, or its number from 1. `dof` is a label such as ``5:-z``; of the force channel it is
    where and in which direction the hammer strikes. `sensitivity`, such as ``2.25 mV/N`` or ``100 mV/g`` (a number: V per SI
    unit), is needed where the files hold volts; a negative one turns the channel. `full_scale`: volts of the largest sample of
    a sound file. `mass` is what the sensor adds to the structure (of a force gauge, what lies between its crystal and the
    structure); it is taken off at driving points. The point ``*`` (``*:+x``) is that of a sensor whose place stands in names of
    files as ``{output}``; its whole mass stands at each of its channels, and the identification of modes takes it out.
    """

    channel: str
    quantity: Motion | None = None
    dof: str | None = None
    sensitivity: str | float | None = None
    full_scale: Annotated[float, Quantity("voltage", "V", above=0)] | None = None
    mass: Annotated[float, Quantity("mass", "kg", least=0)] | None = None


@dataclass(frozen=True)
class RecordsDescription:
    """Files of one struck Dof: names, or patterns such as ``tip_*.csv``, relative to the test file; `struck` where the channels
    do not say it; `pattern` reads Dofs from names: ``P{input}_*``."""

    files: tuple[str, ...]
    struck: str | None = None
    pattern: str | None = None


@dataclass(frozen=True)
class HammerTestDescription:
    """Test by hammer or shaker: its name, records, channels, settings, and decisions of a person about single hits.

    `block` is the length of a block (s; the longest that fits where left out), `window_end` the end value of the exponential
    window (as much as the slowest mode needs where left out; 1 is none), `sample_rate` for files that do not say it. `hits`
    holds decisions: the name of a hit as `toolpoint frf` lists it to ``accepted`` or ``refused``; else the judgement counts.
    With an `excitation` by shaker, `resolution` is the line spacing, `zoom` the lowest and highest line where not all are asked
    for, and `settle` the number of blocks left out at the start.
    """

    test: str
    records: tuple[RecordsDescription, ...]
    channels: tuple[ChannelDescription, ...] = ()
    estimator: Literal["H1", "H2", "Hv"] = "H1"
    block: Annotated[float, Quantity("time", "s", above=0)] | None = None
    window_end: Annotated[float, Quantity("ratio", "1", above=0, most=1)] | None = None
    sample_rate: Annotated[float, Quantity("frequency", "Hz", above=0)] | None = None
    geometry: str | None = None
    hits: Mapping[str, Literal["accepted", "refused"]] = field(default_factory=dict)
    excitation: Literal["hammer", "random", "burst", "swept", "pseudo-random"] = "hammer"
    resolution: Annotated[float, Quantity("frequency", "Hz", above=0)] | None = None
    zoom: tuple[Annotated[float, Quantity("frequency", "Hz", least=0)], ...] = ()
    settle: int = 0

    @property
    def shaker(self) -> ShakerSettings | None:
        """Settings of a shaker test; None of a hammer test. Raises ToolpointError where the line spacing is missing."""
        if self.excitation == "hammer":
            return None
        if self.resolution is None:
            fail("resolution", "missing", "must be given for a shaker test", remedy="the spacing of its lines, such as 0.5 Hz")
        band = (self.zoom[0], self.zoom[1]) if len(self.zoom) == 2 else None
        return ShakerSettings(self.resolution, self.excitation, self.estimator, band, self.settle)

    @property
    def sensor_masses(self) -> dict[str, float]:
        """Mass that sensors add at each Dof that the channels name, kg."""
        masses: dict[str, float] = {}
        for channel in self.channels:
            if channel.mass and channel.dof and not channel.dof.startswith("*"):
                masses[channel.dof] = masses.get(channel.dof, 0.0) + channel.mass
        return masses

    @property
    def moved_sensor_mass(self) -> float | None:
        """Mass of the sensor that is moved from point to point (`*:+x`), kg: the largest of its channels, None without one."""
        return max((channel.mass for channel in self.channels if channel.mass and (channel.dof or "").startswith("*")),
                   default=None)

    def with_decisions(self, decisions: Mapping[str, bool]) -> HammerTestDescription:
        """Return the description with the decisions of a person about hits by their names (True: accepted), and no other."""
        return replace(self, hits={name: "accepted" if accept else "refused" for name, accept in decisions.items()})
