"""From hammer blows to spindle speeds over whole random taps, as files of volts: do intervals hold the truth, and what is said
of a slip.

Random tips (1 to 6 modes in x and in y, some turned between them, a mode far above), hammers, front ends, records and cutters
(`tests/tapped_tools.py`); truth: the tip's own modes by an exact engine.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import warnings
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np

from benchmarks.frame import CommandLine
from tapped_tools import SLIPS, Tap, Tip, channels_of, random_tap, strike, write
from toolpoint import io, studies
from toolpoint._check import ToolpointError
from toolpoint.cutting import MillingProblem, PanelArnoldi, stability
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import modal_dynamics
from toolpoint.studies.measured.hammer_study import HammerStudy
from toolpoint.studies.testing.tap_study import TapStudy

FACTORS = (0.98, 1.0, 1.02)
ALOUD = 0.1  # of the largest accelerance in the band: lines whose intervals are asked


def study(tap: Tap) -> TapStudy:
    """Return what the package makes of the files of a tap."""
    rng, sets = np.random.default_rng([tap.seed, 1]), []
    for axis in range(2 if tap.both else 1):
        files = strike(tap, axis, rng)
        with tempfile.TemporaryDirectory() as folder:
            paths = write(files, Path(folder), "xy"[axis], tap.blows)
            sets.append(studies.study_hammer_records(io.read_records(paths, channels_of(tap, axis, files))))
    if tap.spoil.get("sets changed over"):
        sets = sets[::-1]
    return studies.study_tap(sets[0], sets[1] if tap.both else None, tap.cut, speeds=tap.speeds, rng=np.random.default_rng(0))


def true_problem(tap: Tap, *, said: bool) -> MillingProblem:
    """Return the true cut, with the coefficients that were said or those that it has."""
    kt, kn = (tap.cut["tangential"], tap.cut["normal"]) if said else tap.true_coefficients
    return build_problem(modal_dynamics(tap.tip.modes), {**tap.cut, "tangential": kt, "normal": kn})[0]


def limits_of(problem: MillingProblem, speeds: np.ndarray, depth: float) -> np.ndarray:
    """Return true limits, at most `depth`."""
    return np.minimum(stability.chart(problem, speeds, PanelArnoldi(first_only=True), depth_max=depth).limit, depth)


def examine(tap: Tap, result: TapStudy) -> dict[str, Any]:
    """Return what holds of a study: counts of limits inside their intervals, of unsafe depths, of false alarms."""
    chart, limits = result.limits.chart, result.limits
    top = 3 * chart.depth_max
    known, real = (limits_of(true_problem(tap, said=said), chart.speeds, top) for said in (True, False))
    limit, error = np.minimum(chart.limit, chart.depth_max), chart.limit_error
    capped = ~np.isfinite(chart.limit)
    inside = (real >= (limit - error) * limits.low) & ((real <= (limit + error) * limits.high) | capped)
    _, low, high, _ = limits.lowest
    fine = np.linspace(*tap.speeds, 161)
    true_least = float(limits_of(true_problem(tap, said=False), fine, top).min())
    row: dict[str, Any] = {
        "colour": result.colour, "lights": [(light.step, light.colour, light.words) for light in result.lights
                                            if light.colour != "green"],
        "limits": inside.tolist(), "off": np.abs(limit / known - 1)[~capped].tolist(),
        "least limit": [low <= true_least <= high], "sure depth safe": [low <= true_least],
        "sure depth over true": low / true_least}
    use = limits.speeds if result.colour != "red" else ()
    beside = [float(limits_of(true_problem(tap, said=False), use_.speed * np.array(FACTORS), top).min()) for use_ in use]
    row["recommended depth safe"] = [use_.depth <= depth for use_, depth in zip(use, beside, strict=True)]
    row["recommended over true"] = [use_.depth / depth for use_, depth in zip(use, beside, strict=True)]
    for axis, direction in enumerate(result.directions):
        row.setdefault("responses", []).extend(responses_inside(tap.tip, axis, direction.hits))
        for name, values in modes_inside(tap.tip, axis, direction).items():
            row.setdefault(name, []).extend(values)
    return row


def responses_inside(tip: Tip, axis: int, hits: HammerStudy | None) -> list[bool]:
    """Return whether the 95 % circles of the loud lines of the band hold the true response (of the same window)."""
    if hits is None or hits.tests[0].radius() is None:
        return []
    frf = hits.frf
    inside = (frf.frequency >= hits.band.low) & (frf.frequency <= hits.band.high) & (frf.frequency > 0)
    truth = tip.receptance(frf.frequency, frf.decay)[:, axis, axis] * (2j * np.pi * frf.frequency + frf.decay) ** 2
    value, radius = frf.values[:, 0, 0], np.asarray(hits.tests[0].radius())[:, 0, 0]
    loud = inside & (np.abs(value) > ALOUD * np.abs(value[inside]).max())
    lines = np.flatnonzero(loud)[:: max(int(loud.sum()) // 60, 1)]
    return (np.abs(value - truth)[lines] <= radius[lines]).tolist()


def modes_inside(tip: Tip, axis: int, direction: Any) -> dict[str, list[bool]]:
    """Return whether intervals of modes that are not doubtful hold the nearest true one."""
    modes, rows = direction.modes.modes, defaultdict(list)
    if modes.covariance is None:
        return rows
    true = tip.seen(axis, direction.band.high)
    for i in np.flatnonzero(~direction.modes.doubtful).tolist():
        near = min(true, key=lambda k: abs(tip.frequency[k] - modes.frequency[i]))
        rows["frequencies"].append(bool(abs(tip.frequency[near] - modes.frequency[i]) <= modes.frequency_interval[i]))
        rows["damping"].append(bool(abs(tip.damping[near] - modes.damping_ratio[i]) <= modes.damping_interval[i]))
    return rows


def describe(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the shares over all taps."""
    def share(name: str) -> float:
        every = [value for row in rows for value in row.get(name, [])]
        return float(np.mean(every)) if every else float("nan")

    names = ("limits", "least limit", "sure depth safe", "recommended depth safe", "responses",
             "frequencies", "damping")
    off = [row["sure depth over true"] for row in rows]
    over = [value for row in rows for value in row["recommended over true"]]
    return {**{f"{name}, share": share(name) for name in names},
            "median error at said coefficients": float(np.median([value for row in rows for value in row["off"]])),
            "median sure depth over true": float(np.median(off)),
            "largest recommended depth over true": max(over, default=float("nan")),
            "colours": dict(Counter(row["colour"] for row in rows))}


