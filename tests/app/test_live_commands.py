"""`tap --live`, `listen --live` and `devices`, on players and folders in place of devices."""

from __future__ import annotations

import json
import sys
import threading
import time

import numpy as np
import pytest
import tapping
from click.testing import CliRunner

from signals.heard_signals import RATE, comb, side_bands, with_noise
from toolpoint import io
from toolpoint.app.main import cli, main

CHANNELS = ["--channel", tapping.DESCRIBED[0], "--channel", tapping.DESCRIBED[1]]


def play(path, volts, name="blows.npz", rate=tapping.RATE):
    np.savez(path / name, samples=volts, fs=rate, channels=np.array(["hammer", "sensor", "third"][:volts.shape[1]]))
    return ["--live", "--device", f"play:{path / name}@max"]


def test_blows_are_told_kept_and_shown(tmp_path, capsys):
    device = play(tmp_path, tapping.stream((200.0, 150.0, 180.0, 190.0), doubles=(1,)))
    main(["tap", *device, *CHANNELS, "--folder", str(tmp_path / "x"), "--blows", "3", "--block", "0.4",
          "-o", str(tmp_path / "p")])
    printed = capsys.readouterr()
    assert "blow_0001.npz: good, 200 N; two more good blows at tip:+x" in printed.err
    assert "REFUSED, 150 N: double hit" in printed.err and "enough at tip:+x" in printed.err and "coherence" in printed.err
    assert "from 3 of 4 hits" in printed.out and f"toolpoint tap {tmp_path / 'x' / 'test.yaml'}" in printed.out
    page = (tmp_path / "p" / "index.html").read_text(encoding="utf-8")
    assert "3 of 4 hits" in page and 'http-equiv="refresh"' not in page
    main(["frf", str(tmp_path / "x" / "test.yaml"), "-o", str(tmp_path / "p2")])
    assert capsys.readouterr().out.splitlines()[1:9] == printed.out.splitlines()[1:9]


def test_a_growing_page_is_loaded_again():
    from toolpoint.pages.measured.hammer_records import hammer_page
    from toolpoint.plot import Report
    from toolpoint.studies import study_hammer_records

    volts = tapping.stream((200.0, 180.0))
    record = tapping.inputs().record(volts, tapping.RATE)
    page = hammer_page(study_hammer_records([record], duration=0.4), is_growing=True)
    assert isinstance(page, Report) and '<meta http-equiv="refresh" content="3">' in page.html()


