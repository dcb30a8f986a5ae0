"""Sample of a recorded cut: the sound of a slot that chatters, with a pump and noise beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import wavfile

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.simulation.milling import ExactSteps, simulate
from toolpoint.vibration import Modes
from toolpoint.vibration.dof import dofs

_MODE_FREQUENCY_HZ, _MODE_STIFFNESS, _MODE_DAMPING_RATIO = 900.0, 2e7, 0.03
_SPINDLE_SPEED_RPM, _CUT_DEPTH_RATIO, _PUMP_FREQUENCY_HZ, _SOUND_RATE_HZ = 7300.0, 1.5, 310.0, 44_100
_REVOLUTION_COUNT = 330


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the sound; return what was put in, and the commands."""
    shape = 2 * np.pi * _MODE_FREQUENCY_HZ / np.sqrt(_MODE_STIFFNESS) * np.eye(2)
    modes = Modes(np.full(2, _MODE_FREQUENCY_HZ), np.full(2, _MODE_DAMPING_RATIO), shape, dofs(["tool:+x", "tool:+y"]))
    problem = MillingProblem(Tool(0.012, 4, runout=5e-6), Engagement.slot(), CuttingCoefficients(8e8, 2.4e8), modes,
                             feed_per_tooth=1e-4)
    limit = float(stability.chart(problem, np.array([_SPINDLE_SPEED_RPM])).limit[0])
    run = simulate(problem, _SPINDLE_SPEED_RPM, _CUT_DEPTH_RATIO * limit, revolutions=_REVOLUTION_COUNT,
                   method=ExactSteps(slices=1))
    rng, time = np.random.default_rng(1), np.arange(0.0, run.time[-1], 1 / _SOUND_RATE_HZ)
    # A microphone hears the velocity of what vibrates.
    sound = np.interp(time, run.time, np.gradient(run.displacement[:, 0], run.time))
    sound += 0.3 * np.std(sound) * (rng.normal(size=time.size) + np.sin(2 * np.pi * _PUMP_FREQUENCY_HZ * time))
    wavfile.write(folder / "cut.wav", _SOUND_RATE_HZ, (0.5 * sound / np.abs(sound).max() * 32767).astype(np.int16))
    truth = [f"A slot with four teeth of 12 mm at {_SPINDLE_SPEED_RPM:g} rev/min, {_CUT_DEPTH_RATIO:g} times as deep as its "
             f"limit of "
             f"{1e3 * limit:.2f} mm: it chatters.",
             f"The tool has a mode at {_MODE_FREQUENCY_HZ:g} Hz in x and y; a pump runs at {_PUMP_FREQUENCY_HZ:g} Hz; run-out "
             f"is 5 um."]
    return truth, ["toolpoint listen cut.wav --teeth 4 --speed 7300 --highest 16000"]
