"""Hits spread over records: pretrigger and block that fit, windows that end, hits that contradict, decisions of a person."""

from __future__ import annotations

import re

import numpy as np
import pytest

from signals.hammer_case import DURATION, MODES, RATE, pulse, struck, truth
from toolpoint import Record, ToolpointError, ToolpointWarning
from toolpoint.signals import hammer_test
from toolpoint.signals.hits import is_clipped, second_peak


def files(heights: list[float], **more) -> list[Record]:
    """Return one record for each hit."""
    return [struck([height], **more) for height in heights]


def test_one_hit_a_file_gives_what_one_file_of_all_hits_gives():
    apart, together = hammer_test(files([100.0, 80, 120]), DURATION), hammer_test(struck([100.0, 80, 120]), DURATION)
    assert apart.used == together.used == 3
    difference = np.abs(apart.frf.values - together.frf.values)[5:300]
    assert difference.max() < 1e-2 * np.abs(together.frf.values[5:300]).max()  # one record's next hit ends the last ring-down
    assert [hit.record for hit in apart.hits] == [0, 1, 2]


def test_a_record_that_begins_just_before_its_hit_keeps_its_pretrigger_and_says_so():
    cut = [Record(record.samples[194:], RATE, record.channels, record.quantities) for record in files([100.0, 90, 110])]
    test = hammer_test(cut, DURATION)
    assert test.used == 3 and any("the pretrigger is what is there" in note for note in test.frf.notes)
    assert np.abs(test.frf.values - truth(test.frf.frequency))[5:300].max() < 5e-3 * np.abs(truth(test.frf.frequency)).max()


def test_a_record_that_begins_within_the_pulse_is_refused():
    good = files([100.0, 90, 110])
    cut = Record(good[0].samples[203:], RATE, good[0].channels, good[0].quantities)
    test = hammer_test([*good, cut], DURATION)
    assert test.used == 3 and "begins within the pulse" in test.hits[3].reasons[0]


def test_the_block_fits_behind_the_hits_and_a_short_record_is_refused_alone():
    good = files([100.0, 90, 110, 95])
    short = Record(good[3].samples[:900], RATE, good[3].channels, good[3].quantities)
    test = hammer_test([*good[:3], short])
    assert test.duration == pytest.approx((2600 - 200 + 0.02 * 2400) / RATE, rel=0.03)
    assert test.used == 3 and "behind the record" in test.hits[3].reasons[0]


def test_a_bounce_does_not_shorten_the_block():
    bounce = struck([100.0, 100, 100, 100], extra=pulse(200 + 2200 + 60, 400 + 4 * 2200, 30))
    test = hammer_test(bounce)
    assert 2000 / RATE < test.duration < 2210 / RATE
    assert [hit.accepted for hit in test.hits] == [True, False, True, True] and "double hit" in test.hits[1].reasons[0]


def test_a_slow_mode_that_rings_on_gets_the_window_that_it_needs():
    light = MODES.with_damping([0.0008, 0.02, 0.02])
    test = hammer_test(files([100.0, 90, 110], modes=light), DURATION, final=None)
    assert test.used == 3 and test.frf.decay > 1
    assert any("near 6" in note and "exponential window" in note for note in test.frf.notes)
    assert hammer_test(files([100.0, 90, 110]), DURATION, final=None).frf.decay == 0


def turned(record: Record, factor: float) -> Record:
    return Record(record.samples * np.array([1.0, factor, factor, factor]), RATE, record.channels, record.quantities)


@pytest.mark.parametrize(("stray", "words"), [
    (turned(struck([100.0]), -1), "opposite direction"),
    (turned(struck([100.0]), 0.5), r"scaled: the response is 0\.5 times"),
    (struck([100.0], at="2:+x"), "another spot or in another direction")])
