"""Operational modal analysis: poles by closed form, first-order deviations by differences, harmonics, set-ups, doubts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import signal

from toolpoint._check import ToolpointError
from toolpoint.modal_identification import Subspace, identify_operational
from toolpoint.modal_identification.operational.band_modes import pole_covariance
from toolpoint.modal_identification.operational.bands import plan_bands
from toolpoint.modal_identification.operational.correlations import Correlations, correlate_blocks
from toolpoint.modal_identification.operational.drift import question_drift
from toolpoint.modal_identification.operational.harmonics import Harmonic, number_orders, remove_harmonics
from toolpoint.modal_identification.operational.line_remainders import remainders_of_lines
from toolpoint.modal_identification.operational.mode_selection import SelectedModes
from toolpoint.modal_identification.operational.record_doubts import question_records
from toolpoint.modal_identification.operational.shapes import fit_shapes
from toolpoint.modal_identification.operational.subspace import subspace_poles
from toolpoint.vibration import Modes, Record
from toolpoint.vibration.correlation import mac

POLES = 2 * np.pi * np.array([10.0, 17.0, 31.0]) * np.array([-0.01 + 1j, -0.02 + 1j, -0.015 + 1j])
RATE = 100.0


def decays(lags: int = 60, channels: int = 4, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return correlations that are sums of exact decays, (lags, channels, channels), and their shapes."""
    rng = np.random.default_rng(seed)
    shapes = rng.standard_normal((channels, POLES.size)) + 0.1j * rng.standard_normal((channels, POLES.size))
    gains = rng.standard_normal((channels, POLES.size)) + 1j * rng.standard_normal((channels, POLES.size))
    waves = np.exp(np.arange(lags)[:, None] / RATE * POLES)
    return 2 * np.einsum("lr,cr,ir->lci", waves, shapes, gains).real, shapes


def ringing(poles: np.ndarray, shapes: np.ndarray, seconds: float, seed: int) -> np.ndarray:
    """Return motion (n, n_channels) of modes under independent white loads, started long before."""
    rng = np.random.default_rng(seed)
    motion = []
    for s in poles:
        mu = np.exp(s / RATE)
        noise = rng.standard_normal(int(seconds * RATE) + 20000)
        motion.append(signal.lfilter([1.0], [1.0, -2 * mu.real, abs(mu) ** 2], noise)[20000:])
    motion = np.array(motion).T
    return motion / motion.std(axis=0) @ shapes.T


def test_correlations_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(3)
    y = rng.standard_normal((1000, 3))
    found = correlate_blocks([y], 0.01, [2, 0], lags=9, blocks=5)
    length = (1000 - 9) // 5
    first = y[:length + 9]
    for lag in (0, 4, 9):
        expected = first[lag:lag + length].T @ first[:length][:, [2, 0]] / length
        assert found.blocks[0, lag] == pytest.approx(expected, rel=1e-10, abs=1e-12)
    assert found.blocks.shape == (5, 10, 3, 2)


@pytest.mark.parametrize("weight_past", [False, True])
def test_poles_of_exact_decays(weight_past: bool) -> None:
    mean, shapes = decays()
    if weight_past:
        # The covariance of the past must be one: that of a record.
        samples = ringing(POLES, np.random.default_rng(1).standard_normal((4, 3)), 400.0, 2)
        correlations = correlate_blocks([samples], 1 / RATE, [0, 1, 2, 3], lags=59, blocks=4)
    else:
        correlations = Correlations(mean[None].repeat(2, axis=0), 1 / RATE, (0, 1, 2, 3))
    found = subspace_poles(correlations, 6, omega_range=(0, 300), weight_past=weight_past).diagram
    best = np.sort_complex(found.poles[found.order == 6])[::-1]
    best = best[np.argsort(np.abs(best))]
    assert best == pytest.approx(POLES, rel=2e-3 if weight_past else 1e-8)
    if not weight_past:
        vectors = found.participation[:, found.order == 6][:, np.argsort(np.abs(found.poles[found.order == 6]))]
        assert np.diag(mac(vectors, shapes)) == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize(("order", "tolerance"), [(6, 2e-3), (12, 0.7)])
