"""Verdicts on sounds whose truth is known by how they were made, and on records that cannot tell."""

import json

import numpy as np
import pytest

from signals.heard_signals import RATE, comb, side_bands, with_noise
from toolpoint._check import ToolpointError
from toolpoint.studies import SpindleRange, hear_tried, listen
from toolpoint.studies.listening.better_speeds import natural_frequency, propose_lobes
from toolpoint.studies.listening.probability import temper_searched
from toolpoint.vibration import Modes, Record

SPINDLE, TEETH, CHATTER = 133.4, 4, 1417.0


def record(samples, rate=RATE, kind="sound"):
    """One or several channels of a microphone."""
    table = np.atleast_2d(np.asarray(samples).T).T
    return Record(table, rate, tuple(f"m{k}:+x" for k in range(table.shape[1])), (kind,) * table.shape[1])


def stable(seed, seconds=2.5, noise=0.5):
    """A stable cut with run-out."""
    rng = np.random.default_rng(seed)
    return with_noise(comb(SPINDLE, TEETH, seconds, rng), noise, rng)


def chattering(seed, level=1.0, seconds=2.5, noise=0.5, chatter=CHATTER):
    """The same with Hopf lines."""
    rng = np.random.default_rng(seed)
    lines = comb(SPINDLE, TEETH, seconds, rng) + level * side_bands(chatter, TEETH * SPINDLE, seconds, rng)
    return with_noise(lines, noise, rng)


@pytest.mark.parametrize("seed", range(3))
def test_a_stable_cut_is_no_chatter(seed):
    result = listen(record(stable(seed)), TEETH, 60 * SPINDLE * 1.008)
    assert result.verdict == "no chatter" and result.chatters is False and result.probability < 0.1
    assert result.evidence.speed.frequency == pytest.approx(SPINDLE, rel=2e-4)
    assert result.answer().startswith("No chatter")


@pytest.mark.parametrize(("seed", "level"), [(0, 1.0), (1, 0.5), (2, 3.0)])
def test_hopf_lines_are_chatter_with_their_frequency_within_the_interval(seed, level):
    result = listen(record(chattering(seed, level)), TEETH, 60 * SPINDLE * 0.994)
    assert result.verdict == "chatter" and result.kind.name == "regenerative (Hopf)"
    assert CHATTER in [pytest.approx(f, abs=result.line.half_width) for f in (result.line.frequency, *result.line.others)]
    assert result.onset_time is None


def test_a_mode_names_the_line_among_its_side_bands():
    modes = Modes([CHATTER / 1.03], [0.03], [[1.0]], ["t:+x"])
    result = listen(record(chattering(3)), TEETH, 60 * SPINDLE, modes=modes)
    assert result.line.frequency == pytest.approx(CHATTER, abs=result.line.half_width)
    assert result.line.mode == pytest.approx(CHATTER / 1.03)
    again = listen(record(chattering(3)), TEETH, 60 * SPINDLE, modes=[CHATTER - TEETH * SPINDLE - 5])
    assert again.line.frequency == pytest.approx(CHATTER - TEETH * SPINDLE, abs=again.line.half_width)


def test_lines_at_half_the_tooth_passing_of_odd_teeth_are_a_flip():
    rng = np.random.default_rng(4)
    sound = comb(150.0, 3, 2.5, rng) + side_bands(2.5 * 450.0, 450.0, 2.5, rng, reach=2)
    result = listen(record(with_noise(sound, 0.3, rng)), 3, 9000.0)
    assert result.verdict == "chatter" and "flip" in result.kind.name


def test_a_flip_of_four_teeth_hides_on_spindle_orders_and_is_found_by_the_tooth_comb():
    rng = np.random.default_rng(5)
    sound = comb(150.0, 4, 2.5, rng, run_out=0.01) + side_bands(2.5 * 600.0, 600.0, 2.5, rng, reach=2)
    result = listen(record(with_noise(sound, 0.3, rng)), 4, 9000.0)
    assert result.verdict == "chatter" and "flip" in result.kind.name
    assert result.line.frequency % 600 == pytest.approx(300, abs=1)


def test_two_teeth_cannot_tell_a_flip_from_run_out_and_say_so():
    rng = np.random.default_rng(6)
    sound = comb(150.0, 2, 2.5, rng, run_out=1.0)
    result = listen(record(with_noise(sound, 0.3, rng)), 2, 9000.0)
    assert any(doubt.what == "flip" for doubt in result.doubts)


