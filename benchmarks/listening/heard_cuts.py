"""Random cuts as a microphone hears them: the package's time domain through random rooms, noise, other machines and phones."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass

import numpy as np
from scipy import signal

from toolpoint import ToolpointWarning
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, stability
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.vibration import Dof, Modes, Record

RATE = 44100  # samples a second
SLICES, FIRST, STEPS_MAX = 4, 60, 6_000_000  # slices of a tool; revolutions of the first look; steps until the record begins
DEPTH_MAX = 0.03  # m
BOUNDARY = 0.05  # relative depth: cuts nearer to the limit are not drawn


@dataclass(frozen=True, eq=False)
class HeardCut:
    """A record with its truth: problem, depth (m), spindle frequency (Hz), chatter frequency (Hz, NaN for a stable cut),
    programmed speed (rev/min, None where the listener must search), and which faults the recording has."""

    record: Record
    problem: MillingProblem
    speed: float
    depth: float
    chatters: bool
    chatter_frequency: float
    multiplier: complex
    programmed: float | None
    spindle: float
    faults: tuple[str, ...]


def random_problem(rng: np.random.Generator) -> MillingProblem:
    """Draw machine, tool, run-out, material and arc of cut."""
    count = int(rng.integers(1, 4))
    frequency = np.sort(np.exp(rng.uniform(np.log(150), np.log(2500), count)))
    zeta, stiffness = rng.uniform(0.01, 0.05, count), 1e7 * np.exp(rng.uniform(np.log(0.5), np.log(10), count))
    angle = rng.uniform(0, np.pi, count)
    shape = 2 * np.pi * frequency / np.sqrt(stiffness) * np.stack([np.cos(angle), np.sin(angle)])
    teeth, diameter = int(rng.integers(2, 7)), float(rng.choice([0.008, 0.01, 0.012, 0.016, 0.02, 0.025]))
    tool = Tool(diameter, teeth, helix=np.radians(rng.uniform(0, 45)), runout=1e-6 * np.exp(rng.uniform(0, 3)),
                runout_angle=rng.uniform(0, 2 * np.pi))
    width = np.exp(rng.uniform(np.log(0.08), 0)) * np.pi
    engagement = Engagement(0.0, width) if rng.random() < 0.4 else Engagement(np.pi - width, np.pi)
    kt = rng.uniform(6e8, 2.4e9)
    return MillingProblem(tool, engagement, CuttingCoefficients(kt, kt * rng.uniform(0.15, 0.5)),
                          Modes(frequency, zeta, shape, ("t:+x", "t:+y")), feed_per_tooth=rng.uniform(0.04, 0.15) * 1e-3)


def random_cut(rng: np.random.Generator) -> tuple[Simulation, float, float] | None:
    """Draw a cut not within the boundary's band and run it to its steady state and on; None where no limit is in reach."""
    problem = random_problem(rng)
    speed = float(np.exp(rng.uniform(np.log(1800), np.log(20000))))
    speed = min(speed, 60 * 900 / problem.tool.teeth)
    chart = stability.chart(problem, [speed], depth_max=DEPTH_MAX)
    limit = float(chart.limit[0])
    if not 1e-4 < limit < 0.3 * DEPTH_MAX:
        return None
    chatters = rng.random() < 0.5
    factor = (1 + BOUNDARY) * np.exp(rng.uniform(0, np.log(2.5))) if chatters else (1 - BOUNDARY) * rng.uniform(0.15, 1.0)
    depth = factor * limit
    if bool(chart.stable([depth])[0, 0]) == chatters:
        return None
    seconds = float(rng.uniform(1.5, 4.0))
    method = ExactSteps(slices=SLICES)
    per_turn = method.chosen(problem, speed) * problem.tool.teeth
    turns = int(np.ceil(seconds * speed / 60)) + 1
    if turns * per_turn > STEPS_MAX:
        return None
    cut = RunningCut(problem, speed, depth, method=method, kept=turns * per_turn)
    state, done = "undecided", 0
    while state == "undecided" and done * per_turn < STEPS_MAX:
        cut.advance(max(FIRST, done))
        done = cut.revolutions
        run = cut.result()
        if run.status != "complete":
            return None
        state = run.verdict().state
    if (state == "chatter") != chatters:  # undecided, or a subcritical start: the truth is not the chart's
        return None
    cut.advance(turns)
    run = cut.result()
    return (run, seconds, limit) if run.status == "complete" and run.verdict().state == state else None


