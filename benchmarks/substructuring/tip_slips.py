"""Tip responses with a slip, as files, through the commands that take one: are they doubted, and is the best cut withheld.

Random tips (1 to 6 modes in x and in y, some turned between them, a mode far above), accelerances or receptances with
noise, as text or universal files. Slips: delay and advance of 10 to 100 us, sign, conjugate, columns exchanged, mm for m,
another quantity, x and y exchanged, another point, band clipped above and below the softest mode, a dead channel, a heavy
sensor (its mass said). Charts are of few speeds, which no doubt rests on, and no page is
written: what a command says is that of its JSON. `--part K` takes every eighth structure (a part ends
within minutes) and keeps its counts in `--store`; the last line is of all parts kept there. A scale of
9.81 (g for m/s^2) is counted apart: within the stiffnesses that tips have a driving point alone cannot show it. So is another
point at which every mode that the given responses show moves in phase with the tip: a sum of modes with positive shares is the
driving point of a structure with other modal stiffnesses, exactly, so that no test of it can tell. Delays that move neither
least real part by 5 % are no slips, as bands and masses that limits do not feel.
"""

from __future__ import annotations

import contextlib
import io as streams
import json
import sys
import tempfile
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np

from benchmarks.frame import CommandLine
from tapped_tools import Tip, random_tip
from toolpoint import io
from toolpoint.app.frame import Frame
from toolpoint.app.main import main as toolpoint
from toolpoint.studies.cuts import measured_response
from toolpoint.vibration import Dof, Frf

COMMANDS: dict[str, list[str]] = {
    "lobes": ["lobes", "--speeds", "6000:12000:4", "--method", "zero-order", "--diameter", "16", "--teeth", "4"],
    "turn": ["turn", "--kf", "2000", "--speeds", "1000:3000:5"],
    "mill": ["mill", "--speed", "9000", "--depth", "0.2", "--revolutions", "30", "--diameter", "16", "--teeth", "4"],
    "report": ["report"], "tap": ["tap", "--diameter", "16", "--teeth", "4", "--kt", "2000", "--kn", "700"]}
FAST = ("lobes", "turn", "report")
MAX_LINES = 2500  # of a response: with 12 000 the commands that identify modes take half a minute each
PARTS = 8  # in which the structures are asked
MIN_LIMIT_CHANGE = 0.05  # of the least real part, by a delay that counts as a slip
UNSEEN = ("g for m/s^2", "another point, in phase")  # slips without a sign, counted apart
EVERY = 15  # slips of which one goes through the commands that identify modes, another one in each structure


@dataclass(frozen=True, eq=False)
class Case:
    """A tip, its lines (Hz), relative noise, the generator of all else."""

    tip: Tip
    lines: np.ndarray
    noise: float
    rng: np.random.Generator

    @property
    def softest(self) -> float:
        """Frequency of the largest receptance along x, Hz."""
        return float(self.lines[int(np.argmax(np.abs(self.tip.receptance(self.lines)[:, 0, 0])))])


