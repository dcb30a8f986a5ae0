"""Streams of blows in volts, and inputs for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint.acquisition import InputChannel, InputChannels
from toolpoint.vibration import Dof

RATE, HAMMER, SENSOR = 5000.0, 2.25 * 1e-3, 1.02 * 1e-3  # Hz, V/N, V/(m/s^2): as their texts are read
DESCRIBED = ["1=force tip:+x 2.25mV/N", "2=acceleration tip:+x 1.02mV/(m/s^2)"]
WIDTH = 10  # samples of a pulse


def inputs(limit: float | None = 10.0) -> InputChannels:
    dof = Dof("tip", "+x")
    return InputChannels((InputChannel(0, "force", dof, 1 / HAMMER, limit=limit),
                          InputChannel(1, "acceleration", dof, 1 / SENSOR, limit=limit)))


def stream(forces: tuple[float, ...], *, apart: float = 0.8, doubles: tuple[int, ...] = (), noise: float = 1e-5, seed: int = 0,
           lead: float = 0.8) -> np.ndarray:
    """Return volts (n, 2) of blows of these forces (N), `apart` seconds one from the other, on a tip of one mode at 300 Hz."""
    rng, count = np.random.default_rng(seed), round((lead + apart * len(forces) + 0.3) * RATE)
    force, pulse = np.zeros(count), np.sin(np.pi * np.arange(WIDTH) / WIDTH)
    for k, peak in enumerate(forces):
        place = round((lead + apart * k) * RATE)
        force[place:place + WIDTH] += peak * pulse
        if k in doubles:
            force[place + 150:place + 150 + WIDTH] += 0.5 * peak * pulse
    time = np.arange(round(0.5 * RATE)) / RATE
    w, damping = 2 * np.pi * 300.0, 0.03
    ring = np.exp(-damping * w * time) * np.sin(w * time) / (0.5 * w)
    motion = np.convolve(force, ring)[:count] / RATE
    volts = np.column_stack([HAMMER * force, SENSOR * np.gradient(np.gradient(motion)) * RATE**2])
    return volts + noise * rng.standard_normal(volts.shape)


def write_records(folder: Path, forces: tuple[float, ...]) -> None:
    """Write blows as a measuring program does: one a file (CSV, V), renamed when it is whole."""
    volts = stream(forces)
    folder.mkdir(exist_ok=True)
    for number in range(len(forces)):
        start = round((0.6 + 0.8 * number) * RATE)
        lines = [f"{k / RATE:.8g},{a:.8g},{b:.8g}" for k, (a, b) in enumerate(volts[start:start + round(0.8 * RATE)])]
        draft = folder / f".{number}.part"
        draft.write_text("\n".join(["Time (s),Force (V),Acceleration (V)", *lines]) + "\n")
        draft.rename(folder / f"blow_{number}.csv")
