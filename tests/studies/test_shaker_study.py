"""Shaker tests as a user has them: every excitation gives the true responses within its intervals, or says what is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from toolpoint import ToolpointError, studies
from toolpoint.app.main import main
from toolpoint.io import read_hammer_test, write_noun
from toolpoint.signals import ShakerSettings
from toolpoint.signals.checks import free_of_masses
from toolpoint.vibration import Frf, Record

RATE, SECONDS = 1024.0, 128.0
MASS, DAMPING = np.diag([4.0, 3.0]), 0.01
STIFFNESS = np.array([[3.2e6, -1.2e6], [-1.2e6, 1.2e6]])  # modes at about 70 and 170 Hz
SQUARES, SHAPES = np.linalg.eigh(np.linalg.inv(np.sqrt(MASS)) @ STIFFNESS @ np.linalg.inv(np.sqrt(MASS)))
SHAPES = np.linalg.inv(np.sqrt(MASS)) @ SHAPES
DAMPERS = MASS @ SHAPES @ np.diag(2 * DAMPING * np.sqrt(SQUARES)) @ SHAPES.T @ MASS


def true_receptance(frequency, mass=0.0):
    """Receptance (n, 2, 2) of the two masses; `mass` (kg) sits on the first."""
    omega = 2 * np.pi * np.asarray(frequency)[:, None, None]
    return np.linalg.inv(STIFFNESS - omega**2 * (MASS + np.diag([mass, 0.0])) + 1j * omega * DAMPERS)


def record(force, *, noise=0.01, force_noise=0.0, seed=0, forces=(0,)):
    """Steady displacements of both masses under forces (n, k), with noise of a share of the rms of each."""
    receptance = true_receptance(np.fft.rfftfreq(len(force), 1 / RATE))[:, :, list(forces)]
    motion = np.fft.irfft(np.einsum("fij,fj->fi", receptance, np.fft.rfft(force, axis=0)), len(force), axis=0)
    rng = np.random.default_rng(seed)
    motion = motion + noise * motion.std(axis=0) * rng.standard_normal(motion.shape)
    force = force + force_noise * force.std(axis=0) * rng.standard_normal(force.shape)
    labels = [f"{i + 1}:+x" for i in forces] + ["1:+x", "2:+x"]
    return Record(np.hstack([force, motion]), RATE, labels, ["force"] * len(forces) + ["displacement"] * 2, name="shaken")


def forces_of(excitation, resolution, rng, count=1):
    """Forces (n, count) of a source: noise, bursts, sweeps with a pause, or one repeated block; below 400 Hz."""
    size, block = round(SECONDS * RATE), round(RATE / resolution)

    def limited(values):
        spectrum = np.fft.rfft(values, axis=0)
        spectrum[np.fft.rfftfreq(len(values), 1 / RATE) > 400] = 0
        return np.fft.irfft(spectrum, len(values), axis=0)

    if excitation == "random":
        return 50 * limited(rng.standard_normal((size, count)))
    time = np.arange(block) / RATE
    if excitation == "pseudo-random":
        return np.tile(50 * limited(rng.standard_normal((block, count))), (size // block, 1))
    active = time < 0.4 * block / RATE
    if excitation == "swept":
        last = 0.4 * block / RATE
        sweep = 50 * np.sin(2 * np.pi * (5 * time + 195 * time**2 / (2 * last))) * active
        return np.tile(sweep[:, None], (size // block, count))
    return np.vstack([50 * rng.standard_normal((block, count)) * active[:, None] for _ in range(size // block)])


RESOLUTIONS = {"random": 0.125, "burst": 0.125, "swept": 0.125, "pseudo-random": 0.25}


@pytest.mark.parametrize("excitation", RESOLUTIONS)
def test_every_excitation_gives_the_true_responses_within_its_circles(excitation):
    resolution = RESOLUTIONS[excitation]
    force = forces_of(excitation, resolution, np.random.default_rng(3))
    settle = 8 if excitation == "pseudo-random" else 0
    settings = ShakerSettings(resolution, excitation, band=(20, 190), settle=settle)
    result = studies.study_shaker_records([record(force)], settings)
    assert [d for d in result.doubts if d.about in ("force", "responses", "resolution", "peaks")] == []
    truth = true_receptance(result.frf.frequency)[:, :, [0]]
    radius = result.radius()
    loud = np.abs(truth) > 0.3 * np.abs(truth).max(axis=0)
    error = np.abs(result.frf.values - truth)
    assert np.median(error[loud] / np.abs(truth)[loud]) < 0.02
    if excitation != "random":  # a window's bias is beside its scatter
        assert np.mean(error[loud] <= radius[loud] + 2e-3 * np.abs(truth)[loud]) > 0.9


def test_circles_of_random_excitation_hold_the_truth_as_often_as_they_say():
    """Noise of a tenth of the motion's rms hides the window's bias; overlapping blocks count as fewer than they are."""
    force = forces_of("random", 0.5, np.random.default_rng(8))
    result = studies.study_shaker_records([record(force, noise=0.2, seed=5)], ShakerSettings(0.5, band=(20, 300)))
    truth = true_receptance(result.frf.frequency)[:, :, [0]]
    quiet = (result.frf.frequency > 190)[:, None, None] & np.ones_like(truth, bool)
    held = np.mean(np.abs(result.frf.values - truth)[quiet] <= result.radius()[quiet])
    assert 0.9 < held < 0.985


def test_two_shakers_at_once_and_two_that_go_together():
    rng = np.random.default_rng(5)
    force = forces_of("random", 0.125, rng, 2)
    settings = ShakerSettings(0.125, band=(20, 190))
    result = studies.study_shaker_records([record(force, forces=(0, 1))], settings)
    truth = true_receptance(result.frf.frequency)
    loud = np.abs(truth) > 0.3 * np.abs(truth).max(axis=0)
    assert np.median(np.abs(result.frf.values - truth)[loud] / np.abs(truth)[loud]) < 0.03
    assert not any("go together" in doubt for doubt in result.doubts) and result.pairs[0].agreement > 0.99
    tied = force.copy()
    tied[:, 1] = tied[:, 0] + 0.05 * tied[:, 1]
    assert any("go together" in doubt for doubt in studies.study_shaker_records([record(tied, forces=(0, 1))], settings).doubts)


@pytest.mark.parametrize(("true_kind", "told_kind", "resolution", "words"), [
    ("random", "pseudo-random", 0.25, "differs from block to block"), ("random", "burst", 0.25, "at the end of a block"),
    ("random", "random", 2.0, "lowers the sharpest peak")])
def test_an_excitation_that_is_not_what_was_said_is_doubted(true_kind, told_kind, resolution, words):
    force = forces_of(true_kind, 0.25, np.random.default_rng(1))
    result = studies.study_shaker_records([record(force)], ShakerSettings(resolution, told_kind, band=(20, 190)))
    assert any(words in doubt for doubt in result.doubts)


def test_blows_and_noise_on_the_force_are_doubted():
    size = round(SECONDS * RATE)
    blows = np.zeros((size, 1))
    blows[::4096] = 100.0
    assert any("short blows" in doubt for doubt in
               studies.study_shaker_records([record(blows)], ShakerSettings(0.25, "burst", band=(20, 190))).doubts)
    noisy = record(forces_of("random", 0.125, np.random.default_rng(1)), force_noise=0.3)
    result = studies.study_shaker_records([noisy], ShakerSettings(0.125, band=(20, 190)))
    assert any("H2 is" in doubt for doubt in result.doubts)


def test_moved_sensors_are_joined_and_two_records_are_averaged():
    rng = np.random.default_rng(2)
    parts = [record(forces_of("random", 0.125, rng), seed=k) for k in range(2)]
    halves = [Record(part.samples[:, [0, 1 + k]], RATE, [part.channels[0], part.channels[1 + k]], ["force", "displacement"])
              for k, part in enumerate(parts)]
    settings = ShakerSettings(0.125, band=(20, 190))
    joined = studies.study_shaker_records(halves, settings)
    assert len(joined.set_ups) == 2 and joined.frf.values.shape[1:] == (2, 1)
    both = studies.study_shaker_records(parts, settings)
    assert both.set_ups[0].record_count == 2
    assert both.set_ups[0].blocks == pytest.approx(2 * studies.study_shaker_records(parts[:1], settings).set_ups[0].blocks)


def test_the_mass_of_a_sensor_is_taken_off_at_a_driving_point():
    frequency = np.arange(20, 190, 0.5)
    loaded = Frf(frequency, true_receptance(frequency, 0.2)[:, :, [0]], ["1:+x", "2:+x"], ["1:+x"], "receptance",
                 variance=np.full((len(frequency), 2, 1), 1e-18))
    freed = free_of_masses(loaded, {"1:+x": 0.2, "2:+x": 0.1})
    assert np.allclose(freed.values, true_receptance(frequency)[:, :, [0]], rtol=1e-9)
    assert freed.variance is not None and "0.1 kg at 2:+x stays" in freed.notes[-1]


def test_the_variance_without_a_mass_is_that_of_draws():
    frequency, rng = np.r_[20:60:10, 64:76, 80:190:10].astype(float), np.random.default_rng(4)
    truth = true_receptance(frequency, 0.2)[:, [0]][:, :, [0]]
    sigma = 1e-3 * np.abs(truth)
    draws = [free_of_masses(Frf(frequency, truth + sigma * (rng.standard_normal(truth.shape) + 1j * rng.standard_normal(
        truth.shape)) / np.sqrt(2), ["1:+x"], ["1:+x"], "receptance"), {"1:+x": 0.2}).values for _ in range(400)]
    stated = free_of_masses(Frf(frequency, truth, ["1:+x"], ["1:+x"], "receptance", variance=sigma**2), {"1:+x": 0.2}).variance
    assert np.asarray(stated) == pytest.approx(np.var(draws, axis=0), rel=0.35, abs=0)


def test_the_command_reads_a_test_file_of_a_shaker(tmp_path, capsys):
    path = tmp_path / "shaken.h5"
    write_noun(record(forces_of("burst", 0.25, np.random.default_rng(3))), path)
    main(["frf", str(path), "--excitation", "burst", "--resolution", "0.25", "--zoom", "20:190", "-o", str(tmp_path / "page"),
          "--test", str(tmp_path / "test.yaml"), "--save", str(tmp_path / "r.h5"), "--json"])
    data = json.loads(capsys.readouterr().out)
    assert data["excitation"] == "burst" and data["line_spacing_hz"] == 0.25 and data["doubts"] == []
    _, description = read_hammer_test(tmp_path / "test.yaml")
    assert description.shaker == ShakerSettings(0.25, "burst", band=(20.0, 190.0))
    main(["frf", str(tmp_path / "test.yaml"), "-o", str(tmp_path / "again"), "--json"])
    assert json.loads(capsys.readouterr().out)["status"] == data["status"]
    (tmp_path / "bad.yaml").write_text((tmp_path / "test.yaml").read_text().replace("resolution: 0.25 Hz\n", ""))
    with pytest.raises(ToolpointError, match="resolution: missing"):
        read_hammer_test(tmp_path / "bad.yaml")


def test_a_project_takes_a_test_file_of_a_shaker(tmp_path):
    from toolpoint.project.steps.measuring import make_responses

    write_noun(record(forces_of("burst", 0.25, np.random.default_rng(3))), tmp_path / "shaken.h5")
    (tmp_path / "test.yaml").write_text("toolpoint: 1\ntest: bed\nexcitation: burst\nresolution: 0.25 Hz\n"
                                        "zoom: [20 Hz, 190 Hz]\nrecords:\n  - {files: [shaken.h5]}\n")
    outcome = make_responses(tmp_path, tmp_path / "test.yaml")
    assert "burst excitation" in outcome.words
    assert (tmp_path / "responses.h5").exists() and json.loads((tmp_path / "hits.json").read_text())["excitation"] == "burst"
