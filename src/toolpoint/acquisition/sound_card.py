"""Sound cards and every other input that PortAudio knows, by sounddevice (extra `acquisition`)."""

from __future__ import annotations

import queue
import time
from dataclasses import replace
from typing import Any

from toolpoint._check import FloatArray, ToolpointError, suggestion
from toolpoint._doubt import Doubt
from toolpoint.acquisition.device import INSTALL, DeviceDescription, DeviceFault, SampleBlock
from toolpoint.acquisition.sample_clock import SampleClock

FULL_SCALE_UNIT = "full scale"
SOUND_BUFFER_SECONDS = 0.5  # s between device and program: a busy machine lost samples of the usual 35 ms
MAX_SILENCE_SECONDS = 2.0  # s without a block after which the device is taken as gone
AC_COUPLED = Doubt("sound input", "inputs of sound cards are AC coupled: they let the force of a blow and slow motion droop, "
              "so responses below about 20 Hz come out wrong, and their volts are not calibrated",
              "check the scale by a blow on a known free mass; trust no line below 20 Hz")


def load_portaudio() -> Any:
    """Return the module sounddevice; ToolpointError where it, or the library below it, is not installed."""
    try:
        import sounddevice
    except ImportError:
        raise ToolpointError(f"device: sound inputs need sounddevice; install it with {INSTALL}") from None
    except OSError as error:
        raise ToolpointError(f"device: sounddevice finds no PortAudio ({error}); install the system's package of it "
                             "(libportaudio2 on Debian)") from None
    return sounddevice


def list_sound_inputs() -> list[DeviceDescription]:
    """Return the inputs that PortAudio knows."""
    return [DeviceDescription(f"sound:{number}", str(entry["name"]), int(entry["max_input_channels"]),
                              float(entry["default_samplerate"]), "shares of the full scale")
            for number, entry in enumerate(load_portaudio().query_devices()) if entry["max_input_channels"] > 0]


class SoundInput:
    """Input of a sound card.

    name : number or part of the name, empty for the system's default; channels : number of inputs to take; rate : Hz, the
    device's own where None.
    """

    def __init__(self, name: str = "", channels: int | None = None, rate: float | None = None) -> None:
        self._library = load_portaudio()
        entry, self._number = _find_input(self._library, name)
        count = int(entry["max_input_channels"]) if channels is None else channels
        if count > entry["max_input_channels"]:
            raise ToolpointError(f"device: {entry['name']} has {entry['max_input_channels']} inputs; channel {count} is "
                                 "described; describe no more channels than it has, or choose another device (toolpoint "
                                 "devices)")
        self.rate = float(rate or entry["default_samplerate"])
        self.names = tuple(f"channel {k + 1}" for k in range(count))
        self.units = (FULL_SCALE_UNIT,) * count
        self.ranges: tuple[float | None, ...] = (1.0,) * count
        self.doubts: tuple[Doubt, ...] = (AC_COUPLED,)
        self._stream: Any = None
        # The callback runs in a thread of PortAudio: it may copy and enqueue, nothing that waits.
        self._queue = queue.SimpleQueue[tuple[FloatArray, bool, float]]()
        self._delivered, self._clock = 0, SampleClock(self.rate)
        self._last_arrival = 0.0

    def open(self) -> None:
        """Start the stream; ToolpointError where the device refuses rate or channels."""
        def _take(samples: FloatArray, frames: int, times: Any, status: Any) -> None:
            self._queue.put((samples.copy(), bool(status.input_overflow), time.monotonic()))
        try:
            self._stream = self._library.InputStream(device=self._number, samplerate=self.rate, channels=len(self.names),
                                                     dtype="float32", latency=SOUND_BUFFER_SECONDS,
                                                     callback=_take)
            self._stream.start()
            self._last_arrival = time.monotonic()
        except (self._library.PortAudioError, ValueError) as error:
            raise ToolpointError(f"device: {len(self.names)} inputs at {self.rate:g} Hz are refused ({error}); take another "
                                 "`rate` or fewer channels") from None

    def read(self, timeout: float) -> SampleBlock | None:
        """Return the next block; DeviceFault where none has come for two seconds."""
        try:
            samples, has_overflow, arrival = self._queue.get(timeout=min(timeout, MAX_SILENCE_SECONDS))
        except queue.Empty:
            # Few systems tell PortAudio of a device that is pulled out: its stream stays active, and silent.
            if time.monotonic() - self._last_arrival < MAX_SILENCE_SECONDS and self._stream.active:
                return None
            raise DeviceFault("device: no samples come any more; it was unplugged, or another program took it") from None
        self._last_arrival = arrival
        if samples.shape[1] != len(self.names):
            raise DeviceFault(f"device: blocks of {samples.shape[1]} channels; must be {len(self.names)}, as it was opened")
        if has_overflow:
            self._clock.accept_gap()
        lost_count = self._clock.count(samples.shape[0], arrival)
        block = SampleBlock(samples.astype(float), self._delivered, arrival, has_overflow)
        self._delivered = block.stop
        return replace(block, lost_count=lost_count, lost_since=self._clock.lost_since) if lost_count else block

    def close(self) -> None:
        """Stop the stream."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def _find_input(library: Any, name: str) -> tuple[Any, int]:
    """Return the entry and number of the input that a name or number means."""
    devices = [(number, entry) for number, entry in enumerate(library.query_devices()) if entry["max_input_channels"] > 0]
    if not devices:
        raise ToolpointError("device: the system has no sound input; plug one in, or see `toolpoint devices`")
    default = library.default.device[0]
    fitting = [(number, entry) for number, entry in devices
               if (number == default if not name else str(number) == name or name.lower() in str(entry["name"]).lower())]
    if not fitting:
        names = [str(entry["name"]) for _, entry in devices]
        raise ToolpointError(f"device sound:{name}: no such input; {suggestion(name, names)} there are "
                             + ", ".join(f"{number}: {entry['name']}" for number, entry in devices))
    number, entry = next(((n, e) for n, e in fitting if str(e["name"]).lower() == name.lower()), fitting[0])
    return entry, number
