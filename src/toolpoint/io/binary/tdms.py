"""Files of NI acquisition systems (TDMS), by npTDMS (extra `tdms`); read only."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.io.door import door
from toolpoint.io.text.columns import Columns

LONGEST_COMPLAINT = 300  # characters of the library's words that are repeated


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
    with _library_complaints() as complaints:
        file = TdmsFile.read(path)
    if complaints:
        words = "; ".join(complaints)[:LONGEST_COMPLAINT]
        warnings.warn(f"{path}: the file is not whole: {words}; what could be read is used, later samples may be missing; copy "
                      "the file again", ToolpointWarning, stacklevel=4)
    for group in file.groups():
        channels = [channel for channel in group.channels() if len(channel) and np.asarray(channel[:1]).dtype.kind in "fiu"]
        if channels:
            groups.append(_columns(path, group.name, channels))
    if not groups:
        raise ToolpointError(f"{path}: no channel with samples")
    return groups


@contextmanager
def _library_complaints() -> Iterator[list[str]]:
    """Collect what npTDMS logs while it reads, each sentence once: it logs torn segments to the console and reads on."""
    from nptdms.log import log_manager

    complaints: list[str] = []

    def keep(record: logging.LogRecord) -> bool:
        sentence = record.getMessage().split(" b'", 1)[0].split(' b"', 1)[0]
        if record.levelno >= logging.WARNING and sentence not in complaints:
            complaints.append(sentence)
        return False

    loggers = list(log_manager.loggers.values())
    for logger in loggers:
        logger.addFilter(keep)
    try:
        yield complaints
    finally:
        for logger in loggers:
            logger.removeFilter(keep)


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