@pytest.mark.parametrize(("words", "told"), [
    (["tap"], "FILES and --live: must be one of them"),
    (["tap", "--live", *CHANNELS], "name a folder"),
    (["tap", "--live", "--folder", "x", *CHANNELS, "--device", "usb"], "must be sound, sound:NAME, ni:Dev1"),
    (["tap", "--live", "--folder", "x", "--device", "play:none.npz", *CHANNELS], "none.npz"),
    (["tap", "--folder", "x", "blows.npz"], "needs --live"),
    (["listen", "--teeth", "4"], "RECORD and --live"),
])
def test_what_cannot_be_is_refused(words, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    play(tmp_path, tapping.stream((200.0,)))
    with pytest.raises(SystemExit):
        main(words)
    assert told in capsys.readouterr().err


def test_a_channel_that_the_device_has_not_is_named(tmp_path, capsys):
    device = play(tmp_path, tapping.stream((200.0,)))
    with pytest.raises(SystemExit):
        main(["tap", *device, *CHANNELS, "--channel", "3=acceleration tip:+y 10mV/g", "--folder", str(tmp_path / "x")])
    assert "no channel '3'; it holds 1: hammer, 2: sensor" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_records_of_another_program_are_taken_from_its_folder(tmp_path, capsys):
    (tmp_path / "out").mkdir()
    blow = tapping.stream((200.0,), lead=0.1, apart=0.5)

    def write():
        for k in range(2):
            time.sleep(0.3)
            np.savez(tmp_path / f"draft{k}.npz", samples=blow * (1 - 0.1 * k), fs=tapping.RATE, channels=["hammer", "sensor"])
            (tmp_path / f"draft{k}.npz").replace(tmp_path / "out" / f"record{k}.npz")
    writer = threading.Thread(target=write)
    writer.start()
    main(["tap", "--live", "--device", f"folder:{tmp_path / 'out'}", *CHANNELS, "--folder", str(tmp_path / "x"), "--blows", "2",
          "-o", str(tmp_path / "p")])
    writer.join()
    assert "from 2 of 2 hits" in capsys.readouterr().out
    assert len(list((tmp_path / "x").glob("blow_*.npz"))) == 2


@pytest.mark.slow
def test_files_in_units_of_their_own_are_kept_in_si(tmp_path, capsys):
    """A table in kN and g: what is kept reads back as the table itself."""
    volts = tapping.stream((200.0, 180.0, 190.0))
    rows = np.column_stack([np.arange(len(volts)) / tapping.RATE, volts[:, 0] / tapping.HAMMER / 1e3,
                            volts[:, 1] / tapping.SENSOR / 9.80665])
    np.savetxt(tmp_path / "blows.csv", rows, delimiter=",", header="time [s],force tip:+x [kN],acceleration tip:+x [g]",
               comments="", fmt="%.12g")
    main(["tap", "--live", "--device", f"play:{tmp_path / 'blows.csv'}@max", "--folder", str(tmp_path / "x"), "--blows", "3",
          "--block", "0.4", "-o", str(tmp_path / "p")])
    assert "good, 200 N" in capsys.readouterr().err
    kept = io.read_hammer_test(tmp_path / "x" / "test.yaml")[0].records
    table = io.read_records([tmp_path / "blows.csv"]).records[0]
    first = kept[0].samples
    start = int(np.argmin(np.abs(table.samples[:, 0] - first[0, 0]) + np.abs(table.samples[:, 1] - first[0, 1])))
    assert np.allclose(first, table.samples[start:start + len(first)], rtol=1e-9)


@pytest.mark.slow
def test_a_record_that_cannot_be_read_does_not_end_the_test(tmp_path, capsys):
    (tmp_path / "out").mkdir()
    blow = tapping.stream((200.0,), lead=0.1, apart=0.5)

    def write():
        for k, content in enumerate((blow, None, blow)):
            time.sleep(0.45)
            if content is None:
                (tmp_path / "out" / "record1.npz").write_bytes(b"no archive")
                continue
            np.savez(tmp_path / "draft.npz", samples=content, fs=tapping.RATE, channels=["hammer", "sensor"])
            (tmp_path / "draft.npz").replace(tmp_path / "out" / f"record{k}.npz")
    writer = threading.Thread(target=write)
    writer.start()
    main(["tap", "--live", "--device", f"folder:{tmp_path / 'out'}", *CHANNELS, "--folder", str(tmp_path / "x"), "--blows", "2",
          "-o", str(tmp_path / "p")])
    writer.join()
    printed = capsys.readouterr()
    assert "record1.npz" in printed.err and "from 2 of 2 hits" in printed.out


def test_one_window_of_many_that_says_chatter_is_doubted():
    from types import SimpleNamespace

    from toolpoint.studies import question_windows

    def windows(*verdicts):
        return [SimpleNamespace(cut=SimpleNamespace(verdict=verdict)) for verdict in verdicts]
    assert question_windows(windows(*["no chatter"] * 9, "chatter"))[0].figure == 0.1
    assert question_windows(windows(*["chatter"] * 5, *["no chatter"] * 5)) == []
    assert question_windows(windows("no chatter", "chatter")) == []


def test_a_full_scale_in_volts_makes_volts_of_a_sound_input(tmp_path, monkeypatch):
    from toolpoint.acquisition.sound_card import FULL_SCALE_UNIT
    from toolpoint.io.measured import live_input

    class Card:
        rate, names, units, ranges, doubts = 48e3, ("channel 1", "channel 2"), (FULL_SCALE_UNIT,) * 2, (1.0, 1.0), ()

    monkeypatch.setattr(live_input, "SoundInput", lambda *arguments: Card())
    live = io.open_input("sound", ["1=force tip:+x 2mV/N 5V", "2=acceleration tip:+x 0.01V/(m/s^2) 5V"])
    volts = live.inputs.kept(np.array([[0.2, -0.4]]))
    assert volts.tolist() == [[1.0, -2.0]]
    assert live.inputs.record(volts, 48e3).samples[0] == pytest.approx([500.0, -200.0])
    assert live.inputs.overloads(np.array([[5.0, 1.0]])) == ("channel 1 (force at tip:+x)",)
    with pytest.raises(ValueError, match="holds shares of the full scale"):
        io.open_input("sound", ["1=force tip:+x 2mV/N", "2=acceleration tip:+x 0.01V/(m/s^2)"])


@pytest.mark.slow
def test_a_cut_is_heard_while_it_runs(tmp_path, capsys):
    rng = np.random.default_rng(0)
    quiet = 1e-3 * rng.standard_normal(2 * RATE)
    cut = with_noise(comb(133.4, 4, 4.0, rng) + side_bands(1417.0, 533.6, 4.0, rng), 0.3, rng)
    np.savez(tmp_path / "cut.npz", samples=np.concatenate([quiet, 0.3 * cut / np.abs(cut).max()])[:, None], fs=RATE)
    main(["listen", "--live", "--device", f"play:{tmp_path / 'cut.npz'}@max", "--teeth", "4", "--speed", "8000",
          "--window", "2", "--keep", str(tmp_path / "kept.h5"), "-o", str(tmp_path / "p")])
    printed = capsys.readouterr()
    assert "no cut is heard" in printed.err.splitlines()[0] or "Cannot tell" in printed.err.splitlines()[0]
    assert printed.out.split("\n")[-1] == "" and "Chatter at " in printed.out
    assert io.read_record(tmp_path / "kept.h5").duration == pytest.approx(2.0)
    assert "Chatter at" in (tmp_path / "p" / "index.html").read_text(encoding="utf-8")


def test_devices_say_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    done = CliRunner().invoke(cli, ["devices", "--json"], catch_exceptions=False)
    data = json.loads(done.stdout)
    assert data["devices"] == [] and len(data["unavailable"]) == 2
