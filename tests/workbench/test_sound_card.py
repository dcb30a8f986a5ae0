"""Blows recorded in the workbench's page from a sound card: PortAudio over a PulseAudio null sink, skipped without them."""

from __future__ import annotations

import importlib.util
import shutil

import pytest

from benchmarks.acquisition import live_audio
from toolpoint import io, studies
from workbench_tabs import ready, wait

pytestmark = [pytest.mark.slow, pytest.mark.browser]
CHANNELS = ("1=force tip:+x 2.25mV/N 1V", "2=acceleration tip:+x 10mV/g 1V")


@pytest.fixture
def null_sink(monkeypatch):
    """A PulseAudio server of its own, whose null sink's monitor is the default input."""
    if lacking := [name for name in (*live_audio.NEEDED, "parec") if shutil.which(name) is None]:
        pytest.skip(f"no PulseAudio here: {', '.join(lacking)} (Debian: pulseaudio, pulseaudio-utils, libasound2-plugins)")
    if importlib.util.find_spec("sounddevice") is None:
        pytest.skip("sounddevice is not installed (extra acquisition)")
    for name in ("XDG_RUNTIME_DIR", "PULSE_SINK", "PULSE_SOURCE", "PULSE_SERVER"):
        monkeypatch.setenv(name, "")  # put back after the test, as the server sets them
    with live_audio.null_sink():
        yield


def test_blows_of_a_sound_card_are_judged_on_the_page_and_lie_on_the_disk(null_sink, folder, serve, tab):
    page = tab(serve(folder).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/record'")
    ready(page, "record")
    page.fill("#rec-device", "sound:pulse")
    page.fill("#rec-channels", "\n".join(CHANNELS))
    page.fill("#rec-blows", "1")
    page.click("#rec-start")
    wait(page, "/^(recording|failed) /.test(document.body.dataset.recording)")
    if "no sound input" in page.inner_text("main") or "No input device" in page.inner_text("main"):
        pytest.skip("PortAudio does not see PulseAudio (Debian: libasound2-plugins)")
    with live_audio.player(live_audio.tap_signal(4)):  # a blow in which the server loses samples is refused
        wait(page, "document.body.dataset.recording.startsWith('ended')")
    assert "enough at tip:+x" in page.inner_text("#rec-last")
    records, description = io.read_hammer_test(folder / "records/tip_x/test.yaml")
    study = studies.study_described_records(records, description)
    assert study.frf.frequency[-1] > 2000 and page.inner_text("#rec-study").startswith(study.status[:20])
    inside = (study.frf.frequency > 500) & (study.frf.frequency < 2000)
    peak = study.frf.frequency[inside][abs(study.frf.values[inside, 0, 0]).argmax()]
    assert peak == pytest.approx(1500, rel=0.05)  # the larger of the modes that were played
    assert page.errors == []
