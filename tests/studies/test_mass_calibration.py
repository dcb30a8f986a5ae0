"""A hammer calibrated by blows on a free mass: F = m a, and what is no free mass is doubted."""

from __future__ import annotations

import numpy as np
import pytest
import tapping
from scipy import signal

from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.signals.record_set import RecordSet
from toolpoint.studies import calibrate_on_mass

RATE, MASS = 10_000.0, 1.25  # Hz, kg


def blows(factor: float, *, coupling: float = 0.5, mode: float | None = None, seed: int = 0) -> np.ndarray:
    """Return force reading (N) and acceleration of four blows on a block that hangs at `coupling` Hz; the true force is
    `factor` times the reading."""
    rng, count = np.random.default_rng(seed), round(4.6 * RATE)
    force = np.zeros(count)
    for k in range(4):
        place = round((0.7 + k) * RATE)
        force[place:place + 8] = rng.uniform(150, 220) * np.sin(np.pi * np.arange(8) / 8)
    b, a = signal.butter(1, coupling, "high", fs=RATE)
    motion = signal.lfilter(b, a, force / MASS)
    if mode is not None:
        w = 2 * np.pi * mode / RATE
        ring = np.exp(-0.01 * w * np.arange(3000)) * np.sin(w * np.arange(3000)) * w
        motion = motion + np.convolve(force / MASS, ring)[:count]
    samples = np.column_stack([force / factor, motion])
    return samples + 1e-4 * np.abs(samples).max(axis=0) * rng.standard_normal(samples.shape)


def record_set(samples: np.ndarray) -> RecordSet:
    volts = samples * [tapping.HAMMER, tapping.SENSOR]
    return RecordSet((tapping.inputs().record(volts, RATE),), ("blows",))


@pytest.mark.parametrize("factor", [1.0, 1.12, 0.8, -1.05])
def test_the_true_factor_lies_in_the_interval(factor):
    result = calibrate_on_mass(record_set(blows(factor)), MASS, duration=0.8, sensitivity="2.25 mV/N")
    assert abs(result.factor - factor) < max(result.half_width, 2e-3) < 0.03
    assert float(result.sensitivity.split()[0]) == pytest.approx(2.25 / factor, rel=0.01)
    assert ("sign is turned" in result.status) == (factor < 0) and result.used == 4


def test_an_input_that_is_ac_coupled_is_doubted():
    result = calibrate_on_mass(record_set(blows(1.0, coupling=12.0)), MASS, duration=0.8)
    assert any(doubt.what == "low lines" and "AC coupled" in doubt for doubt in result.doubts) and result.band[0] > 20


def test_a_block_that_bends_ends_the_band():
    result = calibrate_on_mass(record_set(blows(1.0, mode=1100.0)), MASS, duration=0.8)
    assert result.band[1] < 1000 and any(doubt.what == "high lines" for doubt in result.doubts)


def test_a_structure_is_doubted_and_noise_refused():
    """Above its mode a structure answers like its modal mass: only the factor and the missing low lines give it away."""
    struck = tapping.stream((200.0, 180.0, 190.0)) / [tapping.HAMMER, tapping.SENSOR]
    result = calibrate_on_mass(record_set(struck), 5.0, duration=0.4)
    assert {"factor", "low lines"} <= {doubt.what for doubt in result.doubts}
    struck[:, 1] = np.random.default_rng(0).standard_normal(len(struck)) * np.abs(struck[:, 1]).max()
    with pytest.raises(ToolpointError):
        calibrate_on_mass(record_set(struck), 5.0, duration=0.4)


def test_the_command_says_what_to_write(tmp_path, capsys):
    volts = blows(1.1) * [tapping.HAMMER, tapping.SENSOR]
    np.savez(tmp_path / "blows.npz", samples=volts, fs=RATE)
    (tmp_path / "test.yaml").write_text("""toolpoint: 1
test: "mass"
block: 0.8 s
channels:
  - {channel: "1", quantity: "force", dof: "mass:+x", sensitivity: "2.25mV/N"}
  - {channel: "2", quantity: "acceleration", dof: "mass:+x", sensitivity: "1.02mV/(m/s^2)"}
records:
  - {files: ["blows.npz"]}
""")
    main(["devices", "--hammer", str(tmp_path / "test.yaml"), "--mass", "1.25kg"])
    assert "write 2.0" in capsys.readouterr().out
