"""Acquisition: samples from devices, block by block, with time, overflow and lost samples; blows cut out of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.acquisition.blow_capture import BlowCapture, CapturedBlow
    from toolpoint.acquisition.channels import InputChannel, InputChannels
    from toolpoint.acquisition.device import DeviceDescription, SampleBlock, SampledInput
    from toolpoint.acquisition.device_list import list_devices
    from toolpoint.acquisition.record_player import RecordPlayer
    from toolpoint.acquisition.sample_clock import SampleClock
    from toolpoint.acquisition.watched_folder import WatchedFolder

__all__ = ["BlowCapture", "CapturedBlow", "DeviceDescription", "InputChannel", "InputChannels", "RecordPlayer", "SampleBlock",
           "SampleClock", "SampledInput", "WatchedFolder", "list_devices"]

__getattr__, __dir__ = export_lazily(__name__, {
    "blow_capture": ("BlowCapture", "CapturedBlow"),
    "channels": ("InputChannel", "InputChannels"),
    "device": ("DeviceDescription", "SampleBlock", "SampledInput"),
    "device_list": ("list_devices",),
    "record_player": ("RecordPlayer",),
    "sample_clock": ("SampleClock",),
    "watched_folder": ("WatchedFolder",),
})
