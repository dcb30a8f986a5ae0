"""Files of NI acquisition systems (TDMS), by npTDMS (extra `tdms`); read only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint.io.door import door
from toolpoint.io.text.columns import Columns


@door("TDMS file")
def read_columns(path: str | Path) -> list[Columns]:
    """Return the channels of every group that holds waveforms of one rate and length; units and names as the file states
    them."""
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise ToolpointError(f"{path}: TDMS files are read by npTDMS; install it with pip install 'toolpoint[tdms]'") from None
    path = Path(path)
    if not path.is_file():
        raise ToolpointError(f"{path}: no such file; check the name and the folder")
    groups = []
    for group in TdmsFile.read(path).groups():
        channels = [channel for channel in group.channels() if len(channel) and np.asarray(channel[:1]).dtype.kind in "fiu"]
        if channels:
            groups.append(_columns(path, group.name, channels))
    if not groups:
        raise ToolpointError(f"{path}: no channel with samples")
    return groups


def _columns(path: Path, group: str, channels: list[Any]) -> Columns:
    steps = {round(float(channel.properties.get("wf_increment", 0.0)), 12) for channel in channels}
    lengths = {len(channel) for channel in channels}
    if len(steps) > 1 or len(lengths) > 1:
        raise ToolpointError(f"{path}: group {group!r} holds channels of {len(steps)} rates and lengths {sorted(lengths)}; "
                             "must share both; export them apart")
    step = steps.pop()
    units = tuple(str(channel.properties.get("unit_string", channel.properties.get("NI_UnitDescription", "")))
                  for channel in channels)
    samples = np.stack([np.asarray(channel[:], float) for channel in channels], axis=1)
    return Columns(tuple(channel.name for channel in channels), units, samples, 1 / step if step > 0 else None,
                   float(channels[0].properties.get("wf_start_offset", 0.0)))
