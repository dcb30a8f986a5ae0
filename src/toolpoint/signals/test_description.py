"""Description of a hammer test as plain data, one to one with a test file: channels, records, settings, decisions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from toolpoint._quantity import Quantity

Motion = Literal["force", "acceleration", "velocity", "displacement", "ignored"]


@dataclass(frozen=True)
class ChannelDescription:
    """Channel of the records: its quantity, its place, and its sensor.

    `channel` is its name in the files, or its number from 1. `dof` is a label such as ``5:-z``; of the force channel it is
    where and in which direction the hammer strikes. `sensitivity`, such as ``2.25 mV/N`` or ``100 mV/g`` (a number: V per SI
    unit), is needed where the files hold volts; a negative one turns the channel. `full_scale`: volts of the largest sample of
    a sound file. The point ``*`` (``*:+x``) is that of a sensor whose place stands in names of files as ``{output}``.
    """

    channel: str
    quantity: Motion | None = None
    dof: str | None = None
    sensitivity: str | float | None = None
    full_scale: Annotated[float, Quantity("voltage", "V", above=0)] | None = None


@dataclass(frozen=True)
class RecordsDescription:
    """Files of one struck Dof: names, or patterns such as ``tip_*.csv``, relative to the test file; `struck` where the channels
    do not say it; `pattern` reads Dofs from names: ``P{input}_*``."""

    files: tuple[str, ...]
    struck: str | None = None
    pattern: str | None = None


@dataclass(frozen=True)
class HammerTestDescription:
    """Hammer test: its name, records, channels, settings, and decisions of a person about single hits.

    `block` is the length of a block (s; the longest that fits where left out), `window_end` the end value of the exponential
    window (as much as the slowest mode needs where left out; 1 is none), `sample_rate` for files that do not say it. `hits`
    holds decisions: the name of a hit as `toolpoint frf` lists it to ``accepted`` or ``refused``; else the judgement counts.
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

    def with_decisions(self, decisions: Mapping[str, bool]) -> HammerTestDescription:
        """Return the description with the decisions of a person about hits by their names (True: accepted), and no other."""
        return replace(self, hits={name: "accepted" if accept else "refused" for name, accept in decisions.items()})
