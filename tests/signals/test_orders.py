"""Orders of a spindle on synthetic combs whose speed, side bands and onset are known in closed form."""

import numpy as np
import pytest

from signals.heard_signals import RATE, comb, side_bands, with_noise
from toolpoint._check import ToolpointError
from toolpoint.signals.orders.cutting_part import find_cutting_part, measure_clipping
from toolpoint.signals.orders.growth import find_onset, follow_power, sample_each_turn
from toolpoint.signals.orders.line_spectrum import line_spectrum
from toolpoint.signals.orders.order_tracking import resample_by_angle, track_speed
from toolpoint.signals.orders.side_bands import find_families, separate_lines
from toolpoint.signals.orders.speed_rivals import rank_speeds
from toolpoint.signals.orders.spindle_comb import search_speed


def test_a_sine_has_its_power_and_frequency_between_bins():
    time = np.arange(30000) / 10000
    spectrum = line_spectrum(3 * np.cos(2 * np.pi * 432.123 * time)
                             + 0.01 * np.random.default_rng(0).normal(size=time.size), 10000.0)
    lines = spectrum.lines()
    assert lines.frequency[0] == pytest.approx(432.123, abs=0.02)
    assert lines.power[0] == pytest.approx(4.5, rel=0.1)


def test_white_noise_has_no_lines_and_its_own_floor():
    noise = np.random.default_rng(1).normal(size=60000)
    spectrum = line_spectrum(noise, 20000.0)
    assert spectrum.lines().frequency.size == 0
    assert spectrum.noise == pytest.approx(0.9, rel=0.1)  # the band ends at 0.45 of the rate


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.default_cases(2)
def test_frequencies_of_noisy_lines_scatter_as_their_deviation_says(seed):
    rng = np.random.default_rng(seed)
    time = np.arange(20000) / 10000
    errors = []
    for _ in range(30):
        f = rng.uniform(500, 600)
        lines = line_spectrum(np.cos(2 * np.pi * f * time) + rng.normal(size=time.size), 10000.0).lines()
        errors.append((lines.frequency[0] - f) / lines.deviation[0])
    assert 0.5 < np.std(errors) < 1.6


@pytest.mark.parametrize(("spindle", "teeth", "off"), [
    (133.37, 4, 0.012), (61.2, 2, -0.015), (250.9, 3, 0.018), (41.7, 6, -0.01)])
def test_speed_is_found_within_a_fifth_of_a_permille_about_a_stated_one(spindle, teeth, off):
    rng = np.random.default_rng(3)
    sound = with_noise(comb(spindle, teeth, 2.0, rng), 1.0, rng)
    stated = spindle * (1 + off)
    best = search_speed(line_spectrum(sound, RATE, highest=6000), teeth, (0.98 * stated, 1.02 * stated))[0]
    assert best.frequency == pytest.approx(spindle, rel=2e-4)
    assert abs(best.frequency - spindle) < 5 * best.deviation + 1e-4 * spindle


@pytest.mark.parametrize(("spindle", "teeth"), [(133.37, 4), (91.3, 3), (200.9, 2)])
@pytest.mark.default_cases(1)
def test_unknown_speed_is_found_beside_chatter(spindle, teeth):
    rng = np.random.default_rng(4)
    chatter = 6.37 * spindle * teeth / 2
    sound = with_noise(comb(spindle, teeth, 3.0, rng) + 2 * side_bands(chatter, teeth * spindle, 3.0, rng), 0.3, rng)
    spectrum, limits = line_spectrum(sound, RATE, highest=6000), (15.0, 500.0)
    ranked = rank_speeds(spectrum, search_speed(spectrum, teeth, limits), teeth, spindle_limits=limits)
    assert ranked[0].frequency == pytest.approx(spindle, rel=1e-3)


def test_hopf_lines_are_one_family_and_orders_are_in_none():
    rng, spindle, teeth = np.random.default_rng(5), 120.0, 4
    sound = with_noise(comb(spindle, teeth, 3.0, rng) + side_bands(1333.0, 480.0, 3.0, rng), 0.5, rng)
    spectrum = line_spectrum(sound, RATE, highest=6000)
    separated = separate_lines(spectrum, spindle, teeth)
    families = find_families(separated.others, spindle, teeth, cell=spectrum.cell)
    expected = {round(abs(1333.0 + 480.0 * k)) for k in range(-4, 5)}
    assert {round(float(f)) for f in families[0].lines.frequency} == expected
    assert families[0].base == pytest.approx(min(1333 % 480, 480 - 1333 % 480), abs=0.2)
    assert families[0].power == pytest.approx(0.5 * sum(0.4 ** (2 * abs(k)) for k in range(-4, 5)), rel=0.1)
    assert len(families) == 1


def test_harmonics_of_another_machine_are_no_family():
    rng, spindle, teeth = np.random.default_rng(6), 120.0, 4
    time = np.arange(3 * RATE) / RATE
    other = sum(np.cos(2 * np.pi * 173.3 * k * time) / k for k in range(1, 6))
    spectrum = line_spectrum(with_noise(comb(spindle, teeth, 3.0, rng) + 0.3 * other, 0.3, rng), RATE, highest=6000)
    families = find_families(separate_lines(spectrum, spindle, teeth).others, spindle, teeth, cell=spectrum.cell)
    assert max(family.members for family in families) <= 2


