"""Acquisition boards of NI, by nidaqmx (extra `acquisition`) over the driver NI-DAQmx.

Written against the documented interface of nidaqmx 1.x and tested with a double of it: no board and no driver were at hand.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.acquisition.device import INSTALL, DeviceDescription, DeviceFault, SampleBlock

BOARD_READ_SECONDS = 0.02  # s of samples in a block
DRIVER_BUFFER_SECONDS = 20.0  # s that the driver keeps: longer than any pause of the program
DEFAULT_RANGE = 10.0  # V
# Overwritten in the driver's buffer, or in that of the board: error numbers of NI-DAQmx.
OVERFLOW_ERRORS = (-200279, -200361)
TIMEOUT_ERROR = -200284  # number of NI-DAQmx: samples not yet there


def load_nidaqmx() -> Any:
    """Return the module nidaqmx; ToolpointError where it is not installed."""
    try:
        import nidaqmx
    except ImportError:
        raise ToolpointError(f"device: NI boards need nidaqmx; install it with {INSTALL}, and the driver NI-DAQmx") from None
    return nidaqmx


def list_ni_inputs() -> list[DeviceDescription]:
    """Return the boards with analog inputs that the driver knows; ToolpointError where the driver is not installed."""
    library = load_nidaqmx()
    try:
        boards = list(library.system.System.local().devices)
        return [DeviceDescription(f"ni:{board.name}", str(board.product_type), len(board.ai_physical_chans),
                                  float(board.ai_max_multi_chan_rate), ", ".join(f"±{v:g} V" for v in sorted({
                                      abs(float(v)) for v in board.ai_voltage_rngs})))
                for board in boards if len(board.ai_physical_chans)]
    except Exception as error:  # the package has an error class of its own for every missing part of the driver
        raise ToolpointError(f"device: the driver NI-DAQmx does not answer ({str(error).splitlines()[0]}); install it, and see "
                             "the board in its own program first") from None


class NiInput:
    """Analog inputs of a board, in volts.

    physical : ``Dev1`` (as many inputs as are described, from ai0) or ``cDAQ1Mod1/ai0:3``; channels : number of inputs; rate :
    Hz; limit : V.
    """

    def __init__(self, physical: str, channels: int, rate: float, *, limit: float = DEFAULT_RANGE) -> None:
        self._library = load_nidaqmx()
        self.physical = physical if "/" in physical else f"{physical}/ai0" + (f":{channels - 1}" if channels > 1 else "")
        self.rate, self._limit = float(rate), limit
        self.names = tuple(f"channel {k + 1}" for k in range(channels))
        self.units = ("V",) * channels
        self.ranges: tuple[float | None, ...] = (limit,) * channels
        self.doubts: tuple[Doubt, ...] = ()
        self._task: Any = None
        self._delivered = 0

    def open(self) -> None:
        """Make the task and start it; DeviceFault where the board refuses."""
        library = self._library
        try:
            self._task = library.Task()
            self._task.ai_channels.add_ai_voltage_chan(self.physical, min_val=-self._limit, max_val=self._limit)
            if (count := len(self._task.ai_channels)) != len(self.names):
                raise DeviceFault(f"device ni:{self.physical}: {count} inputs; {len(self.names)} channels are described; must "
                                  "be as many")
            self._task.timing.cfg_samp_clk_timing(self.rate, sample_mode=library.constants.AcquisitionType.CONTINUOUS,
                                                  samps_per_chan=round(DRIVER_BUFFER_SECONDS * self.rate))
            # Boards with converters of their own clock take the nearest rate that they have.
            self.rate = float(self._task.timing.samp_clk_rate)
            self._task.start()
        except DeviceFault:
            self.close()
            raise
        except Exception as error:
            self.close()
            raise DeviceFault(f"device ni:{self.physical}: {_first_line(error)}; see the board in NI MAX, and its highest "
                              "rate") from None

    def read(self, timeout: float) -> SampleBlock | None:
        """Return the next 20 ms of samples; a block behind an overwritten buffer says so."""
        count = max(round(BOARD_READ_SECONDS * self.rate), 1)
        has_overflow = False
        while True:
            try:
                values = self._task.read(number_of_samples_per_channel=count, timeout=timeout)
                break
            except Exception as error:
                number = getattr(error, "error_code", None)
                if number == TIMEOUT_ERROR:
                    return None
                if number not in OVERFLOW_ERRORS or has_overflow:
                    raise DeviceFault(f"device ni:{self.physical}: {_first_line(error)}; it was unplugged, or its driver "
                                      "stopped") from None
                # The task ends with this error: it begins anew, and the gap is told.
                has_overflow = True
                self._task.stop()
                self._task.start()
        samples = np.atleast_2d(np.asarray(values, float)).T
        block = SampleBlock(samples, self._delivered, time.monotonic(), has_overflow)
        self._delivered = block.stop
        return block

    def close(self) -> None:
        """End the task."""
        if self._task is not None:
            self._task.close()
            self._task = None


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]
