"""Blows judged while they come, each kept on disk first (as `toolpoint tap --live`); a player stands in for the device."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint import io, studies

RATE = 10_000  # Hz


def blows(forces: tuple[float, ...]) -> np.ndarray:
    """Return volts of hammer and accelerometer: blows (N) 0.8 s apart on a tip of 0.5 kg at 300 Hz, 3 % damping."""
    force = np.zeros(round((1.2 + 0.8 * len(forces)) * RATE))
    for k, peak in enumerate(forces):
        place = round((0.8 + 0.8 * k) * RATE)
        force[place:place + 10] = peak * np.sin(np.pi * np.arange(10) / 10)
    time, w = np.arange(RATE // 2) / RATE, 2 * np.pi * 300.0
    motion = np.convolve(force, np.exp(-0.03 * w * time) * np.sin(w * time) / (0.5 * w))[:force.size] / RATE
    volts = np.column_stack([2.25e-3 * force, 1e-3 * np.gradient(np.gradient(motion)) * RATE**2])
    return volts + 1e-5 * np.random.default_rng(0).standard_normal(volts.shape)


def main() -> int:
    """Return the number of good blows that the folder holds; one of five is weak."""
    with tempfile.TemporaryDirectory() as folder:
        np.savez(f"{folder}/played.npz", samples=blows((200.0, 180.0, 15.0, 190.0, 210.0)), fs=RATE)
        channels = ["1=force tip:+x 2.25mV/N", "2=acceleration tip:+x 1mV/(m/s^2)"]
        live: io.LiveInput = io.open_input(f"play:{folder}/played.npz@max", channels)
        store = io.BlowFolder(Path(folder) / "x", live, 0.4)
        tap = studies.LiveTap(live.inputs, live.device.rate, duration=0.4, goal=4, kept=store.kept)
        for event in studies.follow_blows(live.device, tap, store):
            if isinstance(event, studies.BlowVerdict):
                print(event.words)
        records, test = io.read_hammer_test(store.test_file)
        return studies.study_hammer_records(records, duration=test.block).used


if __name__ == "__main__":
    main()