@pytest.mark.parametrize(("cells", "is_told"), [(0.3, False), (0.8, True)])
def test_a_line_nearer_to_an_order_than_resolution_belongs_to_it(cells, is_told):
    rng = np.random.default_rng(7)
    time = np.arange(2 * RATE) / RATE
    sound = comb(100.0, 4, 2.0, rng) + 2 * np.cos(2 * np.pi * (700 + cells / 2) * time)
    separated = separate_lines(line_spectrum(with_noise(sound, 0.1, rng), RATE, highest=6000), 100.0, 4)
    assert (separated.others.frequency.size > 0) == is_told
    assert separated.hidden == pytest.approx(2 * 1.5 / 2 / 100)


def test_tracking_makes_the_comb_of_a_ramp_sharp():
    rng, rate = np.random.default_rng(8), 12000
    time = np.arange(4 * rate) / rate
    ramp = 100 * (1 + 0.004 * (time / 2 - 1))
    phase = 2 * np.pi * np.cumsum(ramp) / rate
    sound = with_noise(sum(np.cos(4 * k * phase) / k for k in range(1, 8)), 0.3, rng)
    course = track_speed(sound, float(rate), 100.0, teeth=4)
    even = resample_by_angle(sound, float(rate), course)
    assert course.variation == pytest.approx(0.004, rel=0.25)
    high = 2800.0  # tooth passing 7
    sharp, blurred = (line_spectrum(x, float(rate)).highest_near(np.array([high]), 8.0)[0] for x in (even, sound))
    assert sharp > 5 * blurred


def test_a_steady_speed_is_not_tracked():
    rng = np.random.default_rng(9)
    assert track_speed(with_noise(comb(100.0, 4, 3.0, rng, rate=12000), 0.5, rng), 12000.0, 100.0, teeth=4).variation < 2e-4


def test_onset_and_growth_of_a_line_that_grows():
    rate = 12000
    time = np.arange(3 * rate) / rate
    envelope = np.minimum(1.0, 1e-3 * np.exp(8 * np.maximum(time - 0.5, 0)))  # reaches 1 after 0.86 s
    sound = envelope * np.cos(2 * np.pi * 900 * time) + 1e-4 * np.random.default_rng(10).normal(size=time.size)
    onset = find_onset(follow_power(sound, float(rate), np.array([900.0]), spacing=60.0))
    tenth = 0.5 + np.log(np.sqrt(0.1) / 1e-3) / 8
    assert onset.time == pytest.approx(tenth, abs=2 * onset.uncertainty + 0.02)
    assert onset.growth == pytest.approx(8, rel=0.25)


def test_a_line_that_is_always_there_has_no_onset():
    time = np.arange(24000) / 12000
    assert find_onset(follow_power(np.cos(2 * np.pi * 900 * time), 12000.0, np.array([900.0]), spacing=60.0)).time is None


def test_samples_each_turn_are_a_point_a_curve_and_two_points():
    rate, spindle, time = 12000.0, 100.0, np.arange(12000) / 12000
    stable = sample_each_turn(np.cos(2 * np.pi * 400 * time), rate, spindle)
    flip = sample_each_turn(np.cos(2 * np.pi * 400 * time) + np.cos(2 * np.pi * 250 * time), rate, spindle)
    hopf = sample_each_turn(np.cos(2 * np.pi * 400 * time) + np.cos(2 * np.pi * 437.3 * time), rate, spindle)
    assert np.ptp(stable[:, 0]) < 0.02
    assert len({round(float(v), 1) for v in flip[:, 0]}) == 2
    assert len({round(float(v), 1) for v in hopf[:, 0]}) > 8


def test_the_cut_is_told_from_the_time_beside_it():
    rng = np.random.default_rng(11)
    sound = np.concatenate([np.zeros(6000), comb(100.0, 4, 2.0, rng, rate=12000), np.zeros(9000)])
    part = find_cutting_part(sound + 0.02 * rng.normal(size=sound.size), 12000.0)
    assert part.is_told
    assert 6000 <= part.first < 8000 and 28500 < part.last <= 30000


def test_clipping_is_seen_and_a_loud_sine_is_not_clipped():
    rng = np.random.default_rng(12)
    sound = comb(100.0, 4, 1.0, rng)
    assert measure_clipping(np.clip(sound, -0.6 * sound.max(), 0.6 * sound.max())) > 2e-3
    assert measure_clipping(sound) < 2e-4
    time = np.arange(20000) / 44100
    for frequency in (60.0, 150.0, 400.0):
        sine = np.sin(2 * np.pi * frequency * time)
        assert measure_clipping(sine) == 0 and measure_clipping(np.round(60 * sine)) == 0
        noisy = np.clip(sine + 0.03 * rng.normal(size=time.size), -0.9, 0.9)
        assert measure_clipping(noisy + 3e-4 * rng.normal(size=time.size)) > 2e-3


def test_limits_of_the_search_are_checked():
    spectrum = line_spectrum(np.random.default_rng(13).normal(size=4000), 4000.0)
    with pytest.raises(ToolpointError, match="must be above zero and in order"):
        search_speed(spectrum, 4, (10.0, 5.0))
    with pytest.raises(ToolpointError, match="must reach one tooth passing"):
        search_speed(spectrum, 4, (900.0, 950.0))
