"""Records of controllers as users have them, from axes simulated here: do stated intervals hold the truth, are slips doubted?

Each axis has a mass, LuGre friction with a falling curve and presliding, weight, a force that repeats with the screw, a sampled
cascade with a quantised encoder, feed-forward in some; each record its own channels, units, filter, rounding, noise, offset,
rate and jitter. Nothing of the package makes the records: they are written as files, and read as a user's.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint._check import ToolpointError
from toolpoint.io import read_servo_data
from toolpoint.studies import judge_servo_data

STEP, EVERY, DURATION = 2e-4, 5, 20.0
Columns = dict[str, tuple[str, np.ndarray]]


@dataclass
class Axes:
    """Random axes (n,), SI, and what they did: arrays (n_times, n) at the control's samples."""

    mass: np.ndarray
    dry: np.ndarray
    static: np.ndarray
    fall: np.ndarray
    viscous: np.ndarray
    weight: np.ndarray
    ripple: np.ndarray
    gain: np.ndarray
    ahead: np.ndarray
    place: np.ndarray
    phase: np.ndarray
    integral: np.ndarray
    speeds: list[np.ndarray]
    signals: dict[str, np.ndarray] = field(default_factory=dict)


def random_axes(rng: np.random.Generator, number: int) -> Axes:
    """Return axes that are not moved yet; one in four goes slower than its friction falls, one in four at one or two speeds."""
    dry = rng.uniform(20, 300, number)
    top = rng.uniform(0.1, 0.6, number)
    fall = rng.uniform(0.5e-3, 2e-3, number)
    speeds = []
    for k in range(number):
        many = int(rng.integers(1, 3)) if k % 4 == 1 else int(rng.integers(3, 7))
        low = np.log(max(5 * fall[k], 0.05 * top[k]))
        speed = np.exp(low + (np.log(top[k]) - low) * (np.arange(many) + rng.uniform(0.3, 0.7, many)) / many)
        if k % 4 == 3:
            speed = np.r_[speed, fall[k] * rng.uniform(0.3, 3, 2)]
        speeds.append(np.sort(speed))
    viscous = dry * rng.uniform(0.1, 1.0, number) / top
    vertical = rng.random(number) < 0.3
    return Axes(rng.uniform(50, 500, number), dry, dry * rng.uniform(1.05, 1.5, number), fall, viscous,
                np.where(vertical, rng.uniform(-3, 3, number) * dry, 0.0), rng.uniform(0, 0.04, number) * dry,
                rng.uniform(20, 120, number), np.where(rng.random(number) < 0.25, rng.uniform(0.3, 0.9, number), 0.0),
                rng.uniform(0, 0.05, number), rng.uniform(0, 6.28, number),
                np.where(rng.random(number) < 0.15, 0.0, 1.0), speeds)


def commanded(axes: Axes, rng: np.random.Generator) -> np.ndarray:
    """Return velocity set points (n_times, n): to and fro at every speed, as often as time allows."""
    n = round(DURATION / STEP / EVERY)
    wish = np.zeros((n, axes.mass.size))
    for k, speeds in enumerate(axes.speeds):
        at, acceleration, hold = rng.integers(200, 600), rng.uniform(2, 6), rng.uniform(0.4, 1.2)
        while True:
            moves = [s * sign for s in rng.permutation(speeds) for sign in (1, -1)]
            ramps = [np.linspace(0, v, max(round(abs(v) / acceleration / 1e-3), 5)) for v in moves]
            rows = [np.concatenate([ramp, np.full(round(hold / 1e-3), v), ramp[::-1], np.zeros(150)])
                    for v, ramp in zip(moves, ramps, strict=True)]
            block = np.concatenate(rows)
            if at + block.size > n:
                if at < 1000:  # not even once: what fits
                    wish[at:, k] = block[:n - at]
                break
            wish[at:at + block.size, k] = block
            at += block.size
    return wish


