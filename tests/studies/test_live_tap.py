"""Live tap test: the same result as from its files, whatever happens on the way; every blow that was heard of is on disk."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tapping

from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.acquisition import InputChannel, InputChannels, RecordPlayer
from toolpoint.acquisition.device import DeviceFault
from toolpoint.acquisition.record_player import PlayerFaults
from toolpoint.io.measured.live_input import LiveInput
from toolpoint.signals.test_description import ChannelDescription
from toolpoint.studies import BlowVerdict, LiveProgress, LiveTap
from toolpoint.vibration import Dof

BLOCK = 0.4  # s
DESCRIBED = (ChannelDescription("1", "force", "tip:+x", "2.25 mV/N"),
             ChannelDescription("2", "acceleration", "tip:+x", "1.02 mV/(m/s^2)"))


def begin(folder: Path, volts: np.ndarray, faults: PlayerFaults | None = None, goal: int = 5, inputs=None, described=DESCRIBED):
    """Return the live test of a player, its folder, and the events of it."""
    player = RecordPlayer([volts], tapping.RATE, speed=None, limit=10.0, faults=faults)
    live = LiveInput(player, inputs or tapping.inputs(), described, ())
    store = io.BlowFolder(folder, live, BLOCK)
    tap = LiveTap(live.inputs, player.rate, duration=BLOCK, goal=goal, kept=store.kept)
    return tap, store, studies.follow_blows(player, tap, store)


def study_of_files(folder: Path):
    records, description = io.read_hammer_test(folder / "test.yaml")
    return studies.study_hammer_records(records, duration=description.block)


def test_the_result_is_that_of_its_files(tmp_path):
    volts = tapping.stream((200.0, 150.0, 180.0, 20.0, 190.0, 170.0, 185.0), doubles=(1,))
    tap, store, events = begin(tmp_path / "x", volts)
    verdicts = [event for event in events if isinstance(event, BlowVerdict)]
    assert [verdict.accepted for verdict in verdicts] == [True, False, True, False, True, True, True]
    assert "double hit" in verdicts[1].words and "weak hit" in verdicts[3].words
    assert [verdict.remaining for verdict in verdicts] == [4, 4, 3, 3, 2, 1, 0]
    assert verdicts[4].words.endswith("two more good blows at tip:+x") and verdicts[-1].words.endswith("enough at tip:+x")
    from_files = study_of_files(tmp_path / "x")
    assert np.array_equal(from_files.frf.values, tap.study.frf.values)
    assert np.array_equal(from_files.frf.coherence, tap.study.frf.coherence)
    assert from_files.rows() == tap.study.rows() and len(store.kept) == 0


def test_the_true_mode_comes_out(tmp_path):
    tap, _, events = begin(tmp_path / "x", tapping.stream((200.0, 180.0, 190.0)), goal=3)
    progress = [event for event in events if isinstance(event, LiveProgress)]
    frf = tap.study.frf
    w = 2 * np.pi * frf.frequency
    # Two central differences made the acceleration: they attenuate by sin(w h) / (w h) each.
    w0, attenuated = 2 * np.pi * 300, np.sin(w / tapping.RATE) * tapping.RATE
    truth = -attenuated**2 / 0.5 / (w0**2 - w**2 + 2j * 0.03 * w0 * w)
    inside = (frf.frequency > 150) & (frf.frequency < 330)
    assert np.abs(frf.values[inside, 0, 0] / truth[inside] - 1).max() < 0.02
    assert any("peak at 30" in line for line in progress[-1].lines()) and progress[0].study.used == 1


def test_a_call_in_the_same_folder_goes_on(tmp_path):
    _, _, events = begin(tmp_path / "x", tapping.stream((200.0, 180.0)))
    assert sum(isinstance(event, BlowVerdict) for event in events) == 2
    tap, store, events = begin(tmp_path / "x", tapping.stream((190.0, 185.0, 195.0), seed=1))
    assert tap.remaining == 3 and len(store.kept) == 2
    verdicts = [event for event in events if isinstance(event, BlowVerdict)]
    assert [verdict.name for verdict in verdicts] == ["blow_0003.npz", "blow_0004.npz", "blow_0005.npz"]
    assert np.array_equal(study_of_files(tmp_path / "x").frf.values, tap.study.frf.values) and tap.remaining == 0


def test_another_test_in_the_folder_is_refused(tmp_path):
    list(begin(tmp_path / "x", tapping.stream((200.0,)))[2])
    with pytest.raises(ToolpointError, match="holds a test of other channels"):
        begin(tmp_path / "x", tapping.stream((200.0,)), described=(DESCRIBED[0], ChannelDescription("2", "velocity", "tip:+x")))


def test_a_device_that_goes_away_leaves_what_was_struck(tmp_path):
    tap, _, events = begin(tmp_path / "x", tapping.stream((200.0, 180.0, 190.0)), PlayerFaults(unplugged_at=round(
        2.2 * tapping.RATE)))
    heard = []
    with pytest.raises(DeviceFault, match="went away"):
        heard.extend(events)
    assert tap.good == 2 and study_of_files(tmp_path / "x").used == 2


@pytest.mark.parametrize("is_told", [True, False])
def test_a_blow_in_which_samples_were_lost_is_set_aside(tmp_path, is_told):
    volts = tapping.stream((200.0,) * 7 + (0.0,) * 5)
    lost_at = round((0.8 + 3 * 0.8 + 0.1) * tapping.RATE)
    tap, store, events = begin(tmp_path / "x", volts, PlayerFaults(lost_at=lost_at, lost_count=200, is_told=is_told), goal=7)
    events = list(events)
    aside = sorted(path.name for path in (store.folder / "set_aside").glob("*.npz"))
    assert "blow_0004.npz" in aside and tap.good == 7 - len(aside)
    assert "lost" in (store.folder / "set_aside" / "blow_0004.txt").read_text()
    assert len(aside) == 1 if is_told else any("withdrawn" in str(event) or "lost within the blow" in str(event)
                                               for event in events)
    assert np.array_equal(study_of_files(tmp_path / "x").frf.values, tap.study.frf.values)


def test_a_full_disk_keeps_blows_in_memory_until_there_is_room(tmp_path, monkeypatch):
    tap, store, events = begin(tmp_path / "x", tapping.stream((200.0, 180.0, 190.0)), goal=3)
    sync, calls = os.fsync, []

    def fill(handle):
        calls.append(handle)
        if len(calls) in (3, 4):  # of the second blow, and of its second trial
            raise OSError(errno.ENOSPC, "No space left on device")
        sync(handle)
    monkeypatch.setattr(os, "fsync", fill)
    words = [str(event) for event in events if isinstance(event, str)]
    assert any("NOT KEPT on disk" in line and "No space left" in line for line in words)
    assert any("kept now, as blow_000" in line for line in words)
    assert tap.good == 3 and study_of_files(tmp_path / "x").used == 3
    assert not list(store.folder.glob("*.part"))


def test_a_disk_that_stays_full_is_an_error_at_the_end(tmp_path, monkeypatch):
    _, _, events = begin(tmp_path / "x", tapping.stream((200.0,)), goal=1)
    monkeypatch.setattr(os, "fsync", lambda handle: (_ for _ in ()).throw(OSError(errno.ENOSPC, "No space left on device")))
    with pytest.raises(ToolpointError, match="not on disk"):
        list(events)


def three_axes(angles: list[float], noise: float = 1e-5) -> tuple[np.ndarray, InputChannels]:
    """Return blows at these angles from x to y, and inputs with accelerometers in both, of a tip alike in both."""
    along = tapping.stream((200.0,) * len(angles), noise=noise)
    volts = np.column_stack([along, np.zeros(len(along))])
    for k, angle in enumerate(angles):
        part = slice(round((0.6 + 0.8 * k) * tapping.RATE), round((1.4 + 0.8 * k) * tapping.RATE))
        answer = along[part, 1]
        volts[part, 1], volts[part, 2] = answer * np.cos(np.radians(angle)), answer * np.sin(np.radians(angle))
    first = tapping.inputs().channels
    return volts, InputChannels((*first, InputChannel(2, "acceleration", Dof("tip", "+y"), first[1].factor)))


def test_a_turned_blow_is_refused_by_the_others(tmp_path):
    volts, inputs = three_axes([4.0, 5.0, 3.0, 22.0, 4.0])
    described = (*DESCRIBED, ChannelDescription("3", "acceleration", "tip:+y", "1.02 mV/(m/s^2)"))
    tap, store, events = begin(tmp_path / "x", volts, inputs=inputs, described=described)
    verdicts = [event for event in events if isinstance(event, BlowVerdict)]
    assert [verdict.accepted for verdict in verdicts] == [True, True, True, False, True]
    assert "turned by 18° against the other blows" in verdicts[3].words
    assert (store.folder / "set_aside" / "blow_0004.npz").exists() and tap.good == 4


def test_a_skew_first_blow_is_named_and_not_refused(tmp_path):
    volts, inputs = three_axes([40.0])
    described = (*DESCRIBED, ChannelDescription("3", "acceleration", "tip:+y", "1.02 mV/(m/s^2)"))
    _, _, events = begin(tmp_path / "x", volts, inputs=inputs, described=described, goal=1)
    verdict = next(event for event in events if isinstance(event, BlowVerdict))
    assert verdict.accepted and "40° off +x" in verdict.words


KILLED = """
import sys
sys.path[:0] = [{tests!r} + "/studies", {tests!r} + "/acquisition"]
from pathlib import Path
import tapping
from test_live_tap import begin
from toolpoint.acquisition import RecordPlayer
tap, store, events = begin(Path({folder!r}), tapping.stream((200.0,) * 40, seed={seed}), goal=1000)
for event in events:
    print(event, flush=True)
"""


@pytest.mark.slow
def test_kills_at_any_moment_lose_nothing_that_was_told(tmp_path):
    """The verdict on a blow comes after it is on the disk: whatever was told of is there, and all that is there is whole."""
    rng, folder, told = np.random.default_rng(3), tmp_path / "x", set()
    for seed in range(12):
        code = KILLED.format(tests=str(Path(__file__).resolve().parents[1]), folder=str(folder), seed=seed)
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
        process.stdout.readline()
        time.sleep(rng.uniform(0.05, 1.5))
        process.send_signal(signal.SIGKILL)
        told |= {line.split("'")[1] for line in process.stdout.read().splitlines() if line.startswith("BlowVerdict(name=")}
        process.wait()
    records, _ = io.read_hammer_test(folder / "test.yaml")
    assert told <= set(records.names) and len(told) > 12
    assert study_of_files(folder).used >= len(told) - 1
