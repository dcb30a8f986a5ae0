"""Devices: doubles of sounddevice and of nidaqmx, a folder that another program fills, a player with faults.

The doubles repeat what the documentation of both packages says; no board and no driver of NI was at hand.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tapping import RATE, stream

from toolpoint._check import ToolpointError
from toolpoint.acquisition import RecordPlayer, list_devices
from toolpoint.acquisition.device import DeviceFault
from toolpoint.acquisition.ni_daqmx import NiInput
from toolpoint.acquisition.record_player import PlayerFaults
from toolpoint.acquisition.sound_card import SoundInput
from toolpoint.acquisition.watched_folder import FolderRecord, WatchedFolder


class DaqError(Exception):
    def __init__(self, code):
        super().__init__(f"Status Code: {code}\nTask Name: _unnamedTask<0>")
        self.error_code = code


class TaskDouble:
    """Task of NI-DAQmx: two channels whose samples count up; errors come where they are told to."""

    made: list[TaskDouble] = []
    errors: dict[int, int] = {}

    def __init__(self):
        self.physical, self.reads, self.starts, self.is_closed, self.count = "", 0, 0, False, 0
        self.ai_channels, self.timing = self, self
        TaskDouble.made.append(self)

    def add_ai_voltage_chan(self, physical, min_val, max_val):
        self.physical, self.range = physical, (min_val, max_val)

    def __len__(self):
        return 1 + (int(self.physical.split(":")[1]) if ":" in self.physical else 0)

    def cfg_samp_clk_timing(self, rate, sample_mode, samps_per_chan):
        self.samp_clk_rate, self.buffer = round(rate / 100) * 100.0, samps_per_chan

    def start(self):
        self.starts += 1

    def stop(self):
        pass

    def close(self):
        self.is_closed = True

    def read(self, number_of_samples_per_channel, timeout):
        self.reads += 1
        if (code := TaskDouble.errors.get(self.reads)) is not None:
            raise DaqError(code)
        values = self.count + np.arange(number_of_samples_per_channel)
        self.count += number_of_samples_per_channel
        return [list(values), list(-values)]


@pytest.fixture
def board(monkeypatch):
    TaskDouble.made, TaskDouble.errors = [], {}
    device = SimpleNamespace(name="Dev1", product_type="USB-4431", ai_physical_chans=[0, 1, 2, 3],
                             ai_max_multi_chan_rate=102400.0, ai_voltage_rngs=[-10.0, 10.0])
    system = SimpleNamespace(System=SimpleNamespace(local=lambda: SimpleNamespace(devices=[device])))
    monkeypatch.setitem(sys.modules, "nidaqmx", SimpleNamespace(
        Task=TaskDouble, constants=SimpleNamespace(AcquisitionType=SimpleNamespace(CONTINUOUS="continuous")), system=system))


def test_a_board_delivers_blocks_at_its_own_rate(board):
    device = NiInput("Dev1", 2, 51_234.0)
    device.open()
    first, second = device.read(1.0), device.read(1.0)
    assert device.rate == 51_200.0 and TaskDouble.made[0].physical == "Dev1/ai0:1" and TaskDouble.made[0].range == (-10.0, 10.0)
    assert TaskDouble.made[0].buffer > 10 * 51_200
    assert first.samples.shape == (1024, 2) and second.start == first.stop == 1024
    assert second.samples[0].tolist() == [1024.0, -1024.0]


def test_an_overwritten_buffer_is_a_gap_and_the_task_goes_on(board):
    TaskDouble.errors = {2: -200279}
    device = NiInput("Dev1", 2, 1000.0)
    device.open()
    assert [device.read(1.0).has_overflow for _ in range(3)] == [False, True, False]
    assert TaskDouble.made[0].starts == 2


@pytest.mark.parametrize("code", [-201003, -88710])
def test_a_board_that_is_unplugged_is_a_fault(board, code):
    TaskDouble.errors = {1: -200284, 2: code}
    device = NiInput("cDAQ1Mod1/ai0:1", 2, 1000.0)
    device.open()
    assert device.read(1.0) is None
    with pytest.raises(DeviceFault, match=f"cDAQ1Mod1/ai0:1: Status Code: {code}; it was unplugged"):
        device.read(1.0)


def test_a_board_of_other_channels_is_refused(board):
    with pytest.raises(DeviceFault, match="2 inputs; 3 channels are described"):
        NiInput("Dev1/ai0:1", 3, 1000.0).open()
    assert TaskDouble.made[0].is_closed


class StreamDouble:
    """InputStream of sounddevice that calls back at once."""

    def __init__(self, device, samplerate, channels, dtype, latency, callback):
        if samplerate == 1.0:
            raise ValueError("Invalid sample rate")
        self.channels, self.callback, self.active = channels, callback, True

    def start(self):
        buffer = np.zeros((480, self.channels), "f4")
        for k in range(3):
            buffer[:] = k  # the buffer is used again, as PortAudio does
            self.callback(buffer, 480, None, SimpleNamespace(input_overflow=k == 1))
        self.active = False

    def close(self):
        pass


@pytest.fixture
def card(monkeypatch):
    entries = [{"name": "HDMI", "max_input_channels": 0, "default_samplerate": 44100.0},
               {"name": "USB interface", "max_input_channels": 2, "default_samplerate": 48000.0}]
    monkeypatch.setitem(sys.modules, "sounddevice", SimpleNamespace(
        query_devices=lambda: entries, default=SimpleNamespace(device=(1, 0)), InputStream=StreamDouble,
        PortAudioError=OSError))


def test_blocks_of_a_sound_card_are_copies_with_its_flags(card):
    device = SoundInput("usb", 2)
    device.open()
    blocks = [device.read(0.1) for _ in range(3)]
    assert [block.samples[0, 0] for block in blocks] == [0.0, 1.0, 2.0]
    assert [block.has_overflow for block in blocks] == [False, True, False]
    assert [block.start for block in blocks] == [0, 480, 960]
    with pytest.raises(DeviceFault, match="unplugged"):
        device.read(0.1)


def test_a_card_that_falls_silent_is_gone_though_its_stream_stays_active(card, monkeypatch):
    monkeypatch.setattr("toolpoint.acquisition.sound_card.MAX_SILENCE_SECONDS", 0.3)
    device = SoundInput("usb", 2)
    device.open()
    device._stream.active = True
    for _ in range(3):
        device.read(0.1)
    assert device.read(0.05) is None
    time.sleep(0.3)
    with pytest.raises(DeviceFault, match="no samples come any more"):
        device.read(0.05)


def test_inputs_that_a_card_has_not_are_refused(card):
    with pytest.raises(ToolpointError, match="USB interface has 2 inputs; channel 3 is described"):
        SoundInput("", 3)
    with pytest.raises(ToolpointError, match=r"no such input; .*1: USB interface"):
        SoundInput("Focusrite")
    with pytest.raises(ToolpointError, match="refused"):
        SoundInput("1", 2, 1.0).open()


def test_devices_are_listed_with_what_is_missing(card, board, monkeypatch):
    assert [device.address for device in list_devices().devices] == ["sound:1", "ni:Dev1"]
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    listed = list_devices()
    assert listed.devices == () and all("toolpoint[acquisition]" in reason for reason in listed.unavailable)
    assert "no device was found" in listed.table() and listed.to_dict()["devices"] == []


def test_a_player_in_real_time_takes_its_time():
    player = RecordPlayer([stream((100.0,))[:1000]], RATE, speed=2.0)
    player.open()
    begun, blocks = time.monotonic(), []
    for _ in range(20):
        blocks.append(player.read(1.0))
    with pytest.raises(StopIteration):
        player.read(1.0)
    assert 0.09 < time.monotonic() - begun < 0.5
    assert blocks[-1].stop == 1000 and sum(block.lost_count for block in blocks) == 0


def test_samples_that_nobody_tells_of_are_found_by_the_clock():
    faults = PlayerFaults(lost_at=20_000, lost_count=500, is_told=False)
    player = RecordPlayer([np.zeros((40_000, 1))], RATE, speed=None, faults=faults)
    player.open()
    blocks = [player.read(1.0) for _ in range(750)]
    found = [block for block in blocks if block.lost_count]
    assert [block.lost_count for block in found] == [500] and found[0].lost_since <= 20_000 < found[0].stop
    assert not any(block.has_overflow for block in blocks)


def test_a_file_is_taken_when_it_is_whole(tmp_path: Path):
    def read(path):
        return FolderRecord(np.load(path), None, ("a", "b"), ("V", "V"))

    np.save(tmp_path / "old.npy", np.zeros((5, 2)))
    folder = WatchedFolder(tmp_path, read, "*.npy", rate=100.0)
    folder.open()
    assert folder.read(0.0) is None
    content = (tmp_path / "old.npy").read_bytes()
    with (tmp_path / "new.npy").open("wb") as file:
        file.write(content[:100])
        file.flush()
        assert folder.read(0.1) is None
        file.write(content[100:])
    block = folder.read(2.0)
    assert block.is_record and block.name == "new.npy" and block.samples.shape == (5, 2) and folder.rate == 100.0
    np.save(tmp_path / "other.npy", np.zeros((5, 3)))
    folder._read = lambda path: FolderRecord(np.load(path), None, ("a", "b", "c"), ("V",) * 3)
    with pytest.raises(DeviceFault, match="3 channels at 100 Hz; must be 2"):
        folder.read(2.0)


def test_a_folder_that_is_not_there_is_a_fault(tmp_path: Path):
    with pytest.raises(DeviceFault, match="no such folder"):
        WatchedFolder(tmp_path / "none", lambda path: None).open()
