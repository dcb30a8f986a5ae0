"""`toolpoint mill` on random cuts, each a process of its own: is the verdict that of the exact multipliers, what does it cost.

Random tips (1 to 6 modes in x and in y, some turned between them) as saved modes, random cutters and speeds, depths from 0.3 to
2 times the limit at the speed. Every third is a cut of the machine file of a template. Subcritical: the multipliers call a cut
stable, and it is with its edges kept in contact, but the blow of its entry has thrown edges out of the material and it chatters
on, which `mill` says.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

import numpy as np

from benchmarks.frame import CommandLine
from tapped_tools import random_cut, random_tip
from toolpoint import io
from toolpoint.cutting import PanelArnoldi, stability
from toolpoint.cutting.simulation.march import KEPT_STEPS
from toolpoint.cutting.simulation.milling import ExactSteps, RunningCut, run_until_decided
from toolpoint.studies import modal_dynamics
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machines.tool_point import depth_limit

FIRST_REVOLUTIONS, MAX_REVOLUTIONS = 60, 4000  # of a cut whose edges are kept in contact
NEAR = 0.01  # of the limit: a cut so near it is not asked
TEMPLATE = "three-axis-vertical"
OPTIONS = {"diameter": ("--diameter", 1e3), "teeth": ("--teeth", 1), "tangential": ("--kt", 1e-6), "normal": ("--kn", 1e-6),
           "immersion": ("--immersion", 1), "helix": ("--helix", 180 / np.pi)}


def random_call(seed: int, folder: Path) -> tuple[list[str], ToolDynamics, dict[str, Any]]:
    """Return the arguments of a random cut, its files written into the folder, and the same as dynamics and values."""
    rng = np.random.default_rng([seed, 29])
    cut, (slowest, fastest), _ = random_cut(rng)
    options = [text for key, (name, scale) in OPTIONS.items() if key in cut for text in (name, f"{scale * cut[key]:.9g}")]
    options += ["--direction", cut["direction"]]
    speed = float(rng.uniform(slowest, fastest))
    if seed % 3 == 0:
        file = folder / "machine.yaml"
        subprocess.run([sys.executable, "-m", "toolpoint", "new", "machine", str(file), "--template", TEMPLATE], check=True,
                       capture_output=True)
        options += ["--speed", f"{speed:.6g}", "--depth", f"{rng.uniform(0.5, 10):.6g}"]
        return [str(file), *options], machine_dynamics(io.read_machine(file)), cut
    tip, _ = random_tip(rng, 0.3)
    io.write_noun(tip.modes, folder / "modes.h5")
    problem = build_problem(modal_dynamics(tip.modes), cut)[0]
    chart = stability.chart(problem, np.array([speed]), PanelArnoldi(first_only=True), depth_max=10 * depth_limit(problem))
    limit = min(float(chart.limit[0]), chart.depth_max)
    factor = float(rng.uniform(0.3, 2.0))
    factor += np.sign(factor - 1) * NEAR if abs(factor - 1) < NEAR else 0.0
    options += ["--speed", f"{speed:.6g}", "--depth", f"{1e3 * factor * limit:.6g}"]
    return ["--modes", str(folder / "modes.h5"), *options], modal_dynamics(tip.modes), cut


def is_stable_in_contact(arguments: list[str], dynamics: ToolDynamics, cut: dict[str, Any]) -> bool:
    """Return whether the same cut is stable in time with its edges kept in contact."""
    speed, depth = (float(arguments[arguments.index(name) + 1]) for name in ("--speed", "--depth"))
    problem = build_problem(dynamics, cut, in_time=True)[0].changed(feed_per_tooth=1e-4)
    running = RunningCut(problem, speed, 1e-3 * depth, method=ExactSteps(keeps_contact=True), kept=KEPT_STEPS)
    return run_until_decided(running, FIRST_REVOLUTIONS, MAX_REVOLUTIONS).verdict().state == "stable"


def call(arguments: list[str], folder: Path) -> dict[str, Any]:
    """Return what `mill` says, with CPU seconds and peak memory (MB)."""
    out = (folder / "out.json").open("w")
    process = subprocess.Popen([sys.executable, "-m", "toolpoint", "mill", *arguments, "--json", "-o", str(folder / "page")],
                               stdout=out, stderr=subprocess.PIPE)
    _, status, usage = os.wait4(process.pid, 0)
    text = (folder / "out.json").read_text()
    if os.waitstatus_to_exitcode(status):
        return {"error": process.stderr.read().decode()[-300:] if process.stderr else ""}
    page = sum(path.stat().st_size for path in (folder / "page").rglob("*.html"))
    return {**json.loads(text), "seconds": usage.ru_utime + usage.ru_stime, "megabytes": usage.ru_maxrss / 1024,
            "page_megabytes": page / 1e6}


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.json()
    parser.cases("cuts", 100)
    parser.seed(0, "first")
    options = parser.parse_args()
    outcomes: Counter[str] = Counter()
    seconds, memory, pages = [], [], []
    begun = time.perf_counter()
    for seed in range(options.first, options.first + options.cuts):
        with tempfile.TemporaryDirectory() as folder:
            arguments, dynamics, cut = random_call(seed, Path(folder))
            said = call(arguments, Path(folder))
        if "error" in said or said["multiplier"] is None:
            outcomes["failed"] += 1
            print(f"  failed: {seed} {' '.join(arguments)}: {said.get('error', said.get('reason'))}", flush=True)
            continue
        expected = "stable" if said["chart_stable"] else "chatter"
        outcome = "right" if said["state"] == expected else "wrong"
        if said["state"] in ("undecided", "withheld"):
            outcome = said["state"]
        if outcome == "wrong" and said["chart_stable"] and is_stable_in_contact(arguments, dynamics, cut):
            outcome = "subcritical"
        outcomes[outcome] += 1
        seconds.append(said["seconds"])
        memory.append(said["megabytes"])
        pages.append(said["page_megabytes"])
        print(f"{seed}: {outcome}, {said['seconds']:.1f} s, {said['megabytes']:.0f} MB", file=sys.stderr, flush=True)
        if outcome != "right":
            print(f"  {outcome}: {seed} said {said['state']}, multiplier {said['multiplier']:.5f}, limit "
                  f"{said['stability_limit_m']}, {said['reason']}; {' '.join(arguments)}", flush=True)
    results = {**outcomes, "median seconds": round(float(np.median(seconds)), 2), "most seconds": round(max(seconds), 1),
               "most MB": round(max(memory)), "largest page MB": round(max(pages), 2),
               "wall seconds": round(time.perf_counter() - begun)}
    print(json.dumps(results) if options.json else "\n".join(f"{name:16s} {value}" for name, value in results.items()))


if __name__ == "__main__":
    main()
