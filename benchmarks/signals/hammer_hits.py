"""Virtual hammer tests, one hit a file, with bad hits mixed in: which are refused, for which reason, and whether the intervals
of the responses hold.

A free plate-like structure with close modes is struck by a person who misses the spot by some millimetres and tilts the hammer
by some degrees; a quarter of the hits are bad: double, weak, overloaded, at another spot, in another direction. Every test is
judged as `toolpoint frf` does, and its responses are compared with those of the structure struck exactly at its spot.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import Dof, Modes, Record
from toolpoint.signals import hammer_test
from toolpoint.vibration.frequency_response import modal
from toolpoint.vibration.simulation.time_response import modal_superposition

RATE, DURATION, NOISE = 4096.0, 1.0, 0.002
FREQUENCY = np.array([88.0, 141.0, 156.0, 243.0, 310.0, 402.0, 470.0, 615.0, 730.0, 905.0])
RATIO = np.array([0.020, 0.015, 0.017, 0.012, 0.010, 0.014, 0.010, 0.012, 0.010, 0.011])
KINDS = {"double": ("double hit",), "weak": ("weak hit",), "overload": ("overload",),
         "spot": ("another spot",), "direction": ("direction",)}
SENSORS = ((0.11, 0.07, 0), (0.83, 0.61, 0), (0.42, 0.33, 2), (0.93, 0.12, 1))  # place (m), direction
GOOD = 9


def shapes(rng: np.random.Generator):
    """Return a function from place (m) to the shapes there, (3, modes): smooth waves over a plate of 1 m by 0.7 m."""
    wave = np.array([(i % 3 + 1, i // 3 % 3) for i in range(FREQUENCY.size)])
    phase, size = rng.uniform(0, np.pi, (FREQUENCY.size, 2)), rng.normal(0, 1, (3, FREQUENCY.size)) * [[0.3], [0.3], [1.0]]

    def at(place: np.ndarray) -> np.ndarray:
        return 0.1 * size * np.cos(np.pi * wave[:, 0] * place[0] + phase[:, 0]) * np.cos(
            np.pi * wave[:, 1] * place[1] / 0.7 + phase[:, 1])
    return at


def record(at, place: np.ndarray, way: np.ndarray, rng: np.random.Generator, *, size: float, bounce: tuple[float, float] | None,
           clip: float | None, labels: tuple[Dof, ...]) -> Record:
    """Return the record of one hit: the force along the hammer, velocities."""
    n = int(RATE * DURATION * 1.1)
    time = np.arange(n) / RATE
    contact = rng.uniform(0.7, 1.1) * 2.2e-3
    start = rng.uniform(0.02, 0.05)
    force = size * _pulse((time - start) / contact)
    if bounce is not None:
        force += size * bounce[1] * _pulse((time - start - bounce[0] * contact) / contact)
    struck = at(place).T @ way
    rows = np.array([at(np.array(sensor[:2]))[sensor[2]] for sensor in SENSORS])
    modes = Modes(FREQUENCY, RATIO, np.vstack([rows, struck]), (*labels, Dof("hammer", "+x")))
    motion = modal_superposition(modes, Record(force[:, None], RATE, ["hammer:+x"], "force"), labels, kind="velocity").samples
    samples = np.column_stack([force, motion])
    samples += NOISE * np.abs(samples).max(axis=0) * rng.standard_normal(samples.shape)
    if clip is not None:
        channel = rng.integers(samples.shape[1])
        size = np.sort(np.abs(samples[:, channel]))
        top = min(clip * size[-1], size[-3])  # three samples at full scale, or more
        samples[:, channel] = np.clip(samples[:, channel], -top, top)
    return Record(samples, RATE, (Dof("5", "+z"), *labels), ("force", *["velocity"] * len(labels)))


def _pulse(phase: np.ndarray) -> np.ndarray:
    return np.where((phase > 0) & (phase < 1), np.sin(np.pi * np.clip(phase, 0, 1)) ** 1.5, 0.0)


def one_hit(kind: str, at, spot: np.ndarray, rng: np.random.Generator, labels: tuple[Dof, ...]) -> Record:
    """Return a hit of a kind: good, or one of KINDS."""
    place = spot + rng.normal(0, 0.0015, 2)
    way = np.array([*rng.normal(0, 0.02, 2), 1.0])
    size, bounce, clip = rng.uniform(70, 140), None, None
    if kind == "double":
        bounce = rng.uniform(1.6, 12), rng.uniform(0.12, 0.7)
    elif kind == "weak":
        size *= rng.uniform(0.03, 0.12)
    elif kind == "overload":
        clip = rng.uniform(0.4, 0.9)
    elif kind == "spot":
        angle, far = rng.uniform(0, 2 * np.pi), rng.uniform(0.08, 0.2)
        place = spot + far * np.array([np.cos(angle), np.sin(angle)])
    elif kind == "direction":
        way = np.array([[0, 0, -1], [1, 0, 0], [0, 1, 0]][rng.integers(3)], float) + rng.normal(0, 0.02, 3)
    return record(at, place, way / np.linalg.norm(way), rng, size=size, bounce=bounce, clip=clip, labels=labels)


def run(seed: int) -> tuple[Counter, list[float]]:
    """Return counts of verdicts, and the shares of responses whose 95 % circle holds the truth, of one test."""
    rng = np.random.default_rng(seed)
    at, spot = shapes(rng), rng.uniform([0.25, 0.2], [0.75, 0.5])
    labels = tuple(Dof(i + 1, "+xyz"[0] + "xyz"[way]) for i, (_, _, way) in enumerate(SENSORS))
    kinds = ["good"] * GOOD + [str(kind) for kind in rng.choice(list(KINDS), 3)]
    rng.shuffle(kinds)
    records = [one_hit(kind, at, spot, rng, labels) for kind in kinds]
    test = hammer_test(records, final=None, highest=1000.0)
    counts: Counter = Counter()
    for kind, hit in zip(kinds, test.hits, strict=True):
        words = "; ".join(hit.reasons)
        if kind == "good":
            counts["good refused" if hit.reasons else "good used"] += 1
            continue
        state = "missed" if not hit.reasons else "right" if any(word in words for word in KINDS[kind]) else "other reason"
        counts[f"{kind} {state}"] += 1
    return counts, [held(test, at, spot, labels)]


def held(test, at, spot: np.ndarray, labels: tuple[Dof, ...]) -> float:
    """Return the share of lines up to 950 Hz, or to where the force is 20 dB down, whose 95 % circle holds the truth."""
    rows = np.array([at(np.array(sensor[:2]))[sensor[2]] for sensor in SENSORS])
    modes = Modes(FREQUENCY, RATIO, np.vstack([rows, at(spot)[2]]), (*labels, Dof("hammer", "+x")))
    s = (test.frf.frequency > 60) & (test.frf.frequency < min(950, test.excited))
    if test.frf.decay:
        p = 2j * np.pi * test.frf.frequency[s] + test.frf.decay
        w, z = modes.omega, modes.damping_ratio
        terms = p[:, None] / (p[:, None] ** 2 + 2 * z * w * p[:, None] + w**2)
        true = np.einsum("fr,or,r->fo", terms, rows, at(spot)[2])
    else:
        true = modal(modes, test.frf.frequency[s], labels, inputs=["hammer:+x"], quantity="mobility").values[:, :, 0]
    sampled = np.sinc(test.frf.frequency[s] / RATE)[:, None] ** 2  # forces are linear between samples
    return float((np.abs(test.frf.values[s, :, 0] - true * sampled) <= test.radius()[s, :, 0]).mean())


def main() -> None:
    """Run tests until so many hits were judged."""
    parser = CommandLine(__doc__)
    parser.cases("hits", 2000)
    parser.seed(0, "first-seed")
    options = parser.parse_args()
    hits = options.hits
    warnings.simplefilter("ignore")
    counts: Counter = Counter()
    shares: list[float] = []
    seed = options.first_seed
    while counts.total() < hits:
        more, part = run(seed)
        counts += more
        shares += part
        seed += 1
    for name, number in sorted(counts.items()):
        print(f"{name:24s} {number}")
    bad = sum(number for name, number in counts.items() if not name.startswith("good"))
    right = sum(number for name, number in counts.items() if name.endswith(" right"))
    refused = bad - sum(number for name, number in counts.items() if name.endswith("missed"))
    good = counts["good used"] + counts["good refused"]
    print(f"{counts.total()} hits in {seed - options.first_seed} tests: {100 * refused / bad:.2f} % of {bad} bad hits refused, "
          f"{100 * right / bad:.2f} % with the right reason; {100 * counts['good refused'] / good:.2f} % of {good} good ones "
          f"refused; 95 % intervals hold {100 * np.mean(shares):.1f} % (tests {100 * np.quantile(shares, 0.05):.0f} .. "
          f"{100 * np.quantile(shares, 0.95):.0f} %)")


if __name__ == "__main__":
    main()