def test_another_machine_that_runs_before_the_cut_is_no_chatter():
    rng = np.random.default_rng(7)
    idle = int(0.6 * RATE)
    sound = np.concatenate([np.zeros(idle), comb(SPINDLE, TEETH, 2.5, rng), np.zeros(idle)])
    time = np.arange(sound.size) / RATE
    other = 0.3 * sum(np.cos(2 * np.pi * 341.7 * k * time) / k for k in range(1, 5))
    result = listen(record(with_noise(sound + other, 0.1, rng)), TEETH, 60 * SPINDLE)
    assert result.verdict == "no chatter"
    assert 342 in np.round(result.evidence.background.frequency).astype(int)


def test_chatter_that_sets_in_has_its_onset():
    rng = np.random.default_rng(8)
    seconds, begin = 4.0, 1.5
    time = np.arange(int(seconds * RATE)) / RATE
    growth = np.minimum(1.0, np.exp(12 * (time - begin - 0.3)))
    sound = comb(SPINDLE, TEETH, seconds, rng) + growth * side_bands(CHATTER, TEETH * SPINDLE, seconds, rng)
    result = listen(record(with_noise(sound, 0.1, rng)), TEETH, 60 * SPINDLE)
    assert result.verdict == "chatter"
    assert begin < result.onset_time < begin + 0.4
    assert "s on" in result.answer()


def test_chatter_nearer_to_an_order_than_the_record_resolves_is_not_called_stable_by_a_short_record():
    rng = np.random.default_rng(9)
    sound = with_noise(comb(25.0, 4, 0.8, rng), 0.3, rng)
    result = listen(record(sound), 4, 1500.0)
    assert result.verdict == "cannot tell" and "may tell" in result.reason
    assert any(doubt.what == "resolution" for doubt in result.doubts)


def test_noise_alone_cannot_tell():
    result = listen(record(np.random.default_rng(10).normal(size=2 * RATE)), 4, 8000.0)
    assert result.verdict == "cannot tell" and "no tooth passing" in result.reason
    assert result.probability == 0.5 and result.speed_half_width is None  # no interval of a speed unheard
    assert "not heard" in dict(result.rows())["spindle speed"] and "rev/min" not in result.answer()


def test_a_clipped_record_is_doubted_or_refused_a_verdict():
    sound = chattering(11, noise=0.01)
    little, much = (np.clip(sound, -share * np.abs(sound).max(), share * np.abs(sound).max()) for share in (0.8, 0.15))
    assert any("clipped" in doubt for doubt in listen(record(little), TEETH, 60 * SPINDLE).doubts)
    assert listen(record(much), TEETH, 60 * SPINDLE).verdict == "cannot tell"


def test_a_wrong_number_of_teeth_is_doubted():
    result = listen(record(stable(12)), 5, 60 * SPINDLE)
    assert any(doubt.what == "teeth" for doubt in result.doubts)


def test_a_direct_component_and_the_loudness_change_nothing():
    first, second = (listen(record(x), TEETH, 60 * SPINDLE) for x in (chattering(13), 1e-4 * chattering(13) + 0.3))
    assert first.probability == pytest.approx(second.probability, abs=1e-6)
    assert first.line.frequency == pytest.approx(second.line.frequency, rel=1e-9)


def test_the_stronger_channel_of_a_stereo_record_is_judged_and_said():
    both = np.stack([0.1 * stable(14), chattering(14)], axis=1)
    result = listen(record(both), TEETH, 60 * SPINDLE)
    assert result.verdict == "chatter" and any("channel 2" in note for note in result.notes)
    assert listen(record(both), TEETH, 60 * SPINDLE, channel=1).verdict == "no chatter"
    with pytest.raises(ToolpointError, match="channel: 3; must be 1 to 2"):
        listen(record(both), TEETH, 60 * SPINDLE, channel=3)


@pytest.mark.parametrize(("samples", "words"), [(np.zeros(RATE), "silent"),
                                                (stable(15, seconds=0.3), "must be at least 0.5 s")])
def test_records_that_hold_no_cut_are_refused(samples, words):
    with pytest.raises(ToolpointError, match=words):
        listen(record(samples), TEETH, 8000.0)


