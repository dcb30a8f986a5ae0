"""Settings of a recording as a page asks for them, each checked; a device that reads files stays in open folders."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from toolpoint._check import ToolpointError, fail
from toolpoint.workbench.state.access import check_file_name, path_beneath

RECORDS_FOLDER = "records"  # of the project, where the blows of a recording lie
MAX_CHANNELS, MAX_TEXT_LENGTH, MAX_BLOWS = 32, 200, 200  # what a page may ask for: refused before a device is opened
MAX_BLOCK_SECONDS, MAX_RATE = 60.0, 1e6  # s; Hz
FILE_DEVICES = ("folder", "play")  # kinds of devices that read files


@dataclass(frozen=True)
class RecordingSettings:
    """Settings of a recording.

    name : of the test; device : as `tap --device` takes it; address : the same with resolved paths; channels : descriptions;
    blows : good ones that are asked for; block : length of a record, s; rate : Hz; trigger : N.
    """

    name: str
    device: str
    address: str
    channels: tuple[str, ...]
    blows: int = 5
    block: float = 1.0
    rate: float | None = None
    trigger: float | None = None

    @classmethod
    def of(cls, data: Mapping[str, Any], root: Path, further: Sequence[Path] = ()) -> RecordingSettings:
        """Return the settings of a request.

        root : the project's folder; further : other folders from which records may be read.

        Raises ToolpointError for a number out of range, a name that is no plain one, a folder that is not open to the page.
        """
        name = check_file_name(_text(data, "name"))
        path_beneath(root, f"{RECORDS_FOLDER}/{name}")
        device, channels = _text(data, "device"), data.get("channels")
        if not isinstance(channels, list) or not 1 <= len(channels) <= MAX_CHANNELS or not all(
                isinstance(text, str) and len(text) <= MAX_TEXT_LENGTH for text in channels):
            fail("channels", type(channels).__name__, f"must be 1 to {MAX_CHANNELS} texts such as '1=force tip:+x 2.25mV/N'")
        return cls(name, device, _resolved(device, (root, *further)), tuple(channels),
                   int(_number(data, "blows", MAX_BLOWS) or cls.blows), _number(data, "block", MAX_BLOCK_SECONDS) or cls.block,
                   _number(data, "rate", MAX_RATE), _number(data, "trigger", MAX_RATE))

    @property
    def folder(self) -> str:
        """Folder of the blows, relative to the project."""
        return f"{RECORDS_FOLDER}/{self.name}"

    @property
    def is_watched(self) -> bool:
        """Whether whole records come from a folder: their length is their own."""
        return self.device.startswith("folder:")

    def of_process(self) -> dict[str, Any]:
        """Return what the process of the recording takes."""
        return {"device": self.address, "channels": list(self.channels), "folder": self.folder, "blows": self.blows,
                "block": self.block, "rate": self.rate, "trigger": self.trigger}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**vars(self), "channels": list(self.channels), "folder": self.folder}


def _resolved(device: str, roots: Sequence[Path]) -> str:
    """Return a device with the paths in it resolved; ToolpointError where one lies in none of the folders."""
    kind, _, place = device.partition(":")
    if kind not in FILE_DEVICES:
        return device
    match = re.fullmatch(r"(.+?)(@(?:[\d.]+|max))?", place)
    files, speed = (match[1], match[2] or "") if match and kind == "play" else (place, "")
    paths = [str(_within(text, roots)) for text in (files.split(",") if kind == "play" else [files])]
    return f"{kind}:{','.join(paths)}{speed}"


def _within(text: str, roots: Sequence[Path]) -> Path:
    for root in roots:
        try:
            return path_beneath(root, text)
        except ToolpointError:
            continue
    raise ToolpointError(f"{text}: lies outside the project; let the other program write into a folder of the project, or open "
                         "its folder to the page by `toolpoint serve --records FOLDER`")


def _text(data: Mapping[str, Any], name: str) -> str:
    value = data.get(name)
    if not isinstance(value, str) or not value.strip() or len(value) > MAX_TEXT_LENGTH:
        fail(name, type(value).__name__, f"must be a text of 1 to {MAX_TEXT_LENGTH} characters")
    return value.strip()


def _number(data: Mapping[str, Any], name: str, largest: float) -> float | None:
    value = data.get(name)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= largest:
        fail(name, repr(value), f"must be a number above zero, at most {largest:g}")
    return float(value)
