"""Margins: crossings at half the sample rate, noise of measured loops, decibels; slow position loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drives import servo_cases as cases
from toolpoint.drives import compute_loops
from toolpoint.drives.controller.loops import LoopLevel, margins
from toolpoint.io.program import gcode
from toolpoint.io.servo_data import sinumerik
from toolpoint.studies import run_drives
from toolpoint.vibration import StateSpace


def integrator(gain, step=1e-3):
    """Return a sampled proportional loop about an integrator: x' = x + k u, closed poles 1 - k."""
    system = lambda a: StateSpace([[a]], [[gain]], [[1.0]], [[0.0]], ("r",), ("y",), sample_time=step, hold="zero")
    return LoopLevel("position", system(1 - gain), lambda axis: system(1.0))


@pytest.mark.parametrize("gain", [0.1, 1.0, 1.795, 1.99])
def test_a_sampled_integrator_is_limited_at_half_its_sample_rate(gain):
    """1 - k reaches -1 at k = 2: the margin is 2/k, 0.94 dB at 1.795, though the phase only touches -180 deg there."""
    m = integrator(gain).margins()
    assert m.gain_db == pytest.approx(20 * np.log10(2 / gain), abs=1e-6)
    assert m.phase_crossover == pytest.approx(500.0)
    assert "dB" in repr(m)


def test_the_gain_margin_is_what_destabilises():
    """Times the gain margin the closed loop has a multiplier on the unit circle."""
    for gain in (0.3, 0.9):
        factor = integrator(gain).margins().gain
        assert integrator(gain * factor).radius == pytest.approx(1.0, abs=1e-9)


def test_crossings_of_noise_do_not_count():
    rng = np.random.default_rng(0)
    f = np.arange(1, 1001.0)
    plant = 200 / (1j * f) * np.exp(-2j * np.pi * f * 1e-3)
    clean = margins(f, plant)
    noise = np.exp(2j * np.pi * rng.random(f.size)) * (f > 600)
    coherence = np.where(f > 600, rng.random(f.size), 0.98)
    loud = np.where(f > 600, noise, plant)
    assert margins(f, loud).gain != pytest.approx(clean.gain, rel=0.02)
    m = margins(f, loud, coherence)
    assert (m.gain, m.phase) == pytest.approx((clean.gain, clean.phase), rel=1e-9)
    assert 0.55 < m.trusted < 0.65


def test_measured_loop_of_a_control(measured):
    """The vendor's measurement: 17.4 dB at 290 Hz; crossings near 2239 Hz are noise."""
    m = sinumerik.read(measured / "sinumerik" / "freq_trace.XML").loop.margins
    assert m.gain_db == pytest.approx(17.4, abs=0.2)
    assert m.phase_crossover == pytest.approx(290, abs=3)
    assert "2240 Hz" in m.doubt or "2239" in m.doubt


@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_a_slow_position_loop_runs():
    from drives.test_description import DRIVES

    slow = {name: replace(axis, position=replace(axis.position, gain=5.0, sample_time=20e-3)) for name, axis in
            DRIVES.axes.items()}
    result = run_drives(replace(DRIVES, axes=slow), path=gcode.parse("G1 X20 F1000").path)
    assert result.status == "all steps converged"


@pytest.mark.slow
def test_all_loops_of_a_servo_have_finite_gain_margins():
    levels = compute_loops(cases.benchmark_servo())
    assert all(np.isfinite(level.margins().gain_db) for level in (levels.velocity, levels.position))