def test_deviations_of_poles_are_their_differences(order: int, tolerance: float) -> None:
    """A mode's deviation is what a small change of the correlations does; above the true order to its size alone."""
    mean, _ = decays()
    rng = np.random.default_rng(5)
    noisy = mean + 1e-5 * np.abs(mean).max() * rng.standard_normal(mean.shape)
    change = 1e-8 * np.abs(mean).max() * rng.standard_normal(mean.shape)
    references = (0, 1, 2, 3)
    pair = subspace_poles(Correlations(np.array([noisy + change, noisy - change]), 1 / RATE, references), order,
                          omega_range=(0, 300))
    moved = [subspace_poles(Correlations((noisy + sign * change)[None].repeat(2, axis=0), 1 / RATE, references), order,
                            omega_range=(0, 300)).diagram for sign in (1, -1)]
    for pole in POLES:
        here = [np.flatnonzero(found.order == order)[np.argmin(np.abs(found.poles[found.order == order] - pole))]
                for found in (pair.diagram, *moved)]
        slope = (moved[0].poles[here[1]] - moved[1].poles[here[2]]) / 2
        assert abs(pair.deviations[0, here[0]] - slope) < tolerance * abs(slope)


def test_shapes_of_exact_decays_and_their_deviations() -> None:
    mean, shapes = decays()
    flat = np.zeros((2, POLES.size), complex)
    fitted = fit_shapes(Correlations(mean[None].repeat(2, axis=0), 1 / RATE, (0, 1, 2, 3)), POLES, flat, rows=30)
    assert np.diag(mac(fitted.shape, shapes)) == pytest.approx(1.0, rel=1e-10)
    rng = np.random.default_rng(2)
    change = 1e-6 * np.abs(mean).max() * rng.standard_normal(mean.shape)
    shift = 1e-6 * np.abs(POLES) * (rng.standard_normal(3) + 1j * rng.standard_normal(3))
    pair = fit_shapes(Correlations(np.array([mean + change, mean - change]), 1 / RATE, (0, 1, 2, 3)), POLES,
                      np.array([shift, -shift]), rows=30)
    moved = [fit_shapes(Correlations((mean + s * change)[None].repeat(2, axis=0), 1 / RATE, (0, 1, 2, 3)), POLES + s * shift,
                        flat,
                        rows=30).shape for s in (1, -1)]
    for r in range(3):
        v = fitted.shape[:, r]
        difference = (moved[0][:, r] - moved[1][:, r]) / 2
        # The turn of a shape is free: what lies across it counts.
        difference = difference - np.vdot(v, difference) * v
        assert pair.deviations[0][:, r] / 1e-6 == pytest.approx(difference / 1e-6, abs=1e-3 * np.abs(difference).max() / 1e-6)


def test_covariance_of_frequency_and_damping_is_led_from_the_poles() -> None:
    rng = np.random.default_rng(7)
    deviations = rng.standard_normal((200, 3)) + 2j * rng.standard_normal((200, 3))
    deviations -= deviations.mean(axis=0)
    selected = SelectedModes(POLES, deviations, np.zeros(3, complex), np.ones(3), np.zeros(0))
    covariance = pole_covariance(selected)
    size = np.abs(POLES + 1e-6 * deviations)
    frequency = (size - np.abs(POLES)) / 1e-6 / (2 * np.pi)
    ratio = (-(POLES + 1e-6 * deviations).real / size + POLES.real / np.abs(POLES)) / 1e-6
    assert covariance[:, 0, 0] == pytest.approx((frequency**2).sum(axis=0) / (200 * 199), rel=1e-4)
    assert covariance[:, 1, 1] == pytest.approx((ratio**2).sum(axis=0) / (200 * 199), rel=1e-4)
    assert covariance[:, 0, 1] == pytest.approx((frequency * ratio).sum(axis=0) / (200 * 199), rel=1e-3, abs=1e-9)


