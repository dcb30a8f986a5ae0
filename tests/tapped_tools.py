"""Random tool tips struck by a hammer, as the files of a shop hold it: volts of force cell and accelerometer, the truth known.

Made in closed form over frequency (pulse, response, filter of the front end) and transformed to time, apart from the package's
virtual test: periods so long that nothing wraps round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft
import scipy.io.wavfile

from toolpoint.vibration import Modes

GRAVITY, TAIL, RANGE = 9.80665, 3.0, 5.0
WAYS = np.eye(2)


@dataclass(frozen=True, eq=False)
class Tip:
    """Modes of a tip in the plane: frequency (Hz), damping ratio, modal stiffness (N/m) along the direction `way` (n, 2)."""

    frequency: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    way: np.ndarray

    def receptance(self, frequency: np.ndarray, decay: float = 0.0) -> np.ndarray:
        """Return H (n_f, 2, 2), m/N, at i w + decay."""
        s = (2j * np.pi * np.asarray(frequency, float) + decay)[:, None]
        w = 2 * np.pi * self.frequency
        shares = w**2 / self.stiffness / (s**2 + 2 * self.damping * w * s + w**2)
        return np.einsum("fm,mi,mj->fij", shares, self.way, self.way)

    @property
    def modes(self) -> Modes:
        """The same as a noun of the package."""
        shape = (self.way * (2 * np.pi * self.frequency / np.sqrt(self.stiffness))[:, None]).T
        order = np.argsort(self.frequency)
        return Modes(self.frequency[order], self.damping[order], shape[:, order], ("tip:+x", "tip:+y"))

    def seen(self, axis: int, top: float) -> list[int]:
        """Return the modes that take part along an axis below a frequency."""
        return [i for i in range(self.frequency.size) if abs(self.way[i, axis]) > 1e-3 and self.frequency[i] < top]


@dataclass(frozen=True)
class Blows:
    """How a tip was struck and recorded; noise as share of a channel's peak, `tilt` (rad) and `place` from blow to blow."""

    rate: float
    length: float
    count: int
    contact: float
    pulse: str = "half sine"
    force: float = 200.0
    noise: tuple[float, float] = (5e-4, 5e-4)
    bits: int = 24
    offset: tuple[float, float] = (0.0, 0.0)
    tilt: float = 0.02
    place: float = 0.01
    apart: bool = True
    kind: str = "npz"
    hammer: float = 2.25e-3
    sensor: float = 10e-3 / GRAVITY


@dataclass(frozen=True, eq=False)
class Tap:
    """A tap test: tip, how it was struck, the cut with what is said of it and the coefficients it really has."""

    tip: Tip
    blows: Blows
    cut: dict[str, Any]
    speeds: tuple[float, float]
    true_coefficients: tuple[float, float]
    seed: int = 0
    both: bool = True
    spoil: dict[str, Any] = field(default_factory=dict)


def random_tap(seed: int, *, coupled: float = 0.3) -> Tap:
    """Return a tap test that a careful person could have made of a random tip."""
    rng = np.random.default_rng([seed, 7])
    tip, top = random_tip(rng, coupled)
    contact = min(rng.uniform(0.5, 0.95) * 1.35 / (1.3 * top), 5e-4)
    rates = [rate for rate in (10e3, 12.8e3, 20e3, 25.6e3, 51.2e3) if rate > 2.56 * 1.3 * top]
    apart = bool(rng.random() < 0.5)
    blows = Blows(float(rng.choice(rates)), float(np.exp(rng.uniform(np.log(0.2 if apart else 0.8), np.log(2.0)))),
                  int(rng.integers(3, 11)), contact, str(rng.choice(["half sine", "sine squared", "double exponential"])),
                  float(rng.uniform(80, 500)), (float(10 ** rng.uniform(-5, -3)), float(10 ** rng.uniform(-5, -3.3))),
                  int(rng.choice([16, 24])), tuple(rng.normal(0, 0.002, 2)), 0.02, 0.01, apart,
                  str(rng.choice(["npz", "wav", "csv"])) if apart else "npz")
    return Tap(tip, blows, *random_cut(rng), seed)


