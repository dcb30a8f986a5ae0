"""Live acquisition over a real PortAudio path: a PulseAudio null sink whose monitor is recorded while a record is played.

    python benchmarks/acquisition/live_audio.py --minutes 10     # counted samples, 48 kHz, two channels: which of them are lost
    python benchmarks/acquisition/live_audio.py --blows 30       # from the end of a blow's record to its verdict

Every sample that is played carries its number (the first channel its low 12 bits, the second the next 12), so a sample that is
lost, doubled or changed shows itself. Needs the system's pulseaudio, pulseaudio-utils, libportaudio2 and libasound2-plugins;
without them the last line says so.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine

RATE, LOW_BITS = 48_000, 12
NEEDED = ("pulseaudio", "pacat", "pactl")


@contextmanager
def null_sink() -> Iterator[None]:
    """Run a PulseAudio server of its own with one null sink, whose monitor is the default input."""
    if lacking := [name for name in NEEDED if shutil.which(name) is None]:
        sys.exit(f"not measured: {', '.join(lacking)} is not installed")
    with tempfile.TemporaryDirectory(prefix="toolpoint-pulse-") as folder:
        os.chmod(folder, 0o700)
        os.environ.update(XDG_RUNTIME_DIR=folder, PULSE_SINK="toolpoint", PULSE_SOURCE="toolpoint.monitor",
                          PULSE_SERVER=f"unix:{folder}/pulse/native")
        server = subprocess.Popen(
            ["pulseaudio", "--daemonize=no", "--exit-idle-time=-1", "-n", "-L", "module-native-protocol-unix", "-L",
             f"module-null-sink sink_name=toolpoint rate={RATE} channels=2 format=float32le"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=_raise_priority)
        try:
            for _ in range(100):
                if subprocess.run(["pactl", "info"], capture_output=True).returncode == 0:
                    break
                time.sleep(0.1)
            yield
        finally:
            server.terminate()
            server.wait()


def _raise_priority() -> None:
    """Let the virtual sound card, and what plays into it, run ahead of other work where that is allowed: a real card needs no
    processor to sample."""
    with suppress(OSError, AttributeError):
        os.nice(-15)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))


@contextmanager
def player(samples: np.ndarray) -> Iterator[subprocess.Popen[bytes]]:
    """Play samples (n, 2) into the sink from a process of its own."""
    with tempfile.NamedTemporaryFile(suffix=".raw") as file:
        samples.astype("<f4").tofile(file)
        file.flush()
        command = ["pacat", "--playback", "--raw", f"--rate={RATE}", "--channels=2", "--format=float32le",
                   "--latency-msec=1500", file.name]
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL, preexec_fn=_raise_priority)
        try:
            yield process
        finally:
            process.terminate()
            process.wait()


@contextmanager
def control_recorder() -> Iterator[Path]:
    """Record the same monitor by the server's own program, to tell losses of the server from losses here."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "control.raw"
        with path.open("wb") as file:
            process = subprocess.Popen(["parec", "--raw", f"--rate={RATE}", "--channels=2", "--format=float32le",
                                        "--latency-msec=500", "--device=toolpoint.monitor"], stdout=file)
            try:
                yield path
            finally:
                process.terminate()
                process.wait()


def numbered(count: int) -> np.ndarray:
    """Return samples that carry their number, from 1 on, as shares of the full scale."""
    number = np.arange(1, count + 1)
    return np.column_stack([number % 2**LOW_BITS, number >> LOW_BITS]) / 2.0**LOW_BITS


def count_losses(samples: np.ndarray) -> tuple[int, int, int]:
    """Return how many numbered samples came, how many between the first and the last are missing, and how many are none."""
    integers = np.rint(samples * 2.0**LOW_BITS)
    is_changed = np.any(np.abs(samples * 2.0**LOW_BITS - integers) > 1e-3, axis=1)
    number = integers[:, 0].astype(int) + (integers[:, 1].astype(int) << LOW_BITS)
    number = number[~is_changed]
    number = number[number > 0]  # the silence of a player that starves or has not begun carries 0
    steps = np.diff(number)
    return number.size, int(np.maximum(steps - 1, 0).sum()), int(is_changed.sum() + (steps < 1).sum())