def move(axes: Axes, wish: np.ndarray) -> None:
    """Run the axes along their set points: semi-implicit in the bristle, the cascade at 1 ms."""
    n, many = wish.shape
    x, v, z, integral, force = (np.zeros(many) for _ in range(5))
    stiff = axes.static / 5e-6
    damp = 0.5 * np.sqrt(stiff * axes.mass)
    bandwidth = 6 * axes.gain
    quantum, before = 5e-8, np.zeros(many)
    target = np.cumsum(wish, axis=0) * STEP * EVERY
    kept = {name: np.zeros((n, many)) for name in ("position", "velocity", "force", "position_set", "velocity_set")}
    for i in range(n):
        seen = np.round(x / quantum) * quantum
        speed, before = (seen - before) / (STEP * EVERY), seen
        error = axes.gain * (target[i] - seen) + axes.ahead * wish[i] - speed
        integral = integral + axes.integral * bandwidth / 5 * STEP * EVERY * error
        force = axes.mass * bandwidth * (error + integral)
        for name, value in (("position", seen), ("velocity", speed), ("force", force), ("position_set", target[i]),
                            ("velocity_set", wish[i])):
            kept[name][i] = value
        for _ in range(EVERY):
            level = axes.dry + (axes.static - axes.dry) * np.exp(-(v / axes.fall) ** 2)
            new = (z + STEP * v) / (1 + STEP * stiff * np.abs(v) / level)
            more = 1 + axes.place * np.sin(2 * np.pi * x / 0.3 + axes.phase)
            drag = more * stiff * new + np.where(np.abs(v) < axes.fall, damp, 0.0) * (new - z) / STEP + axes.viscous * v
            z = new
            v = v + STEP / axes.mass * (force - drag - axes.weight - axes.ripple * np.sin(2 * np.pi * x / 0.01))
            x = x + STEP * v
    axes.signals = kept


@dataclass
class Sheet:
    """A record before it is written: columns of SI values with their unit, and what is true of it."""

    time: np.ndarray
    columns: Columns
    truth: dict[str, float]


UNITS = {"m": {"mm": 1e3, "um": 1e6, "m": 1.0}, "m/s": {"mm/s": 1e3, "mm/min": 6e4, "m/min": 60.0}, "A": {"A": 1.0, "mA": 1e3}}
CHANNELS = (("velocity_set", "current", "following_error"), ("position_set", "position", "current"), ("position", "current"),
            ("velocity", "current", "position_set", "position"), ("velocity_set", "velocity", "position", "current"))
NAMES = {"velocity_set": "v set X", "velocity": "v act X", "position_set": "pos set X", "position": "pos act X",
         "following_error": "following error X", "current": "current X"}
KIND = {"velocity_set": "m/s", "velocity": "m/s", "position_set": "m", "position": "m", "following_error": "m", "current": "A"}