def random_tip(rng: np.random.Generator, coupled: float) -> tuple[Tip, float]:
    """Return a random tip and the highest frequency of its modes, less that of the mode far above."""
    rows, top = [], 0.0
    turned = rng.random() < coupled
    for axis in (0, 1):
        for f in np.exp(rng.uniform(np.log(200), np.log(5000), rng.integers(1, 7))):
            angle = axis * np.pi / 2 + (rng.normal(0, 0.25) if turned else 0.0)
            rows.append((f, np.exp(rng.uniform(np.log(0.005), np.log(0.08))), np.exp(rng.uniform(np.log(5e6), np.log(1e8))),
                         np.cos(angle) * (axis == 0 or turned), np.sin(angle) * (axis == 1 or turned)))
            top = max(top, f)
        if rng.random() < 0.5:
            rows.append((max(rng.uniform(8e3, 15e3), 2 * top), 0.03, rng.uniform(5e7, 5e8), *WAYS[axis]))
    table = np.array(rows)
    return Tip(table[:, 0], table[:, 1], table[:, 2], table[:, 3:]), float(top)


def random_cut(rng: np.random.Generator) -> tuple[dict[str, Any], tuple[float, float], tuple[float, float]]:
    """Return what is said of a random cut, the speeds of its machine, and the coefficients that it really has: each known to
    10 %, as the package takes it to be."""
    kt = rng.uniform(6e8, 2.5e9)
    cut: dict[str, Any] = {"diameter": rng.uniform(0.006, 0.025), "teeth": int(rng.integers(2, 7)), "tangential": kt,
                           "normal": kt * rng.uniform(0.2, 0.5), "direction": str(rng.choice(["up", "down", "slot"]))}
    if cut["direction"] != "slot":
        cut["immersion"] = float(rng.uniform(0.1, 1.0))
    if rng.random() < 0.3:
        cut["helix"] = float(np.radians(rng.uniform(20, 45)))
    fastest = rng.uniform(8000, 24000)
    true = (kt * np.exp(0.1 * rng.standard_normal()), cut["normal"] * np.exp(0.1 * rng.standard_normal()))
    return cut, (float(fastest * rng.uniform(0.25, 0.4)), float(fastest)), true


def pulse_spectrum(blows: Blows, frequency: np.ndarray) -> np.ndarray:
    """Return the spectrum of a pulse of peak 1, N s, in closed form."""
    t, w = blows.contact, 2 * np.pi * frequency + 1e-9
    if blows.pulse == "half sine":
        p = np.pi / t
        near = np.where(np.abs(w - p) < 1e-6 * p, w * (1 + 1e-5), w)
        return p * (1 + np.exp(-1j * near * t)) / (p**2 - near**2)
    if blows.pulse == "sine squared":
        def box(w: np.ndarray) -> np.ndarray:
            safe = np.where(np.abs(w) < 1e-6, 1e-6, w)
            return (1 - np.exp(-1j * safe * t)) / (1j * safe)

        p = 2 * np.pi / t
        return box(w) / 2 - (box(w - p) + box(w + p)) / 4
    a, b = 4.0 / t, 9.0 / t
    peak = np.log(b / a) / (b - a)
    return (1 / (a + 1j * w) - 1 / (b + 1j * w)) / (np.exp(-a * peak) - np.exp(-b * peak))


def strike(tap: Tap, axis: int, rng: np.random.Generator, *, weigh: Callable[[int], float] = lambda k: 1.0) -> list[np.ndarray]:
    """Return the voltages (n, 2) of every file of the blows along an axis (0: x, 1: y): force cell, accelerometer."""
    b, spoil = tap.blows, tap.spoil
    length = round(b.length * b.rate)
    starts = [round(rng.uniform(0.02, 0.05) * length) + (0 if b.apart else k * length + round(0.1 * b.rate))
              for k in range(b.count)]
    samples = length if b.apart else b.count * length + round(0.15 * b.rate)
    n = scipy.fft.next_fast_len(samples + round(TAIL * b.rate), real=True)
    f = np.fft.rfftfreq(n, 1 / b.rate)
    filtered = np.cos(np.pi / 2 * np.clip((f / b.rate - 0.4) / 0.1, 0, 1)) ** 2
    tip = spoil.get("tip", tap.tip)
    point = tip.receptance(f) * (-((2 * np.pi * f) ** 2))[:, None, None]
    parts = []
    for k, start in enumerate(starts):
        angle = axis * np.pi / 2 + b.tilt * rng.standard_normal() + spoil.get("misaligned", 0.0)
        peak = b.force * np.exp(0.2 * rng.standard_normal())
        blow = b.rate * pulse_spectrum(b, f) * filtered * peak * np.exp(-2j * np.pi * f * start / b.rate)
        if "bounce" in spoil and (spoil["bounce"] == "all" or k % 3 == 0):
            blow = blow * (1 + 0.4 * np.exp(-2j * np.pi * f * rng.uniform(4, 12) * b.contact))
        arm = 1 + b.place * rng.standard_normal()
        answer = (point[:, axis] @ np.array([np.cos(angle), np.sin(angle)])) * blow * arm
        parts.append(np.stack([scipy.fft.irfft(blow, n)[:samples], scipy.fft.irfft(answer, n)[:samples]], axis=1))
    files = parts if b.apart else [np.sum(parts, axis=0)]
    top = np.max([np.abs(part).max(axis=0) for part in files], axis=0)
    return [_measured(part, top, tap, rng) for part in files]