def test_what_contradicts_the_others_is_told_apart(stray, words):
    good = files([100.0, 90, 110, 100])
    test = hammer_test([*good, Record(stray.samples, RATE, good[0].channels, good[0].quantities)], DURATION)
    assert [hit.accepted for hit in test.hits] == [True] * 4 + [False]

    assert re.search(words, test.hits[4].reasons[0])


def test_two_hits_that_contradict_are_doubted_and_neither_is_chosen():
    stray = struck([100.0], at="2:+x")
    first = struck([100.0])
    test = hammer_test([first, Record(stray.samples, RATE, first.channels, first.quantities)], DURATION)
    assert test.used == 2 and "contradict each other" in test.frf.notes[0]


def test_a_person_decides_against_the_judgement():
    records = files([100.0, 12, 100, 110])
    test = hammer_test(records, DURATION, decisions={1: True, 0: False})
    assert [hit.accepted for hit in test.hits] == [False, True, True, True]
    assert test.hits[0].reasons == ("refused by hand",)
    with pytest.raises(ToolpointError, match="hit 9"):
        hammer_test(records, DURATION, decisions={9: True})


def test_swapped_channels_are_named():
    record = struck([100.0], modes=MODES.with_damping(0.01))
    swapped = Record(record.samples[:, [1, 0]], RATE, record.channels[:2], record.quantities[:2])
    with pytest.raises(ToolpointError, match=r"channel 2 .* looks like the force: channels are swapped"):
        hammer_test(swapped, DURATION)


def test_circles_of_95_percent_hold_the_truth():
    held = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        test = hammer_test(struck(list(rng.uniform(70, 130, 6)), rng=rng, noise=3e-3), DURATION)
        lines = slice(20, 280)
        held.append((np.abs(test.frf.values - truth(test.frf.frequency)) <= test.radius())[lines].mean())
    assert 0.92 < np.mean(held) < 0.985
    with pytest.warns(ToolpointWarning, match="one hit"):
        assert hammer_test(struck([100.0]), DURATION).radius() is None


def test_a_flat_top_is_overload_and_a_rounded_smooth_one_is_not():
    time = np.linspace(0, 1, 4000)
    smooth = np.sin(np.pi * time)
    assert not is_clipped(np.round(smooth * 200) / 200)
    assert is_clipped(np.round(np.clip(np.sin(60 * time), -0.8, 0.8) * 2000) / 2000)
    assert is_clipped(np.clip(np.sin(2000 * time), -0.8, 0.8)) and not is_clipped(np.sin(2000 * time))


@pytest.mark.parametrize("steps", [3, 13, 60, 3000])
def test_a_ringing_channel_of_few_steps_is_no_overload(steps):
    """A sensor across the motion has so few steps of the converter; text has as few digits."""
    rng = np.random.default_rng(steps)
    time = np.arange(3000) / 800
    for _ in range(20):
        frequency, phase = rng.uniform(3, 60), rng.uniform(0, 6)
        ringing = np.exp(-rng.uniform(0.2, 4) * time) * np.sin(2 * np.pi * frequency * time + phase)
        stored = np.round(ringing * steps) * 1.2e-7 / 0.0104
        assert not is_clipped(stored), (frequency, phase)
        digits = 3 if steps < 100 else 5
        assert not is_clipped(np.array([float(f"{value:.{digits}g}") for value in ringing])), (frequency, phase, digits)
        clipped = np.round(np.clip(1.3 * ringing / np.abs(ringing).max(), -1, 1) * 32767) / 32767
        assert is_clipped(clipped) or frequency < 10, (frequency, phase)


def test_a_second_rise_within_a_long_pulse_is_a_second_blow():
    at = np.arange(400) / 100
    single = np.where(at < 1, np.sin(np.pi * np.clip(at, 0, 1)), 0)
    double = single + np.where((at > 0.8) & (at < 1.8), 0.5 * np.sin(np.pi * np.clip(at - 0.8, 0, 1)), 0)
    assert second_peak(single, 50, 100) < 0.01 and second_peak(double, 50, 180) > 0.2