def run_good(first: int, runs: int, verbose: bool) -> dict[str, Any]:
    """Study taps that are as they should be."""
    rows, refused = [], []
    for seed in range(first, first + runs):
        tap, begin = random_tap(seed), time.process_time()
        try:
            result = study(tap)
        except ToolpointError as error:
            refused.append(str(error))
            print(seed, "refused:", str(error)[:200], flush=True) if verbose else None
            continue
        spent = time.process_time() - begin
        rows.append(examine(tap, result))
        if verbose:
            row = rows[-1]
            names = ("limits", "least limit", "recommended depth safe", "responses", "frequencies", "damping", "off")
            shares = ", ".join(f"{name} {np.mean(row.get(name) or [np.nan]):.2f}" for name in names)
            print(f"{seed} {spent:.1f} s {row['colour']} {shares}, sure over true {row['sure depth over true']:.2f}, "
                  f"recommended over true {np.round(row['recommended over true'], 2)}", flush=True)
            for light in row["lights"]:
                print("     ", *light, flush=True)
    return {**describe(rows), "refused": len(refused)}


def run_slips(first: int, runs: int, verbose: bool) -> dict[str, Counter[str]]:
    """Study every slip on some taps: what is said of it beyond what is said of the tap without it."""
    outcome: dict[str, Counter[str]] = {name: Counter() for name in SLIPS}
    for seed in range(first, first + runs):
        tap = random_tap(seed, coupled=0.0)
        try:
            usual = {light.step for light in study(tap).lights if light.colour != "green"}
        except ToolpointError:
            continue
        for name, slip in SLIPS.items():
            verdict, words = judge_slip(slip(tap), usual)
            outcome[name][verdict] += 1
            if verbose:
                print(f"{seed} {name}: {verdict}: {words}", flush=True)
    return outcome


def judge_slip(tap: Tap, usual: set[str]) -> tuple[str, str]:
    """Return ``refused``, ``red``, ``amber`` (a light that the tap alone has not), ``harmless`` or ``missed``, and words."""
    try:
        result = study(tap)
    except ToolpointError as error:
        return "refused", str(error)[:300]
    if result.colour == "red":
        return "red", result.status[:300]
    row = examine(tap, result)
    harmless = all(row["recommended depth safe"]) and all(row["sure depth safe"])
    new = [f"{light.step}: {light.words}" for light in result.lights if light.colour == "amber" and light.step not in usual]
    spared = "harmless" if harmless else "missed"
    words = "; ".join(new)[:300] or f"{result.colour}, recommended over true {np.round(row['recommended over true'], 2)}"
    return ("amber" if new else spared), words


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 60)
    parser.add_argument("--slips", type=int, default=3, help="taps on which every slip is tried")
    parser.seed(0, "first-seed")
    parser.add_argument("--verbose", action="store_true")
    parser.json()
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    begin = time.process_time()
    good = run_good(options.first_seed, options.runs, options.verbose) if options.runs else {}
    slips = run_slips(options.first_seed, options.slips, options.verbose)
    if options.json:
        print(json.dumps({"good": good, "slips": slips}))
        return
    for name, value in good.items():
        print(f"{name:<44}{value if isinstance(value, dict) else format(value, '.3g')}")
    for name, counts in slips.items():
        print(f"{name:<34}" + ", ".join(f"{verdict} {count}" for verdict, count in counts.items()))
    every = sum(slips.values(), Counter())
    held, safe = (100 * good.get(f"{name}, share", np.nan) for name in ("limits", "recommended depth safe"))
    print(f"{time.process_time() - begin:.0f} CPU s; limits hold in {held:.1f} %, recommended depths are safe in {safe:.1f} %, "
          f"slips missed {every['missed']} of {every.total()}")


if __name__ == "__main__":
    main()