def hear(run: Simulation, seconds: float, rng: np.random.Generator) -> HeardCut:
    """Draw room, noise, machines beside it and phone, and return the record."""
    chatters = run.verdict().state == "chatter"
    true_frequency = strongest_chatter_line(run, seconds) if chatters else float("nan")
    sound = _radiate(run, seconds, rng)
    faults: list[str] = []
    course = np.ones(sound.size)
    if rng.random() < 0.4:
        faults.append("drift")
        course = _wander(sound.size, rng)
        sound = np.interp(np.cumsum(course), np.arange(sound.size), sound)
    idle = [int(RATE * rng.uniform(0.2, 0.8)) if rng.random() < 0.7 else 0 for _ in range(2)]
    ramp = max(int(RATE * rng.uniform(0.01, 0.1)), 8)
    envelope = np.minimum(1, np.minimum(np.arange(sound.size), np.arange(sound.size)[::-1]) / ramp)
    padded = np.concatenate([np.zeros(idle[0]), sound * envelope, np.zeros(idle[1])])
    padded = signal.fftconvolve(padded, room(rng))[:padded.size]
    level = float(np.std(padded[idle[0]:padded.size - idle[1]]))
    padded += level * 10 ** (-rng.uniform(0, 30) / 20) * _noise(padded.size, run, rng)
    if rng.random() < 0.6:
        faults.append("machines")
        padded += level * _machines(padded.size, rng)
    if rng.random() < 0.4:
        faults.append("gain control")
        padded = _gain_control(padded, rng)
    padded = 0.5 * padded / np.abs(padded).max()
    if rng.random() < 0.4:
        faults.append("mp3")
        padded = _compressed(padded)
    spindle = run.speed / 60 * float(course.mean())
    programmed = None if rng.random() < 0.25 else 60 * spindle * (1 + rng.uniform(-0.01, 0.01))
    record = Record(padded[:, None], RATE, (Dof("microphone", "+x"),), ("sound",), ("full scale",))
    return HeardCut(record, run.problem, run.speed, run.depth, chatters, true_frequency, 0j, programmed, spindle, tuple(faults))


