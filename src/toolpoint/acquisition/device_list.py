"""List of the available inputs of every kind of device, with the reason where a kind has none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from toolpoint._check import ToolpointError
from toolpoint._notebook import NotebookText
from toolpoint.acquisition.device import DeviceDescription
from toolpoint.acquisition.ni_daqmx import list_ni_inputs
from toolpoint.acquisition.sound_card import list_sound_inputs

ALWAYS_THERE = (("folder:PATH", "a folder into which another program writes records, one file a blow"),
                ("play:FILES", "recorded files, played as if a device delivered them; play:FILES@10 ten times faster"))


@dataclass(frozen=True, eq=False)
class DeviceList(NotebookText):
    """Devices that were found, and what to install where a kind could not be asked."""

    devices: tuple[DeviceDescription, ...]
    unavailable: tuple[str, ...] = ()

    def table(self) -> str:
        """Return the devices as lines: address, inputs, rate, ranges, name."""
        lines = [f"{device.address:<16} {device.inputs:>3} inputs  {device.rate:>8g} Hz  {device.ranges}  {device.name}"
                 for device in self.devices] or ["no device was found"]
        lines += [f"{address:<16} {words}" for address, words in ALWAYS_THERE]
        return "\n".join([*lines, *self.unavailable])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"devices": [vars(device) for device in self.devices], "unavailable": list(self.unavailable)}


def list_devices() -> DeviceList:
    """Return the inputs of PortAudio and NI-DAQmx.

    Examples
    --------
    >>> from toolpoint.acquisition import list_devices
    >>> "play:FILES" in list_devices().table()
    True
    """
    devices, reasons = list[DeviceDescription](), list[str]()
    for listing in (list_sound_inputs, list_ni_inputs):
        try:
            devices += listing()
        except ToolpointError as error:
            reasons.append(str(error))
    return DeviceList(tuple(devices), tuple(reasons))