def sheet_of(axes: Axes, k: int, rng: np.random.Generator, channels: tuple[str, ...] | None = None) -> Sheet:
    """Return the record of one axis: decimated, filtered, jittered, noisy, with an offset of the current sensor."""
    every = int(rng.choice([1, 2, 4]))
    per_newton = 1 / rng.uniform(50, 300)
    zero = rng.uniform(-0.1, 0.1) * axes.dry[k] * per_newton
    s = {name: values[:, k] for name, values in axes.signals.items()}
    current, held = s["force"] * per_newton + zero, np.exp(-1e-3 / rng.uniform(1e-3, 4e-3))
    slow = np.empty_like(current)
    state = current[0]
    for i, value in enumerate(current):
        state = held * state + (1 - held) * value
        slow[i] = state
    slow = slow + rng.uniform(0.002, 0.03) * axes.dry[k] * per_newton * rng.standard_normal(slow.size)
    values = {**s, "current": slow, "following_error": s["position_set"] - s["position"]}
    if channels is None:
        channels = CHANNELS[int(rng.integers(len(CHANNELS)))]
    time_ = 1e-3 * np.arange(slow.size) + rng.choice([0.0, 1.0]) * rng.uniform(-2e-4, 2e-4, slow.size)
    # Without an integral part of the speed loop friction needs an error, too.
    top = axes.speeds[k].max()
    leaning = 0.0 if axes.integral[k] else (axes.viscous[k] + axes.dry[k] / top) / (6 * axes.gain[k] * axes.mass[k])
    moving = np.abs(s["velocity_set"]) > 0
    mean = 1 + axes.place[k] * np.sin(2 * np.pi * s["position"][moving] / 0.3 + axes.phase[k]).mean()
    truth = {"dry": axes.dry[k] * mean * per_newton, "leans": 1 - axes.integral[k],
             "grain": rng.choice([1e-3, 0.02 * axes.dry[k] * per_newton]), "viscous": axes.viscous[k] * per_newton,
             "offset": axes.weight[k] * per_newton + zero, "gain": axes.gain[k] / (1 - axes.ahead[k] + leaning)}
    return Sheet(time_[::every], {name: (KIND[name], values[name][::every]) for name in channels}, truth)


def write(sheet: Sheet, path: Path, rng: np.random.Generator) -> None:
    """Write the record as a table in units of its own, rounded as controllers do, with decimal points or commas."""
    head, columns, comma = ["time [s]"], [[f"{t:.4f}" for t in sheet.time]], rng.random() < 0.3
    for name, (kind, values) in sheet.columns.items():
        unit = str(rng.choice(list(UNITS[kind])))
        number = UNITS[kind][unit] * values
        grain = {"m": 1e-7, "m/s": 1e-6, "A": sheet.truth["grain"]}[kind] * UNITS[kind][unit]
        head.append(f"{NAMES[name]} [{unit}]")
        cells = [f"{c:.9g}" for c in np.round(number / grain) * grain]
        if name == "current" and rng.random() < 0.3:  # every second sample is kept, the cells between are empty
            cells[1::2] = [""] * len(cells[1::2])
        columns.append(cells)
    rows = [";".join(row) for row in zip(*columns, strict=True)]
    text = "\n".join([";".join(head), *rows]) + "\n"
    path.write_text(text.replace(".", ",") if comma else text, encoding="utf-8")


# What users do wrong; each gets the sheet, another axis' sheet and random numbers.
Slip = Callable[[Sheet, Sheet, np.random.Generator], None]


