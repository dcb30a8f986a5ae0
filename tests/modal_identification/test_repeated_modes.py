"""Law: modes that set-ups of sensors repeat are named, joined and corrected; close pairs of a structure never are.

The mass of one sensor that is moved from point to point is told by its frequencies, and leaves with its mass told.
"""

import re

import numpy as np
import pytest
from scipy.linalg import eigh

from toolpoint.modal_identification import identify
from toolpoint.modal_identification.judgement.moved_sensor import merge_split_modes
from toolpoint.studies import identify_modes
from toolpoint.vibration import Frf

COUNT, POINTS = 3, 12


def accelerances(frequency, damping, shape, references, lines):
    w, w_r = 2 * np.pi * lines[:, None], 2 * np.pi * frequency
    return np.einsum("fr,pr,qr->fpq", -(w**2) / (w_r**2 - w**2 + 2j * damping * w_r * w), shape, shape[references])


def with_sensors(frequency, shape, rows, mass):
    """Return frequencies and shapes of the structure with a mass at some rows, by a general eigenvalue problem."""
    values, vectors = eigh(np.diag((2 * np.pi * frequency) ** 2), np.eye(frequency.size) + mass * shape[rows].T @ shape[rows])
    return np.sqrt(values) / (2 * np.pi), shape @ vectors


def random_structure(seed, count=COUNT):
    rng = np.random.default_rng(seed)
    frequency = 80 * np.cumprod(1 + rng.uniform(0.15, 0.4, count))
    shape = rng.normal(size=(POINTS, count)) / np.sqrt(50)
    shape[0] = np.sign(shape[0]) * np.maximum(np.abs(shape[0]), 0.1)
    return rng, frequency, shape


def measured(rng, groups, lines, damping=0.003, references=(0,), labels=None):
    """Return noisy responses; `groups` are (rows, frequencies, shapes)."""
    values = np.empty((lines.size, POINTS, len(references)), complex)
    for rows, frequency, shape in groups:
        values[:, rows] = accelerances(frequency, damping, shape, list(references), lines)[:, rows]
    sd = 1e-3 * np.sqrt((np.abs(values) ** 2).mean(axis=0) + 1e-4 * (np.abs(values) ** 2).mean())
    values += sd * (rng.normal(size=values.shape) + 1j * rng.normal(size=values.shape))
    labels = labels or [f"{k + 1}:+z" for k in range(POINTS)]
    return Frf(lines, values, labels, [labels[k] for k in references], "accelerance")


def lines_of(frequency):
    return np.arange(0.8 * frequency.min(), 1.15 * frequency.max(), 0.0015 * frequency.min())


def roving_test(seed):
    rng, frequency, shape = random_structure(seed)
    mass = 0.02 / (shape**2).sum(axis=0).mean()
    half = rng.permutation(POINTS) < POINTS // 2
    groups = [(rows, *with_sensors(frequency, shape, rows, mass)) for rows in (np.flatnonzero(half), np.flatnonzero(~half))]
    # A set-up shows a mode of its own only where the masses part it from that of the other one.
    apart = np.abs(groups[0][1] / groups[1][1] - 1)
    return measured(rng, groups, lines_of(frequency)), frequency, mass, apart


@pytest.mark.parametrize("seed", range(4))
def test_half_of_the_points_at_one_lower_ratio_are_the_same_modes(seed):
    rng, frequency, shape = random_structure(seed)
    half = rng.permutation(POINTS) < POINTS // 2
    frf = measured(rng, [(np.flatnonzero(half), frequency, shape), (np.flatnonzero(~half), 0.99 * frequency, shape)],
                   lines_of(frequency))
    result = identify_modes(frf)
    assert result.modes.count == 2 * COUNT and result.doubtful.sum() == COUNT
    assert "another mass of sensors" in result.doubts[0] and "1 %" in result.doubts[0]
    assert result.table().startswith("doubt: ") and result.to_dict()["doubts"][0] == result.doubts[0]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.default_cases(2)
def test_the_mass_of_the_sensors_is_taken_out(seed):
    frf, frequency, mass, apart = roving_test(seed)
    assert (apart > 0.001).sum() >= 2
    lower = identify(frf)
    assert "another mass of sensors" in lower.doubts[0]
    joined = identify(frf, sensor_mass=mass)
    assert joined.modes.count == COUNT and joined.modes.scaling == "modal A"
    before = max(np.abs(lower.modes.frequency / f - 1).min() for f in frequency)
    error = np.abs(joined.modes.frequency / frequency - 1)
    assert error.max() < 0.2 * before and (error < 1.5e-3).all()
    assert (np.abs(joined.modes.frequency - frequency) <= 1.5 * joined.modes.frequency_interval).all()