def test_an_unknown_speed_is_searched_and_doubted():
    result = listen(record(chattering(16)), TEETH)
    assert result.evidence.speed.frequency == pytest.approx(SPINDLE, rel=1e-3)
    assert any(doubt.what == "spindle speed" for doubt in result.doubts)


def test_two_lines_of_a_family_that_move_the_tool_alike_are_doubted_unless_a_mode_tells():
    """The motion is the sound over the frequency: two lines a tooth passing apart, each as strong as its frequency."""
    rng, higher = np.random.default_rng(1), CHATTER + TEETH * SPINDLE
    time = np.arange(int(2.5 * RATE)) / RATE
    lines = sum(f / CHATTER * np.sin(2 * np.pi * f * time) for f in (CHATTER, higher))
    heard = record(with_noise(comb(SPINDLE, TEETH, 2.5, rng)[:time.size] + lines, 0.1, rng))
    alone = listen(heard, TEETH, 60 * SPINDLE)
    named = alone.line.frequency
    (doubt,) = [doubt for doubt in alone.doubts if doubt.what == "chatter frequency"]
    assert f"{CHATTER + higher - named:.0f} Hz" in doubt.why
    told = listen(heard, TEETH, 60 * SPINDLE, modes=[named / 1.03])
    assert not [doubt for doubt in told.doubts if doubt.what == "chatter frequency"]


def test_speeds_to_try_are_lobes_of_the_mode_behind_the_line():
    zeta, natural, tooth = 0.025, 1000.0, 600.0
    # One mode: a line at r = f/f_n and the phase of its waves belong together (the equation of the module).
    ratios = np.linspace(1.0005, 1.14, 20000)
    phase = np.pi + 2 * np.arctan(2 * zeta * ratios / (ratios**2 - 1))
    line = natural * ratios[np.argmin(np.abs((natural * ratios / tooth % 1) * 2 * np.pi - phase))]
    assert natural_frequency(line, tooth, zeta) == pytest.approx(natural, rel=1e-3)
    speeds = propose_lobes(line, tooth, 4, highest=20000.0)
    assert speeds[0].speed == pytest.approx(60 * natural / 4, rel=1e-3) and speeds[0].lobe == 1
    assert all(s.lower <= s.speed <= s.upper for s in speeds)
    assert all(abs(60 * natural / (4 * s.lobe) / s.speed - 1) < 1e-3 for s in speeds)


def test_limits_of_the_spindle_are_checked():
    with pytest.raises(ToolpointError, match="must be 0 <= lowest < highest"):
        SpindleRange(3000.0, 5000.0)


def test_a_result_is_plain_data_with_its_doubts_first():
    data = listen(record(chattering(17)), TEETH).to_dict()
    assert next(iter(data)) == "doubts" and json.loads(json.dumps(data))["verdict"] == "chatter"


def test_tried_cuts_are_taken_from_their_recordings_and_those_that_cannot_tell_are_left_out():
    cuts = [(60 * SPINDLE, 1e-3, record(stable(20))), (60 * SPINDLE, 2e-3, record(chattering(21))),
            (8000.0, 3e-3, record(np.random.default_rng(22).normal(size=2 * RATE)))]
    judged, remarks = hear_tried(cuts, TEETH)
    assert [(depth, is_stable) for _, depth, is_stable in judged] == [(1e-3, True), (2e-3, False)]
    assert any("left out, its sound cannot tell" in remark for remark in remarks)
    with pytest.raises(ToolpointError, match="without the number of teeth"):
        hear_tried(cuts, None)


def test_a_searched_speed_makes_the_probability_more_modest():
    given, searched = (listen(record(chattering(16)), TEETH, speed) for speed in (60 * SPINDLE, None))
    assert given.probability > searched.probability > 0.9
    assert any("speed was searched" in note for note in searched.notes)


@pytest.mark.parametrize("probability", [0.0, 0.01, 0.3, 0.8, 0.999, 1.0])
def test_tempered_probabilities_keep_their_order_and_come_nearer_to_even(probability):
    tempered = temper_searched(probability)
    assert 0 < tempered < 1 and temper_searched(min(probability + 0.001, 1.0)) >= tempered
    assert abs(tempered - 0.4) <= abs(probability - 0.4) + 0.05