def with_lines(wander: float, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Return motion of the three modes with two harmonics of 4.9 Hz (one 2 % below a mode), and without them."""
    rng = np.random.default_rng(seed)
    plain = ringing(POLES, np.random.default_rng(1).standard_normal((4, 3)), 300.0, seed)
    time = np.arange(plain.shape[0]) / RATE
    speed = signal.lfilter([0.05], [1, -0.9987], rng.standard_normal(time.size))
    angle = 2 * np.pi * 4.9 * (time + np.cumsum(speed / speed.std()) * wander / RATE)
    lines = sum(np.cos(k * angle + rng.uniform(0, 6))[:, None] * rng.standard_normal(4) * 2 for k in (2, 5))
    return plain + lines, plain


@pytest.mark.parametrize("wander", [0.0, 1e-4])
def test_harmonics_are_found_and_taken_off(wander: float) -> None:
    record, plain = with_lines(wander)
    cleaned, harmonics = remove_harmonics(record, RATE)
    harmonics = number_orders(harmonics, RATE / record.shape[0])
    assert [h.frequency for h in harmonics] == pytest.approx([9.8, 24.5], abs=0.01)
    assert [h.order for h in harmonics] == [2, 5]
    left = cleaned - plain[:cleaned.shape[0]]
    assert left.std() < 0.15 * plain.std()


@pytest.mark.slow
def test_a_record_without_harmonics_has_none() -> None:
    for seed in range(3):
        plain = ringing(POLES, np.random.default_rng(seed).standard_normal((4, 3)), 300.0, seed)
        cleaned, harmonics = remove_harmonics(plain, RATE)
        assert harmonics == ()
        assert cleaned == pytest.approx(plain[:cleaned.shape[0]] - plain[:cleaned.shape[0]].mean(axis=0))


def test_lines_of_two_machines_have_the_orders_of_one() -> None:
    lines = tuple(Harmonic(f, 0.0, 0.1, 1.0) for f in (12.0, 23.7, 24.0, 36.0))
    assert [h.order for h in number_orders(lines, 0.01)] == [1, None, 2, 3]


def test_modes_of_a_record_with_harmonics() -> None:
    record, _ = with_lines(1e-4)
    found = identify_operational(Record(record, RATE, [f"{k}:+x" for k in range(4)], "acceleration"))
    modes = found.modes
    assert modes.count == 3
    assert np.all(np.abs(modes.frequency - np.abs(POLES) / 2 / np.pi) < 2 * modes.frequency_interval)
    assert np.all(np.abs(modes.damping_ratio + POLES.real / np.abs(POLES)) < 2 * modes.damping_interval)
    assert "harmonics of rotating parts (no modes)" in found.status
    assert modes.scaling == "unscaled"


def test_kept_harmonics_are_no_modes_either() -> None:
    record, _ = with_lines(0.0)
    found = identify_operational(Record(record, RATE, [f"{k}:+x" for k in range(4)], "acceleration"), keep_harmonics=True)
    for line in (9.8, 24.5):
        assert np.abs(found.modes.frequency - line).min() > 0.05


def test_shapes_are_displacements_whatever_is_measured() -> None:
    shapes = np.random.default_rng(1).standard_normal((4, 3))
    motion = ringing(POLES, shapes, 300.0, 8)
    spectrum = np.fft.rfft(motion, axis=0)
    omega = 2j * np.pi * np.fft.rfftfreq(motion.shape[0], 1 / RATE)
    mixed = motion.copy()
    mixed[:, 1] = np.fft.irfft(spectrum[:, 1] * omega, motion.shape[0])
    record = Record(mixed, RATE, [f"{k}:+x" for k in range(4)], ["displacement", "velocity", "displacement", "displacement"])
    found = identify_operational(record, band=(5.0, 39.0))
    assert np.diag(mac(found.modes.shape, shapes)).min() > 0.98


def test_what_a_removed_line_leaves_is_no_mode() -> None:
    """Mixed phases and an unknown damping within the half width of a removed line are a remainder; else a mode is doubted."""
    shape = np.array([[1.0, 1.0], [1.0j, -0.8], [-1.0, 0.5]])
    covariance = np.zeros((2, 2, 2))
    covariance[:, 1, 1] = [(0.2 * 0.003) ** 2, (0.02 * 0.004) ** 2]
    modes = Modes([20.0, 30.0], [0.003, 0.004], shape, ["1:+x", "2:+x", "3:+x"], "unscaled", covariance=covariance)
    lines = tuple(Harmonic(f, 1e-4, 0.99, 1.0) for f in (20.03, 30.02, 50.0))
    is_remainder, doubts = remainders_of_lines(modes, np.array([0.01, 0.01]), lines)
    assert is_remainder.tolist() == [True, False]
    assert len(doubts) == 1 and doubts[0].startswith("mode at 30 Hz")
    far, none = remainders_of_lines(modes, np.array([0.01, 0.01]), (Harmonic(20.1, 1e-4, 0.99, 1.0),))
    assert not far.any() and none == ()


def test_what_a_strong_line_leaves_beside_a_mode_that_is_known_better_is_no_mode() -> None:
    """It has the shape of the mode that the line drives; alone, or known as well as the other, it is kept and doubted."""
    def sorted_out(frequencies: list[float], deviations: list[float]) -> tuple[list[bool], int]:
        covariance = np.zeros((len(frequencies), 2, 2))
        covariance[:, 1, 1] = (np.array(deviations) * 0.003) ** 2
        modes = Modes(frequencies, [0.003] * len(frequencies), np.outer([1.0, -0.8, 0.5], np.ones(len(frequencies))),
                      ["1:+x", "2:+x", "3:+x"], "unscaled", covariance=covariance)
        is_remainder, doubts = remainders_of_lines(modes, np.full(len(frequencies), 0.01), (Harmonic(20.1, 1e-4, 0.99, 1.0),))
        return is_remainder.tolist(), len(doubts)

    assert sorted_out([20.0, 20.1], [0.05, 0.2]) == ([False, True], 0)
    assert sorted_out([20.0, 20.1], [0.18, 0.2]) == ([False, False], 1)
    assert sorted_out([20.0, 20.1], [0.01, 0.05]) == ([False, False], 1)
    assert sorted_out([19.0, 20.1], [0.05, 0.2]) == ([False, False], 1)


def test_noise_has_no_modes() -> None:
    noise = np.random.default_rng(0).standard_normal((30000, 3))
    with pytest.raises(ToolpointError, match="no mode found"):
        identify_operational(Record(noise, RATE, ["1:+x", "2:+x", "3:+x"], "acceleration"))


def test_a_short_record_is_refused_with_the_length_that_it_needs() -> None:
    with pytest.raises(ToolpointError, match=r"must be at least .* s for a band"):
        identify_operational(Record(np.random.default_rng(0).standard_normal((900, 2)), RATE, ["1:+x", "2:+x"], "acceleration"))


def test_bands_share_the_range_without_gaps() -> None:
    plan = plan_bands([600000], 1000.0, 40, blocks=40, band=None)
    assert plan[-1].frequency_min == 0.0
    assert all(upper.frequency_min == lower.frequency_max for upper, lower in pairwise(plan))
    assert plan[0].frequency_max == pytest.approx(1000 / 2.56)
    with pytest.raises(ToolpointError, match="must end at"):
        plan_bands([600000], 1000.0, 40, blocks=40, band=(0.0, 450.0))


@pytest.mark.slow
def test_setups_of_roving_sensors_are_joined() -> None:
    shapes = np.random.default_rng(1).standard_normal((5, 3))
    names = ["ref:+x", "ref:+y", "1:+x", "2:+x", "3:+x"]
    parts = []
    for seed, picks in ((1, [0, 1, 2, 3]), (2, [0, 1, 4])):
        motion = ringing(POLES, shapes, 300.0, seed)
        parts.append(Record(motion[:, picks], RATE, [names[k] for k in picks], "acceleration"))
    found = identify_operational(parts)
    assert [str(dof) for dof in found.modes.dofs] == names
    assert np.diag(mac(found.modes.shape, shapes)).min() > 0.98
    alone = identify_operational(parts[0])
    assert np.all(found.modes.frequency_interval < alone.modes.frequency_interval)


def test_setups_without_a_common_channel_are_refused() -> None:
    noise = np.random.default_rng(0).standard_normal((30000, 1))
    records = [Record(noise, RATE, [name], "acceleration") for name in ("1:+x", "2:+x")]
    with pytest.raises(ToolpointError, match="without a common channel"):
        identify_operational(records)


def test_a_sensor_that_carries_mass_is_told() -> None:
    shapes = np.random.default_rng(1).standard_normal((4, 3))
    lowered = POLES.copy()
    lowered[1] *= 0.98
    records = [Record(ringing(poles, shapes, 300.0, k)[:, picks], RATE, [f"{i}:+x" for i in picks], "acceleration")
               for k, (poles, picks) in enumerate(((POLES, [0, 1, 2]), (lowered, [0, 1, 3])))]
    doubts = identify_operational(records).doubts
    assert any("between set-ups" in doubt and doubt.startswith("mode at 16.") for doubt in doubts)


def test_a_drift_of_a_frequency_is_told() -> None:
    rng = np.random.default_rng(0)
    deviations = 0.1 * (rng.standard_normal((40, 3)) + 1j * rng.standard_normal((40, 3)))
    selected = SelectedModes(POLES, deviations, np.zeros(3, complex), np.ones(3), np.zeros(0))
    assert question_drift(selected, 40) == ()
    drifting = deviations.copy()
    drifting[:, 1] += 1j * np.linspace(-0.5, 0.5, 40)
    doubts = question_drift(SelectedModes(POLES, drifting, np.zeros(3, complex), np.ones(3), np.zeros(0)), 40)
    assert len(doubts) == 1 and doubts[0].startswith("mode at 17 Hz")


def test_clipped_and_uneven_records_are_doubted() -> None:
    motion = ringing(POLES, np.eye(3), 60.0, 3)
    good = Record(motion, RATE, ["1:+x", "2:+x", "3:+x"], "acceleration")
    assert question_records([good]) == ()
    clipped = motion.copy()
    clipped[:, 1] = np.clip(clipped[:, 1], -1.5 * motion[:, 1].std(), 1.5 * motion[:, 1].std())
    assert "2:+x" in question_records([Record(clipped, RATE, good.channels, "acceleration")])[0]
    coarse = np.round(motion * 4) / 4
    assert question_records([Record(coarse, RATE, good.channels, "acceleration")]) == ()
    uneven = motion.copy()
    uneven[3000:3600] *= 10
    assert "level changes" in question_records([Record(uneven, RATE, good.channels, "acceleration")])[0]


def test_channels_that_are_no_motion_are_left_out_and_named() -> None:
    motion = ringing(POLES, np.random.default_rng(1).standard_normal((3, 3)), 200.0, 3)
    motion[:, 2] = 1.0
    record = Record(motion, RATE, ["1:+x", "2:+x", "3:+x"], ["acceleration", "acceleration", "acceleration"])
    found = identify_operational(record)
    assert any("3:+x left out" in note for note in found.notes)
    with pytest.raises(ToolpointError, match="measures motion"):
        identify_operational(Record(motion, RATE, ["1:+x", "2:+x", "3:+x"], "force"))


@pytest.mark.slow
@pytest.mark.parametrize(("method", "count"), [("ssi-cov", 40), ("ssi-data", 20)])  # the data's own way errs by the same law
def test_intervals_hold_over_many_records(method: str, count: int) -> None:
    shapes = np.random.default_rng(1).standard_normal((4, 3))
    inside = []
    for seed in range(count):
        record = Record(ringing(POLES, shapes, 200.0, 100 + seed), RATE, [f"{k}:+x" for k in range(4)], "acceleration")
        modes = identify_operational(record, method, band=(5.0, 39.0)).modes
        assert modes.count == 3
        inside += (np.abs(modes.frequency - np.abs(POLES) / 2 / np.pi) < modes.frequency_interval).tolist()
        inside += (np.abs(modes.damping_ratio + POLES.real / np.abs(POLES)) < modes.damping_interval).tolist()
    assert 0.90 < np.mean(inside) <= 1.0


def test_settings_are_a_choice() -> None:
    record, _ = with_lines(0.0)
    found = identify_operational(Record(record, RATE, [f"{k}:+x" for k in range(4)], "acceleration"), Subspace(order=20,
                                                                                                               rows=30))
    assert found.modes.count == 3


@pytest.mark.parametrize("channels", [1, 3])
def test_intervals_are_no_narrower_than_a_record_can_tell(channels: int) -> None:
    """The floor of any estimator (Au's laws, white load): s_f / f = sqrt(zeta / 2 pi f T), s_zeta / zeta = 1 / sqrt(2 pi
    zeta f T).

    One channel has few block rows to spare: an order near their number would leave no scatter, and an interval of nothing.
    """
    shapes = np.abs(np.random.default_rng(1).standard_normal((4, 3)))[:channels] + 0.3
    record = Record(ringing(POLES, shapes, 300.0, 5), RATE, [f"{k}:+x" for k in range(channels)], "acceleration")
    modes = identify_operational(record, band=(5.0, 39.0)).modes
    assert modes.count == 3
    frequency, ratio = np.abs(POLES) / 2 / np.pi, -POLES.real / np.abs(POLES)
    floor_frequency = frequency * np.sqrt(ratio / (2 * np.pi * frequency * 300.0))
    floor_ratio = ratio / np.sqrt(2 * np.pi * ratio * frequency * 300.0)
    assert np.all(modes.frequency_interval > 1.96 * 0.6 * floor_frequency)
    assert np.all(modes.damping_interval > 1.96 * 0.6 * floor_ratio)