def measure_losses(minutes: float) -> None:
    """Record numbered samples and print what was lost."""
    from toolpoint.io import open_microphone

    with null_sink(), player(numbered(round((minutes * 60 + 5) * RATE))), control_recorder() as control:
        device = open_microphone("sound:pulse", RATE, 2)
        device.open()
        parts, flags, by_clock, begun = [], 0, 0, time.monotonic()
        while time.monotonic() - begun < minutes * 60:
            block = device.read(1.0)
            if block is not None:
                parts.append(block.samples.astype("f4"))
                flags += block.has_overflow
                by_clock += block.lost_count
        device.close()
        control_samples = np.fromfile(control, "<f4")
    came, lost, wrong = count_losses(np.concatenate(parts))
    of_control = count_losses(control_samples[:control_samples.size // 2 * 2].reshape(-1, 2))
    print(f"{came} samples at {RATE} Hz in {minutes:g} min: {lost} lost, {wrong} changed or doubled; the driver flagged "
          f"{flags}, the clock {by_clock}; the server's own recorder beside it lost {of_control[1]}")


def tap_signal(blows: int, seed: int = 0) -> np.ndarray:
    """Return volts (n, 2), shares of a full scale of 1 V, of blows every 2.5 s: force cell and accelerometer."""
    from scipy.signal import fftconvolve

    rng = np.random.default_rng(seed)
    count, time_axis = round((2.5 * blows + 3) * RATE), np.arange(RATE) / RATE
    force, width = np.zeros(count), 24
    for k in range(blows):
        place = round((2 + 2.5 * k) * RATE)
        force[place:place + width] += rng.uniform(0.7, 1.0) * np.sin(np.pi * np.arange(width) / width)
    ring = sum(size * np.exp(-damping * 2 * np.pi * f * time_axis) * np.sin(2 * np.pi * f * time_axis)
               for f, damping, size in ((800, 0.02, 1.0), (1500, 0.03, 2.0)))
    answer = np.gradient(np.gradient(fftconvolve(force, ring)[:count]))
    volts = np.column_stack([0.6 * force, 0.4 * answer / np.abs(answer).max()])
    return volts + 1e-4 * rng.standard_normal(volts.shape)


def measure_verdicts(blows: int) -> None:
    """Strike over the sink, and print how long verdicts take and how many blows are taken and good."""
    from toolpoint.io import BlowFolder, open_input
    from toolpoint.studies import BlowVerdict, LiveTap, follow_blows

    verdicts = []
    with null_sink(), tempfile.TemporaryDirectory() as folder, player(tap_signal(blows)):
        live = open_input("sound:pulse", ["1=force tip:+x 2.25mV/N 1V", "2=acceleration tip:+x 10mV/g 1V"], RATE)
        store = BlowFolder(Path(folder) / "blows", live, 1.0)
        tap = LiveTap(live.inputs, live.device.rate, duration=1.0, goal=blows)
        for event in follow_blows(live.device, tap, store, patience=6.0):
            if isinstance(event, BlowVerdict):
                verdicts.append(event)
        kept, aside = (len(list(folder.glob("blow_*.npz"))) for folder in (store.folder, store.folder / "set_aside"))
    delays = sorted(verdict.delay for verdict in verdicts)
    print(f"{len(verdicts)} of {blows} blows taken, {sum(v.accepted for v in verdicts)} good, {kept} on disk, "
          f"{aside} set aside; verdict after the last sample: median {1e3 * delays[len(delays) // 2]:.0f} ms, longest "
          f"{1e3 * delays[-1]:.0f} ms, {sum(delay <= 0.3 for delay in delays)} within 0.3 s")


def main() -> None:
    """Measure what is asked for."""
    parser = CommandLine(__doc__)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.cases("blows", 0)
    arguments = parser.parse_args()
    if arguments.blows:
        measure_verdicts(arguments.blows)
    if arguments.minutes or not arguments.blows:
        measure_losses(arguments.minutes or 1.0)


if __name__ == "__main__":
    main()