def strongest_chatter_line(run: Simulation, seconds: float) -> float:
    """Return the frequency of the strongest line of the displacement that is no spindle order, Hz, from whole revolutions; of a
    flip of an even number of teeth, whose lines are spindle orders, the strongest at half a tooth passing."""
    per_turn = run.steps_per_revolution
    turns = min((run.time.size - 1) // per_turn, int(seconds * run.speed / 60))
    part = run.displacement[-turns * per_turn:]
    power = np.sum(np.abs(np.fft.rfft((part - part.mean(0)) * np.hanning(part.shape[0])[:, None], axis=0)) ** 2, axis=1)
    bins = np.arange(power.size)
    distance = np.abs(bins - turns * np.rint(bins / turns))
    half = turns * run.problem.tool.teeth // 2 * np.arange(1, 2 * power.size // max(turns * run.problem.tool.teeth, 1), 2)
    half = half[half < power.size] if run.problem.tool.teeth % 2 == 0 else half[:0]
    rest = np.where(distance <= 3, 0.0, power)
    if half.size and power[half].max() > 10 * rest.max():
        return float(half[int(np.argmax(power[half]))] * run.speed / 60 / turns)
    power = rest
    return float(bins[int(np.argmax(power))] * run.speed / 60 / turns)


def room(rng: np.random.Generator) -> np.ndarray:
    """Return a sparse impulse response: direct sound and echoes that decay over 0.1 to 0.6 s (60 dB)."""
    decay = rng.uniform(0.1, 0.6)
    response = np.zeros(int(0.7 * decay * RATE))
    response[0] = 1
    at = np.unique((rng.random(160) ** 1.5 * response.size).astype(int))
    response[at] += rng.normal(0, 0.35, at.size) * 10 ** (-3 * at / (decay * RATE))
    return response


def _radiate(run: Simulation, seconds: float, rng: np.random.Generator) -> np.ndarray:
    """Return the sound of a run at RATE: velocities of the tool, and a share of the changing force."""
    step = float(run.time[1] - run.time[0])
    mix = rng.normal(0, 1, 2)
    source = np.gradient(run.displacement[:, :2] @ mix, step)
    force = np.gradient(run.force[:, :2] @ rng.normal(0, 1, 2), step)
    source = source / np.std(source) + rng.uniform(0, 0.5) * force / np.std(force)
    decimation = max(int(1 / (step * 2.2 * RATE)), 1)
    corner = min(0.45 * RATE, 0.4 / (step * decimation))
    low_pass = signal.firwin(401, corner * 2 * step)
    smooth = signal.fftconvolve(source - source.mean(), low_pass, mode="same")[::decimation]
    even = np.arange(int(min(seconds, run.time[-1] - run.time[0]) * RATE)) / RATE
    return np.interp(even, np.arange(smooth.size) * step * decimation, smooth)


def _wander(size: int, rng: np.random.Generator) -> np.ndarray:
    """Return a relative speed that drifts and wanders by up to 0.3 %."""
    u = np.linspace(-1, 1, size)
    return 1 + rng.uniform(0, 0.003) * (rng.normal() * u + rng.normal() * u**2 + rng.normal() * 0.3 * np.sin(4 * u)) / 1.5


def _noise(size: int, run: Simulation, rng: np.random.Generator) -> np.ndarray:
    """Return unit noise: white, pink, or that of the machine's own modes shaken at random."""
    white = rng.normal(0, 1, size)
    kind = rng.integers(3)
    if kind == 1:
        spectrum = np.fft.rfft(white)
        white = np.fft.irfft(spectrum / np.sqrt(np.maximum(np.arange(spectrum.size), 20)), size)
    if kind == 2:
        pole = run.problem.plane_at(run.speed).poles
        pole = pole[np.argmin(np.abs(pole))] / RATE
        hump = signal.lfilter([1.0], np.real(np.poly(np.exp([pole, np.conj(pole)]))), white)
        white = white + 2 * hump / np.std(hump)
    return white / np.std(white)


def _machines(size: int, rng: np.random.Generator) -> np.ndarray:
    """Return one to three machines beside it: harmonics of their own, over the level of the cut."""
    time, total = np.arange(size) / RATE, np.zeros(size)
    for _ in range(int(rng.integers(1, 4))):
        base, level = np.exp(rng.uniform(np.log(20), np.log(700))), 10 ** (-rng.uniform(10, 30) / 20)
        for harmonic in range(1, int(rng.integers(2, 8))):
            total += level * rng.uniform(0.2, 1) * np.sin(2 * np.pi * harmonic * base * time + rng.uniform(0, 6.3))
    return total


def _gain_control(samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return samples as a phone levels them: the gain falls in 20 ms and recovers in about a second."""
    block = RATE // 100
    level = np.sqrt(np.add.reduceat(samples**2, np.arange(0, samples.size, block)) / block) + 1e-9
    recovery, follower = np.exp(-0.01 / rng.uniform(0.3, 2.0)), np.empty(level.size)
    state = level[0]
    for k, value in enumerate(level):
        state = 0.6 * state + 0.4 * value if value > state else recovery * state + (1 - recovery) * value
        follower[k] = state
    gain = follower ** -rng.uniform(0.3, 0.9)
    return samples * np.interp(np.arange(samples.size), (np.arange(level.size) + 0.5) * block, gain)


def _compressed(samples: np.ndarray) -> np.ndarray:
    """Return samples after MP3 and back."""
    import soundfile

    store = io.BytesIO()
    soundfile.write(store, samples, RATE, format="MP3")
    store.seek(0)
    return np.asarray(soundfile.read(store, dtype="float64")[0])


def cuts(count: int, seed: int):
    """Yield random heard cuts; each has a seed of its own, so any can be had again."""
    number = given = 0
    warnings.simplefilter("ignore", ToolpointWarning)
    while given < count:
        rng = np.random.default_rng([seed, number])
        number += 1
        drawn = random_cut(rng)
        if drawn is not None:
            given += 1
            yield (number - 1, hear(drawn[0], drawn[1], rng))