@dataclass(frozen=True, eq=False)
class Files:
    """Measured responses along x and y, and further options of the command."""

    x: Frf
    y: Frf
    options: tuple[str, ...] = ()

    def changed(self, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Files:
        """Return both responses with values changed by a function of lines and values."""
        return replace(self, x=_changed(self.x, change), y=_changed(self.y, change))


def random_case(seed: int) -> Case:
    """Return a random tip with the lines of a careful test."""
    rng = np.random.default_rng([seed, 30])
    tip, top = random_tip(rng, 0.3)
    step = max(rng.choice([0.5, 1.0, 2.0]), (1.3 * top + 200) / MAX_LINES)
    lines = np.arange(rng.choice([1.0, 10.0, 20.0]), 1.3 * top + 200, step)
    return Case(tip, lines, float(10 ** rng.uniform(-3, -1.7)), rng)


def measured(case: Case, values: np.ndarray, way: str) -> Frf:
    """Return a receptance (n_f,) as an accelerance or receptance with the noise of its channels."""
    noise = case.rng.standard_normal((2, 2, values.size)).view()
    acceleration = -((2 * np.pi * case.lines) ** 2) * values
    scatter = case.noise * (0.5 * np.abs(acceleration) + 0.1 * np.median(np.abs(acceleration)))
    acceleration = acceleration + scatter * (noise[0, 0] + 1j * noise[0, 1])
    quantity = "accelerance" if case.rng.random() < 0.5 else "receptance"
    if quantity == "receptance":
        acceleration = -acceleration / (2 * np.pi * case.lines) ** 2
    label = (Dof(1, f"+{way}"),)
    return Frf(case.lines, acceleration[:, None, None], label, label, quantity)


def good(case: Case) -> Files:
    """Return the files of a test without a slip."""
    response = case.tip.receptance(case.lines)
    return Files(measured(case, response[:, 0, 0], "x"), measured(case, response[:, 1, 1], "y"))


def _changed(frf: Frf, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Frf:
    return replace(frf, values=change(frf.frequency[:, None, None], frf.values))


def _late(case: Case, sign: int) -> Files | None:
    delay = sign * case.rng.uniform(1e-5, 1e-4)
    true = np.einsum("fii->fi", case.tip.receptance(case.lines))
    turned = true * np.exp(-2j * np.pi * case.lines * delay)[:, None]
    if np.abs(turned.real.min(axis=0) / true.real.min(axis=0) - 1).max() < MIN_LIMIT_CHANGE:
        return None  # limits do not feel it
    return good(case).changed(lambda f, v: v * np.exp(-2j * np.pi * f * delay))


def _other_quantity(case: Case) -> Files:
    files = good(case)
    other = "receptance" if files.x.quantity == "accelerance" else "mobility"
    return Files(replace(files.x, quantity=other), replace(files.y, quantity=other))


def _exchanged(case: Case) -> Files:
    files = good(case)
    return Files(files.y, files.x)


def _shares(case: Case) -> np.ndarray:
    """Return the shares of the modes at another point; the first numbers that are drawn."""
    return case.rng.uniform(-0.9, 0.9, case.tip.frequency.size)


def leaves_no_sign(case: Case, ways: str) -> bool:
    """Whether all modes within the lines move in phase at both points, in every direction that was given."""
    tip, shares = case.tip, _shares(case)
    for way in ways:
        is_shown = (np.abs(tip.way[:, "xy".index(way)]) > 1e-3) & (tip.frequency < case.lines[-1])
        if (shares[is_shown] < 0).any():
            return False
    return True


def _elsewhere(case: Case) -> Files:
    shares = _shares(case)
    parts = [Tip(*(part[[k]] for part in (case.tip.frequency, case.tip.damping, case.tip.stiffness, case.tip.way)))
             for k in range(shares.size)]
    response = np.einsum("k,kfij->fij", shares, np.array([part.receptance(case.lines) for part in parts]))
    return Files(measured(case, response[:, 0, 0], "x"), measured(case, response[:, 1, 1], "y"))


def _clipped(case: Case, above: bool) -> Files | None:
    files, softest = good(case), case.softest
    inside = [f for f, way in zip(case.tip.frequency, case.tip.way, strict=True) if abs(way[0]) > 0.1 and f < 6000]
    ends = (float(case.lines[0]), 0.85 * softest) if above else (1.2 * softest, float(case.lines[-1]))
    if not any(ends[0] * 1.1 < f < ends[1] * 0.9 for f in inside):
        return None  # nothing would be left to be cut on
    real = np.minimum(*np.einsum("fii->if", case.tip.receptance(case.lines).real))
    if real[(case.lines >= ends[0]) & (case.lines <= ends[1])].min() < 0.95 * real.min():
        return None  # limits do not feel it
    return replace(files, x=files.x.between(*ends), y=files.y.between(*ends))


def _dead(case: Case) -> Files:
    return good(case).changed(lambda f, v: np.median(np.abs(v)) * (case.rng.standard_normal(v.shape)
                                                                   + 1j * case.rng.standard_normal(v.shape)))


def _loaded(case: Case) -> Files | None:
    response = case.tip.receptance(case.lines)
    mass, square = case.rng.uniform(0.02, 0.08), (2 * np.pi * case.lines) ** 2
    x, y = (response[:, k, k] / (1 - mass * square * response[:, k, k]) for k in (0, 1))
    if abs(x.real.min() / response[:, 0, 0].real.min() - 1) < 0.1:
        return None  # so stiff a tip does not feel it
    return Files(measured(case, x, "x"), measured(case, y, "y"), ("--sensor-mass", f"{1e3 * mass:.4g}"))


SLIPS: dict[str, Callable[[Case], Files | None]] = {
    "good": good,
    "delay": lambda case: _late(case, 1), "advance": lambda case: _late(case, -1),
    "sign": lambda case: good(case).changed(lambda f, v: -v),
    "conjugate": lambda case: good(case).changed(lambda f, v: v.conj()),
    "columns exchanged": lambda case: good(case).changed(lambda f, v: 1j * v.conj()),
    "mm for m": lambda case: good(case).changed(lambda f, v: 1e3 * v),
    "another quantity": _other_quantity, "x and y exchanged": _exchanged, "another point": _elsewhere,
    "clipped above": lambda case: _clipped(case, True), "clipped below": lambda case: _clipped(case, False),
    "dead channel": _dead, "heavy sensor": _loaded,
    "g for m/s^2": lambda case: good(case).changed(lambda f, v: 9.80665 * v)}


def ask(command: str, files: Files, folder: Path, suffix: str) -> str:
    """Return ``withheld``, ``doubted``, ``believed`` or ``refused``: what a command makes of the files."""
    paths = {way: folder / f"{way}{suffix}" for way in "xy"}
    for way, path in paths.items():
        io.write_frf(getattr(files, way), path)
    sources = ["--frf-x", str(paths["x"]), "--frf-y", str(paths["y"])]
    options = list(files.options)
    if command == "tap":
        sources, options = [str(paths["x"]), "--y", str(paths["y"])], []
    if command == "report":
        sources, options = ["--frf", str(paths["x"])], []
    out, told = streams.StringIO(), streams.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(told), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            toolpoint([*COMMANDS[command], *sources, *options, "--json", "-o", str(folder / "page")])
    except SystemExit as stopped:
        if stopped.code:
            return "refused"
    said = json.loads(out.getvalue())
    said = said.get("measured") or said
    if said.get("withheld") or said.get("colour") == "red":
        return "withheld"
    return "doubted" if "doubt" in json.dumps(said.get("notes", [])) else "believed"


def _with_kept(counts: dict[str, Counter[str]], folder: Path, part: int) -> dict[str, Counter[str]]:
    """Keep the counts of a part, and return those of all parts kept in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"part{part}.json").write_text(json.dumps(counts))
    total: dict[str, Counter[str]] = defaultdict(Counter)
    for file in sorted(folder.glob("part*.json")):
        for name, count in json.loads(file.read_text()).items():
            total[name].update(count)
    return total


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("structures", 50)
    parser.seed(0, "first")
    parser.add_argument("--part", type=int, choices=range(PARTS), help="every eighth structure, from this one")
    parser.add_argument("--store", type=Path, help="folder of the counts of all parts")
    options = parser.parse_args()
    measured_response.CHARTED_SPEED_COUNT = 3
    Frame.save = lambda *_, **__: ""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    begun = time.perf_counter()
    seeds = range(options.first, options.first + options.structures)
    for seed in seeds if options.part is None else seeds[options.part::PARTS]:
        for number, (name, slip) in enumerate(SLIPS.items()):
            files = slip(random_case(seed))
            if files is None:
                continue
            suffix = ".uff" if seed % 2 or name == "x and y exchanged" else ".csv"
            for command in COMMANDS if (seed + number) % EVERY == 0 else FAST:
                if command in ("report", "tap") and name in ("heavy sensor", "x and y exchanged") and not (
                        command == "tap" and name == "x and y exchanged"):
                    continue  # they take no mass of a sensor, or one file alone
                is_unseen = name == "another point" and leaves_no_sign(random_case(seed), "x" if command == "report" else "xy")
                kind = f"{name}, in phase" if is_unseen else name
                with tempfile.TemporaryDirectory() as folder:
                    verdict = ask(command, files, Path(folder), suffix)
                counts[kind][verdict] += 1
                counts[f"{'good' if name == 'good' else 'slips'} through {command}"][verdict] += kind not in UNSEEN
                if (verdict in ("withheld", "refused")) == (name == "good"):
                    print(f"  {kind}, {command}, {seed}: {verdict}", flush=True)
        print(f"{seed}: {sum(counter.total() for name, counter in counts.items() if name in SLIPS)} asked, "
              f"{time.perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    if options.store is not None:
        counts = _with_kept(counts, options.store, options.part or 0)
    for name, count in counts.items():
        print(f"{name:28s} {dict(count)}")
    slips = sum((counts[name] for name in SLIPS if name not in ("good", *UNSEEN)), Counter[str]())
    share = 1 - (slips["believed"] + slips["doubted"]) / max(slips.total(), 1)
    wrong = 1 - (counts["good"]["believed"] + counts["good"]["doubted"]) / max(counts["good"].total(), 1)
    print(f"withheld: {100 * share:.1f} % of {slips.total()} slips, {100 * wrong:.1f} % of {counts['good'].total()} good ones, "
          f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