def _measured(si: np.ndarray, top: np.ndarray, tap: Tap, rng: np.random.Generator) -> np.ndarray:
    """Return the volts of a front end whose range fits the largest blow of all."""
    b, spoil = tap.blows, tap.spoil
    noisy = si + top * np.array(b.noise) * rng.standard_normal(si.shape)
    if "change" in spoil:
        noisy = spoil["change"](noisy, top, b, rng)
    volts = noisy * np.array([b.hammer, b.sensor]) + np.array(b.offset)
    full = 1.25 * np.abs(volts).max() if "full" not in spoil else spoil["full"](volts)
    step = full / 2 ** (b.bits - 1)
    return np.clip(np.round(volts / step) * step, -full, full)


def write(files: list[np.ndarray], folder: Path, name: str, blows: Blows) -> list[Path]:
    """Write records as files of a shop: NumPy, WAV or CSV, volts; return their paths."""
    paths = []
    for k, volts in enumerate(files):
        path = folder / f"{name}_{k + 1}.{blows.kind}"
        if blows.kind == "npz":
            np.savez(path, fs=blows.rate, samples=volts, channels=np.array(["hammer", "sensor"]))
        elif blows.kind == "wav":
            full = RANGE * np.ceil(np.abs(volts).max() / RANGE)
            scipy.io.wavfile.write(path, round(blows.rate), np.round(volts / full * (2**31 - 1)).astype(np.int32))
        else:
            time = np.arange(len(volts)) / blows.rate
            np.savetxt(path, np.column_stack([time, volts]), delimiter=",", header="time [s],hammer [V],sensor [V]",
                       comments="", fmt="%.9g")
        paths.append(path)
    return paths


def channels_of(tap: Tap, axis: int, files: list[np.ndarray]) -> list[str]:
    """Return what a person says of the channels."""
    way, b, spoil = "xy"[axis], tap.blows, tap.spoil
    wav = f" {RANGE * np.ceil(max(np.abs(v).max() for v in files) / RANGE):g}V" if b.kind == "wav" else ""
    hammer = spoil.get("said_hammer", f"{1e3 * b.hammer:.6g}mV/N")
    sensor = spoil.get("said_sensor", f"{1e3 * b.sensor * GRAVITY:.6g}mV/g")
    first, second = ("2", "1") if spoil.get("exchanged") else ("1", "2")
    return [f"{first}=force tip:+{way} {hammer}{wav}",
            f"{second}={spoil.get('motion', 'acceleration')} tip:+{way} {sensor}{wav}"]


def spoiled(tap: Tap, **spoil: Any) -> Tap:
    """Return the same tap with a slip; keys that `Blows` has change it."""
    of_blows = {key: spoil.pop(key) for key in list(spoil) if key in Blows.__dataclass_fields__}
    both = spoil.pop("both", tap.both)
    return replace(tap, blows=replace(tap.blows, **of_blows), both=both, spoil={**tap.spoil, **spoil})