def scale(name: str, *factors: float) -> Slip:
    """Return a slip that multiplies a channel."""
    def slip(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
        kind, values = sheet.columns[name]
        sheet.columns[name] = (kind, float(rng.choice(factors)) * values)
    return slip


def exchange(a: str, b: str) -> Slip:
    """Return a slip that names two channels wrongly."""
    def slip(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
        sheet.columns[a], sheet.columns[b] = sheet.columns[b], sheet.columns[a]
    return slip


def foreign(name: str) -> Slip:
    """Return a slip that takes a channel of another axis."""
    def slip(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
        n = min(sheet.time.size, other.time.size)
        sheet.time = sheet.time[:n]
        sheet.columns = {key: (kind, v[:n]) for key, (kind, v) in sheet.columns.items()}
        sheet.columns[name] = (sheet.columns[name][0], other.columns[name][1][:n])
    return slip


def late(name: str) -> Slip:
    """Return a slip that delays a channel by 0.1 to 0.3 s."""
    def slip(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
        kind, values = sheet.columns[name]
        by = round(rng.uniform(0.1, 0.3) / (sheet.time[1] - sheet.time[0]))
        sheet.columns[name] = (kind, np.concatenate([np.full(by, values[0]), values[:-by]]))
    return slip


def saturate(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Clip the current within what the friction takes."""
    kind, values = sheet.columns["current"]
    top = np.quantile(np.abs(values), 0.8)
    sheet.columns["current"] = (kind, np.clip(values, -top, top))


def tear(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Leave out 1.5 s three times."""
    keep = np.ones(sheet.time.size, bool)
    for start in rng.uniform(2, 15, 3):
        keep &= ~((sheet.time > start) & (sheet.time < start + 1.5))
    sheet.time = sheet.time[keep]
    sheet.columns = {key: (kind, v[keep]) for key, (kind, v) in sheet.columns.items()}


def ring(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Add a resonance as large as twice the dry friction to the current."""
    kind, values = sheet.columns["current"]
    wave = 2 * sheet.truth["dry"] * np.sin(2 * np.pi * rng.uniform(15, 90) * sheet.time + 1)
    sheet.columns["current"] = (kind, values + wave)


def one_way(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Keep the forward moves only (the way back is made at no load: a table of one direction)."""
    for key in ("position_set", "position"):
        if key in sheet.columns:
            kind, values = sheet.columns[key]
            sheet.columns[key] = (kind, np.cumsum(np.maximum(np.diff(values, prepend=values[0]), 0.0)))
    speed = np.gradient(sheet.columns["position"][1], sheet.time)
    kind, values = sheet.columns["current"]
    sheet.columns["current"] = (kind, np.where(speed > 0, values, 0.0))


def shorten(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Keep the first 0.6 s."""
    keep = sheet.time < 0.6
    sheet.time = sheet.time[keep]
    sheet.columns = {key: (kind, v[keep]) for key, (kind, v) in sheet.columns.items()}


def stretch(sheet: Sheet, other: Sheet, rng: np.random.Generator) -> None:
    """Name a wrong sample time."""
    sheet.time = sheet.time * float(rng.choice([0.25, 0.5, 2.0, 4.0]))


EVERYTHING = ("velocity", "position_set", "position", "current")
WITH_ERROR = ("velocity_set", "position", "following_error", "current")
SLIPS: dict[str, tuple[tuple[str, ...], Slip]] = {
    "position in another unit": (EVERYTHING, scale("position", 1e3, 25.4, 1e-3, 1 / 25.4)),
    "speed in another unit": (EVERYTHING, scale("velocity", 60.0, 1 / 60, 1e3, 25.4)),
    "time in another unit": (EVERYTHING, stretch),
    "following error in another unit": (WITH_ERROR, scale("following_error", 1e3, 1e-3)),
    "sign of the current": (EVERYTHING, scale("current", -1.0)),
    "sign of the position": (EVERYTHING, scale("position", -1.0)),
    "sign of the following error": (WITH_ERROR, scale("following_error", -1.0)),
    "set point and position exchanged": (EVERYTHING, exchange("position_set", "position")),
    "current of another axis": (EVERYTHING, foreign("current")),
    "position of another axis": (EVERYTHING, foreign("position")),
    "current late": (EVERYTHING, late("current")),
    "position late": (EVERYTHING, late("position")),
    "current saturated": (EVERYTHING, saturate),
    "samples left out": (EVERYTHING, tear),
    "current rings": (EVERYTHING, ring),
    "one direction": (("position", "current"), one_way),
    "too short": (EVERYTHING, shorten)}


def judge(sheet: Sheet, rng: np.random.Generator, folder: Path) -> Any:
    """Return the findings of axis X of a sheet as a user has them; the error where it is refused."""
    path = folder / "record.csv"
    write(sheet, path, rng)
    try:
        return judge_servo_data(read_servo_data(path)).axes[0]
    except ToolpointError as error:
        return error


def held(result: Any, truth: dict[str, float]) -> dict[str, bool]:
    """Return whether each stated interval holds the truth."""
    line, stated = result.friction, {"gain": result.gain_interval}
    if line is not None:
        stated |= {"dry": line.dry_interval, "viscous": line.slope_interval, "offset": line.offset_interval}
    return {name: bool(low <= truth[name] <= high) for name, (low, high) in stated.items() if np.isfinite(low)}


ENDS = {"dry": "dry_interval", "viscous": "slope_interval", "offset": "offset_interval"}


@dataclass
class Tally:
    """What came out: intervals that held and their widths, doubts of true records and of slips, what was said to be untold."""

    inside: dict[str, list[bool]] = field(default_factory=lambda: {name: [] for name in ("gain", *ENDS)})
    width: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in ("gain", *ENDS)})
    doubted: list[bool] = field(default_factory=list)
    untold: tuple[list[bool], list[bool]] = field(default_factory=lambda: ([], []))
    caught: dict[str, list[bool]] = field(default_factory=lambda: {name: [] for name in SLIPS})
    records: int = 0
    seconds: float = 0.0

    def true_record(self, axes: Axes, k: int, rng: np.random.Generator, folder: Path) -> None:
        """Judge a record without a slip."""
        sheet, begin = sheet_of(axes, k, rng), time.process_time()
        result = judge(sheet, rng, folder)
        self.seconds, self.records = self.seconds + time.process_time() - begin, self.records + 1
        if isinstance(result, ToolpointError):
            raise result
        good = held(result, sheet.truth)
        for name, inside in good.items():
            self.inside[name].append(inside)
            low, high = result.gain_interval if name == "gain" else getattr(result.friction, ENDS[name])
            self.width[name].append((high - low) / 2 / abs(sheet.truth["dry" if name == "offset" else name]))
        slow = k % 4 == 3
        if k % 2 == 0:
            if not sheet.truth["leans"]:
                self.doubted.append(bool(result.doubts))
        elif not slow or (np.abs(result.runs.velocity) < 2 * axes.fall[k]).any():
            right = slow and all(inside for name, inside in good.items() if name in ("dry", "viscous"))
            self.untold[slow].append(bool(result.doubts) or right)

    def slip(self, axes: Axes, k: int, rng: np.random.Generator, folder: Path, *, name: str) -> None:
        """Judge a record with a slip."""
        channels, spoil = SLIPS[name]
        sheet = sheet_of(axes, k, rng, channels)
        spoil(sheet, sheet_of(axes, (k + 1) % axes.mass.size, rng, channels), rng)
        result = judge(sheet, rng, folder)
        self.caught[name].append(isinstance(result, ToolpointError) or bool(result.doubts))


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("axes", 64)
    parser.add_argument("--records", type=int, default=4, help="records of each axis")
    parser.seed(0)
    parser.json()
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    axes = random_axes(rng, options.axes)
    move(axes, commanded(axes, rng))
    tally = Tally()
    with tempfile.TemporaryDirectory() as place:
        for k in range(options.axes):
            for _ in range(options.records):
                tally.true_record(axes, k, rng, Path(place))
            names = list(SLIPS)
            for turn in range(3):
                tally.slip(axes, k, rng, Path(place), name=names[(k + 6 * turn) % len(names)])
    inside, width, caught, untold = tally.inside, tally.width, tally.caught, tally.untold
    doubted, records, seconds = tally.doubted, tally.records, tally.seconds
    every = [good for values in inside.values() for good in values]
    rows: dict[str, float] = {f"95 % of {name} holds": float(np.mean(v)) for name, v in inside.items()}
    rows |= {f"half width of {name}, median": float(np.median(v)) for name, v in width.items()}
    rows |= {f"doubted: {name}": float(np.mean(v)) for name, v in caught.items()}
    rows |= {"said: two speeds or one": float(np.mean(untold[0])), "said: slow runs off the line": float(np.mean(untold[1]))}
    rows["CPU seconds a record"] = seconds / records
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<48}{value:.3g}")
    print(f"95 % intervals hold in {100 * np.mean(every):.1f} % of {len(every)} (target 93-97 %), wrong records doubted "
          f"{100 * np.mean([good for v in caught.values() for good in v]):.1f} %, true ones {100 * np.mean(doubted):.1f} %")


if __name__ == "__main__":
    main()
