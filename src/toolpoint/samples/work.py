"""Sample of a machine at work: accelerations under random loads, with the line of a motor among the modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import signal

from toolpoint import io
from toolpoint.vibration import Record, SecondOrderSystem, eigen
from toolpoint.vibration.dof import dofs

DOFS = dofs(["column:+x", "saddle:+x", "spindle:+x"])
_WORK_RATE_HZ, _WORK_DURATION_S, SETTLING_SAMPLES, _MOTOR_FREQUENCY_HZ = 80.0, 600.0, 8000, 9.0


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write the record; return what was put in, and the commands."""
    stiffness = 1e6 * np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.2]])
    machine = SecondOrderSystem(np.diag([200.0, 100.0, 150.0]), stiffness, damping=2e-4 * stiffness, outputs=DOFS, inputs=DOFS)
    modes = eigen.solve_undamped(machine)
    rng, samples = np.random.default_rng(1), int(_WORK_DURATION_S * _WORK_RATE_HZ)
    motion = []
    for pole in modes.poles:
        z = np.exp(pole / _WORK_RATE_HZ)
        white = rng.standard_normal(samples + SETTLING_SAMPLES)
        motion.append(signal.lfilter([1, -2, 1], [1, -2 * z.real, abs(z) ** 2], white)[SETTLING_SAMPLES:])
    values = np.array(motion).T @ modes.shape.T
    time = np.arange(samples) / _WORK_RATE_HZ
    values += values.std() * np.cos(2 * np.pi * _MOTOR_FREQUENCY_HZ * time)[:, None] * np.array([1.0, 0.6, -0.8])
    # The loads have no scale, so neither has the record: a signal of 0.1 m/s^2 is written.
    values = np.round(0.1 * values / values.std(), 6)
    io.write_noun(Record(values, _WORK_RATE_HZ, DOFS, ("acceleration",) * len(DOFS)), folder / "work.csv")
    listed = ", ".join(f"{f:.2f} Hz ({100 * z:.1f} %)" for f, z in zip(modes.frequency, modes.damping_ratio, strict=True))
    return [f"Modes at {listed}.", f"A motor adds a line at {_MOTOR_FREQUENCY_HZ:g} Hz, which is no mode."], [
        "toolpoint operational work.csv -m modes.h5"]