def test_a_mass_that_does_not_explain_the_setups_is_said():
    frf, frequency, mass, _ = roving_test(0)
    joined = identify(frf, sensor_mass=mass / 8)
    assert joined.modes.count == COUNT and joined.doubts[0].what == "sensor's mass"
    # The interval is as wide as the set-ups differ.
    assert (np.abs(joined.modes.frequency - frequency) < 2 * joined.modes.frequency_interval).all()


def test_one_setup_says_what_its_sensor_moves():
    rng, frequency, shape = random_structure(5)
    frf = measured(rng, [(np.arange(POINTS), frequency, shape)], lines_of(frequency))
    mass = 0.02 / (shape**2).max()
    doubts = identify(frf, sensor_mass=mass).doubts
    assert len(doubts) == 1 and "lowers it by 1 %" in doubts[0]
    assert not identify(frf, sensor_mass=mass / 100).doubts


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["pairs", "planes", "twins"])
def test_pairs_of_a_structure_are_not_joined(kind, seed):
    rng, frequency, shape = random_structure(seed)
    labels, references = None, (0,)
    ratio = 1 + (rng.uniform(0.006, 0.03, COUNT) if kind == "pairs" else rng.uniform(0.006, 0.03))
    if kind == "pairs":
        shapes = [shape, rng.normal(size=shape.shape) / np.sqrt(50)]
    else:  # two planes at the same points, or two bodies; a reference in each
        side = np.arange(POINTS) % 2
        shapes = [shape * (side == k)[:, None] for k in (0, 1)]
        references = (0, 1)
        if kind == "planes":  # one skew reference answers both planes alike
            labels, references = ["99:+z", *(f"{k // 2 + 1}:+{'xy'[k % 2]}" for k in range(1, POINTS))], (0,)
            shapes[1][0] = shapes[0][0]
    both, every = np.concatenate([frequency, ratio * frequency]), np.concatenate(shapes, axis=1)
    frf = measured(rng, [(np.arange(POINTS), both, every)], lines_of(both), references=references, labels=labels)
    if kind == "planes":
        frf = frf.selected(list(range(1, POINTS)), [0])
    result = identify(frf)
    assert result.repeated is None and not any("another mass" in doubt for doubt in result.doubts)


def moved_test(seed, ratio=0.0008, damping=0.02):
    """Return responses of a structure with a sensor at each point in turn, its bare frequencies and the sensor's mass."""
    rng, frequency, shape = random_structure(seed)
    mass = ratio / (shape**2).sum(axis=1).mean()
    groups = [(np.array([k]), *with_sensors(frequency, shape, np.array([k]), mass)) for k in range(POINTS)]
    return measured(rng, groups, lines_of(frequency), damping=damping), frequency, mass


@pytest.mark.parametrize("seed", range(3))
def test_a_mass_that_is_told_leaves_the_modes_of_the_bare_structure(seed):
    frf, frequency, mass = moved_test(seed)
    result = identify(frf, sensor_mass=mass)
    assert result.modes.count == COUNT and not result.doubts
    assert np.abs(result.modes.frequency / frequency - 1).max() < 2e-4
    assert "point by point" in result.advice[0]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.default_cases(1)
def test_a_mass_that_is_not_told_is_found_and_named(seed):
    frf, _, mass = moved_test(seed)
    (words,) = [doubt for doubt in identify(frf).doubts if doubt.what == "sensor's mass"]
    estimate = float(re.search(r"about (\d+) g", words)[1]) / 1e3
    assert estimate == pytest.approx(mass, rel=0.2)


@pytest.mark.parametrize("factor", [0.3, 3.0])
@pytest.mark.default_cases(1)
def test_a_mass_told_wrong_is_contradicted(factor):
    frf, _, mass = moved_test(1)
    (words,) = [doubt for doubt in identify(frf, sensor_mass=factor * mass).doubts if doubt.what == "sensor's mass"]
    assert float(re.search(r"about (\d+) g", words)[1]) / 1e3 == pytest.approx(mass, rel=0.3)


def test_a_structure_without_a_moved_sensor_is_not_doubted():
    for seed in range(4):
        rng, frequency, shape = random_structure(seed)
        frf = measured(rng, [(np.arange(POINTS), frequency, shape)], lines_of(frequency))
        assert not [doubt for doubt in identify(frf).doubts if doubt.what == "sensor's mass"]


@pytest.mark.slow
def test_a_sensor_that_moves_modes_by_their_width_is_said_and_not_weighed():
    frf, _, mass = moved_test(2, 0.004, damping=0.003)
    (words,) = [doubt for doubt in identify(frf, sensor_mass=mass).doubts if doubt.what == "sensor's mass"]
    assert "cannot be taken out" in words


def test_modes_apart_are_not_merged():
    frf, _, _ = moved_test(0, 1e-6)
    modes = identify(frf).modes
    assert merge_split_modes(modes) is modes