def _clipped(channel: int, share: float) -> Callable[..., np.ndarray]:
    def change(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
        limit = np.full(2, np.inf)
        limit[channel] = share * top[channel]
        return np.clip(signals, -limit, limit)

    return change


def _windowed(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
    """The analyser's exponential window, down to a hundredth, on both channels of every record."""
    return signals * (0.01 ** (np.arange(len(signals)) / len(signals)))[:, None]


def _drifting(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
    return signals + 0.02 * top * np.linspace(0, 1, len(signals))[:, None]


def _humming(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
    phase = rng.uniform(0, 2 * np.pi)
    return signals + 0.02 * top * np.sin(2 * np.pi * 50 * np.arange(len(signals)) / blows.rate + phase)[:, None]


def _mute(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
    noise = 1e-3 * top[1] * rng.standard_normal(len(signals))
    return np.stack([signals[:, 0], noise], axis=1)


def _late(signals: np.ndarray, top: np.ndarray, blows: Blows, rng: np.random.Generator) -> np.ndarray:
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(len(signals), 1 / blows.rate) * 1e-4)
    return np.stack([signals[:, 0], np.fft.irfft(np.fft.rfft(signals[:, 1]) * turn, len(signals))], axis=1)


class _Elsewhere(Tip):
    """The response at another point: every mode with another share, some of the opposite sign."""

    def receptance(self, frequency: np.ndarray, decay: float = 0.0) -> np.ndarray:
        shares = np.random.default_rng(3).uniform(-0.7, 0.9, self.frequency.size)
        parts = [Tip(self.frequency[[k]], self.damping[[k]], self.stiffness[[k]], self.way[[k]]).receptance(frequency, decay)
                 for k in range(self.frequency.size)]
        return np.einsum("k,kfij->fij", shares, np.array(parts))


@dataclass(frozen=True, eq=False)
class _Loaded(Tip):
    """The tip with the mass of a heavy sensor (kg) on it."""

    mass: float = 0.05

    def receptance(self, frequency: np.ndarray, decay: float = 0.0) -> np.ndarray:
        bare = super().receptance(frequency, decay)
        s = 2j * np.pi * np.asarray(frequency) + decay
        return np.linalg.solve(np.eye(2) + self.mass * (s**2)[:, None, None] * bare, bare)


def _as(kind: type[Tip], tip: Tip) -> Tip:
    return kind(tip.frequency, tip.damping, tip.stiffness, tip.way)


def _suspended(tip: Tip) -> Tip:
    return Tip(np.append(tip.frequency, [35.0, 41.0]), np.append(tip.damping, [0.04, 0.04]),
               np.append(tip.stiffness, [2e6, 2e6]), np.concatenate([tip.way, WAYS]))


def _contact_for(tap: Tap) -> float:
    """Return a pulse so long that the force ends at a half of the middle frequency of the tip's modes."""
    return 1.35 / (0.5 * float(np.median(tap.tip.frequency[tap.tip.frequency < 6000])))


# Every slip takes a tap as it should be; each is a way in which tests go wrong in shops.
SLIPS: dict[str, Callable[[Tap], Tap]] = {
    "every third blow bounces": lambda tap: spoiled(tap, bounce="some"),
    "all blows bounce": lambda tap: spoiled(tap, bounce="all"),
    "force clipped": lambda tap: spoiled(tap, change=_clipped(0, 0.5)),
    "response clipped": lambda tap: spoiled(tap, change=_clipped(1, 0.4)),
    "mV/(m/s^2) said for mV/g": lambda tap: spoiled(tap, said_sensor=f"{1e3 * tap.blows.sensor * GRAVITY:.6g}mV/(m/s^2)"),
    "V/N said for mV/N": lambda tap: spoiled(tap, said_hammer=f"{1e3 * tap.blows.hammer:.6g}V/N"),
    "sign of the response turned": lambda tap: spoiled(tap, change=lambda s, top, b, rng: s * [1, -1]),
    "channels exchanged": lambda tap: spoiled(tap, exchanged=True),
    "x and y exchanged": lambda tap: spoiled(tap, **{"sets changed over": True}),
    "tip of the hammer too soft": lambda tap: spoiled(tap, contact=_contact_for(tap)),
    "records far too short": lambda tap: spoiled(tap, length=0.02, apart=True),
    "analyser's window not said": lambda tap: spoiled(tap, change=_windowed, apart=True, length=min(tap.blows.length, 0.5)),
    "drift": lambda tap: spoiled(tap, change=_drifting),
    "hum of 50 Hz": lambda tap: spoiled(tap, change=_humming),
    "sensor at another point": lambda tap: spoiled(tap, tip=_as(_Elsewhere, tap.tip)),
    "acceleration said to be velocity": lambda tap: spoiled(
        tap, motion="velocity", said_sensor=f"{1e3 * tap.blows.sensor * GRAVITY:.6g}mV/(mm/s)"),
    "sensor's cable broken (noise)": lambda tap: spoiled(tap, change=_mute),
    "one blow only": lambda tap: spoiled(tap, count=1),
    "sampled too slowly": lambda tap: spoiled(tap, rate=float(max(tap.tip.frequency[tap.tip.frequency < 6000])) * 1.6,
                                              contact=max(tap.blows.contact, 3e-4), kind="npz"),
    "sensor of 50 g": lambda tap: spoiled(tap, tip=_as(_Loaded, tap.tip)),
    "whole machine on soft feet": lambda tap: spoiled(tap, tip=_suspended(tap.tip)),
    "blows 20 degrees off": lambda tap: spoiled(tap, misaligned=float(np.radians(20))),
    "one channel 0.1 ms late": lambda tap: spoiled(tap, change=_late),
    "every blow at another spot": lambda tap: spoiled(tap, place=0.3, tilt=0.3),
}
