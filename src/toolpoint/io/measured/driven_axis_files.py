"""Records of an axis that shakes itself: the column of the set point apart, that of the motor's force, and the motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, suggestion
from toolpoint.io.measured.channels import Labels, label_columns, parse_channel
from toolpoint.io.measured.record_files import read_columns
from toolpoint.signals.test_description import ChannelDescription
from toolpoint.vibration import Dof, Record


@dataclass(frozen=True)
class AxisColumns:
    """Columns of a file by name or number: the set point (any unit), the motor's force (or current, torque) with the newtons at
    the axis in one of its units, and where it acts.

    >>> AxisColumns("SetPos", "Current", newtons=310.0, struck="table:+x").newtons  # N a ampere: 2 pi K_t / lead
    310.0
    """

    set_point: str
    force: str
    newtons: float
    struck: str


def read(path: str | Path, columns: AxisColumns, channels: Sequence[str] = (), *, rate: float | None = None
         ) -> tuple[FloatArray, Record]:
    """Return the set point (n_samples,) and the record of force and motions of one file.

    channels : descriptions of the motions, as for hammer records; others are left out.

    Raises
    ------
    ToolpointError
        For columns that are not there, and files of which nothing is known as a motion.
    """
    path = Path(path)
    table = read_columns(path, rate)
    if table.sample_rate is None:
        raise ToolpointError(f"{path}: no sample rate; give it with `rate`, Hz")
    places = [_place(path, table.names, name) for name in (columns.set_point, columns.force)]
    described = [parse_channel(text) for text in channels]
    described += [ChannelDescription(table.names[place], "ignored") for place in dict.fromkeys(places)]
    motions = label_columns(path, table, described, labels=Labels())
    keep = [k for k, quantity in enumerate(motions.quantities) if quantity != "force"]
    if not keep:
        raise ToolpointError(f"{path}: no motion besides set point and force; describe one with `channel`")
    samples = np.column_stack([columns.newtons * table.samples[:, places[1]], motions.samples[:, keep]])
    return table.samples[:, places[0]], replace(
        motions, samples=samples, channels=(Dof.parse(columns.struck), *(motions.channels[k] for k in keep)),
        quantities=("force", *(motions.quantities[k] for k in keep)), units=())


def _place(path: Path, names: Sequence[str], name: str) -> int:
    """Return the number of a column by its name or its number from 1."""
    lower = [each.lower() for each in names]
    if name.lower() in lower:
        return lower.index(name.lower())
    if name.isdigit() and 1 <= int(name) <= len(names):
        return int(name) - 1
    raise ToolpointError(f"{path}: no column {name!r}; {suggestion(name, names)} it holds {', '.join(names)}")
