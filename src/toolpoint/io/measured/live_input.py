"""Inputs of a live test by their addresses, with what each channel measures, described as for records in files."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from toolpoint._check import ToolpointError, suggestion
from toolpoint.acquisition.channels import InputChannel, InputChannels
from toolpoint.acquisition.device import SampledInput
from toolpoint.acquisition.ni_daqmx import DEFAULT_RANGE, NiInput
from toolpoint.acquisition.record_player import RecordPlayer
from toolpoint.acquisition.sound_card import FULL_SCALE_UNIT, SoundInput
from toolpoint.acquisition.watched_folder import FolderRecord, WatchedFolder
from toolpoint.io.binary.sound import read as read_sound
from toolpoint.io.measured.channels import Labels, label_columns, parse_channel
from toolpoint.io.measured.record_files import read_columns
from toolpoint.io.suffixes import SOUND, VIDEO, WAV
from toolpoint.io.text.columns import Columns
from toolpoint.signals.test_description import ChannelDescription, Motion

KINDS_OF_INPUT = ("sound", "ni", "folder", "play")
FORM_OF_ADDRESS = "sound, sound:NAME, ni:Dev1, ni:cDAQ1Mod1/ai0:1, folder:PATH, play:FILE or play:FILE@10 (ten times faster)"
DEFAULT_RATE = 51_200.0  # Hz, of NI boards for vibration


@dataclass(frozen=True, eq=False)
class LiveInput:
    """A device with the channels of a test, and their description for the test file of the records that are kept.

    Examples
    --------
    Runs in ``examples/tap_while_you_strike.py``.
    """

    device: SampledInput
    inputs: InputChannels
    described: tuple[ChannelDescription, ...]
    notes: tuple[str, ...]


def open_input(address: str, channels: Sequence[str], rate: float | None = None, *, limit: float | None = None,
               wait: Callable[[str], None] = lambda words: None) -> LiveInput:
    """Return the input of an address with its described channels.

    Parameters
    ----------
    address : str
        ``sound``, ``sound:2``, ``sound:USB``, ``ni:Dev1``, ``folder:PATH``, ``play:FILE`` ..
    channels : sequence of str
        Descriptions such as ``1=force tip:+x 2.25mV/N``; of a sound card with the volts of its full scale.
    rate : float, optional
        Hz; the device's own where left out.
    limit : float, optional
        Range of an NI board, V.
    wait : callable
        Called with words once the first record of a watched folder is waited for: what is written from then on is taken.

    Raises
    ------
    ToolpointError
        For an address that is none, a device that is not there, channels that it has not, sensitivities that are missing.

    Examples
    --------
    Runs in ``examples/tap_while_you_strike.py``.
    """
    described = [parse_channel(text) for text in channels]
    device = _device_of(address, _channel_count(described), rate, limit=limit, wait=wait)
    return _with_channels(device, described, address)


def open_microphone(address: str, rate: float | None = None, channels: int = 1) -> SampledInput:
    """Return the input of an address for listening: its channels need no description."""
    return _device_of(address, channels, rate)


def _channel_count(described: Sequence[ChannelDescription]) -> int | None:
    """Return the highest number of a described channel; None where some are described by name."""
    numbers = [int(part.channel) for part in described if part.channel.isdigit()]
    return max(numbers) if numbers and len(numbers) == len(described) else None


def _device_of(address: str, count: int | None, rate: float | None, *, limit: float | None = None,
               wait: Callable[[str], None] = lambda words: None) -> SampledInput:
    kind, _, place = address.partition(":")
    if kind not in KINDS_OF_INPUT or (kind in ("ni", "folder", "play") and not place):
        raise ToolpointError(f"device {address!r}: must be {FORM_OF_ADDRESS}; {suggestion(kind, KINDS_OF_INPUT)} `toolpoint "
                             "devices` lists what is there")
    if kind == "sound":
        return SoundInput(place, count, rate)
    if kind == "ni":
        return NiInput(place, count or 1, rate or DEFAULT_RATE, limit=limit or DEFAULT_RANGE)
    if kind == "folder":
        folder = WatchedFolder(place, _read_folder_record, rate=rate)
        folder.open()
        wait(f"waiting for the first record in {place}")
        folder.wait_for_first()
        return folder
    return _player_of(place, rate)


def _player_of(place: str, rate: float | None) -> RecordPlayer:
    """Return the player of files, parted by commas, with their speed behind an @."""
    match = re.fullmatch(r"(.+?)(?:@([\d.]+|max))?", place)
    files, speed = (match[1], match[2]) if match else (place, None)
    parts = [_read_folder_record(Path(name)) for name in files.split(",")]
    rates = {part.rate or rate for part in parts}
    if len(rates) > 1 or None in rates:
        raise ToolpointError(f"device play:{files}: rates {', '.join(str(each) for each in rates)}; must be one rate; give "
                             "`rate` where the files do not say it")
    factor = None if speed == "max" else float(speed or 1.0)
    return RecordPlayer([part.samples for part in parts], float(rates.pop() or 0.0), speed=factor, names=parts[0].names,
                        units=parts[0].units)


def _read_folder_record(path: Path) -> FolderRecord:
    """Return the columns of a file of any format of records, or of a sound file."""
    if path.suffix.lower() in (*SOUND, *VIDEO) and path.suffix.lower() not in WAV:
        record = read_sound(path)
        names = tuple(f"channel {k + 1}" for k in range(record.samples.shape[1]))
        return FolderRecord(record.samples, record.sample_rate, names, (FULL_SCALE_UNIT,) * len(names))
    columns = read_columns(path)
    return FolderRecord(columns.samples, columns.sample_rate, columns.names, columns.units)


def _with_channels(device: SampledInput, described: Sequence[ChannelDescription], address: str) -> LiveInput:
    """Return a device with its channels, labelled by the same rules as columns of a file."""
    labels = Labels()
    units = tuple(_unit_for_labels(device, k, described) for k in range(len(device.names)))
    count = len(device.names)
    # Two rows tell what the labels make of the columns: the factor of each, and which column of the device it was.
    probe = np.array([np.ones(count), np.arange(1.0, count + 1.0)])
    record = label_columns(Path(address), Columns(device.names, units, probe, device.rate), described, labels=labels)
    factors = record.samples[0]
    columns = [round(value) - 1 for value in record.samples[1] / factors]
    by_column = {k: part for part in described for k in range(count) if _is_of(part, device.names[k], k)}
    channels, kept = list[InputChannel](), list[ChannelDescription]()
    for place, column in enumerate(columns):
        part = by_column.get(column, ChannelDescription(str(column + 1)))
        quantity, dof = record.quantities[place], record.channels[place]
        in_volts = part.sensitivity is not None
        full_scale = part.full_scale if device.units[column] == FULL_SCALE_UNIT and part.full_scale else 1.0
        channels.append(InputChannel(column, quantity, dof, float(factors[place]) if in_volts else 1.0,
                                     full_scale if in_volts else float(factors[place]), device.ranges[column]))
        kept.append(replace(part, channel=str(place + 1), quantity=cast(Motion, quantity), dof=dof.text, full_scale=None))
    return LiveInput(device, InputChannels(tuple(channels)), tuple(kept), tuple(labels.notes))


def _unit_for_labels(device: SampledInput, column: int, described: Sequence[ChannelDescription]) -> str:
    """Return the unit of a column; a sound input whose full scale in volts is stated is kept in volts."""
    unit = device.units[column]
    stated = [part for part in described if _is_of(part, device.names[column], column) and part.full_scale]
    return "V" if unit == FULL_SCALE_UNIT and stated else unit


def _is_of(part: ChannelDescription, name: str, column: int) -> bool:
    return part.channel.strip().lower() in (name.lower(), str(column + 1))
