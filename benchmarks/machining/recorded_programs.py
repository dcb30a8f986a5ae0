"""Records of random programs with a hidden coefficient: how often its 95 % interval holds it, and wrong records doubted.

    python benchmarks/machining/recorded_programs.py --records 200 --seed 1
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.program.gcode import parse
from toolpoint.material_removal import Stock
from toolpoint.studies.machining.recorded.spindle_load import SpindleLoad, spindle_load
from toolpoint.studies.machining.result import MachiningStudy

MM = 1e-3
STOCK = Stock.box(np.array([0, 0, -20]) * MM, np.array([80, 60, 0]) * MM)
PROGRAMS_PER_SEED = 20  # different programs; each is recorded many times


def program(rng: np.random.Generator) -> str:
    """Return passes of random depth, width and feed, and now and then a pocket's arc."""
    lines, y, z = [f"S{rng.integers(5, 14) * 1000} M3"], 2.0, 0.0
    for _ in range(int(rng.integers(8, 20))):
        y, z = (y + rng.uniform(2, 9), z) if y < 48 else (2.0, z - 3)
        lines += [f"G0 X-7 Y{y:.3f} Z{z - rng.uniform(0.5, 4):.3f}",
                  f"G1 X{rng.uniform(25, 55):.2f} F{rng.integers(6, 30) * 100}",
                  f"X87 F{rng.integers(6, 30) * 100}", "G0 Z8"]
    return "\n".join(lines)


def run(rng: np.random.Generator) -> MachiningStudy:
    """Return a random program, computed with a material whose coefficients are of a table."""
    cut = CuttingDescription.of(diameter=0.01, teeth=int(rng.integers(2, 5)), tangential=8e8, normal=3e8, edge_tangential=1.5e4,
                                flute_length=0.03)
    return studies.run_program(parse(program(rng), start=(0, 0, 0.1)), studies.describe_machining(STOCK, cut, spacing=0.5 * MM))


def record(load: SpindleLoad, rng: np.random.Generator, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a record: hidden factors, idle load, override, delays of rapids, blocks that scatter, noise with memory."""
    edge, pace = rng.normal(1.0, 0.5), rng.uniform(0.8, 1.1)
    scatter = rng.uniform(0.0, 0.06)
    share = 1 + rng.normal(0, scatter, load.block.max() + 1)[load.block]
    power = share * (factor * pace * load.shearing + max(edge, 0.05) * load.edges)
    idle = load.total <= 0
    begins = np.flatnonzero(idle[1:] & ~idle[:-1])
    time = load.time.copy()
    for k in begins:
        time[k + 1:] += rng.uniform(0, 0.2)  # a rapid takes longer than planned
    time = time / pace + rng.uniform(0.5, 3)
    step = rng.choice([0.004, 0.01, 0.02])
    clock = np.arange(0, time[-1] + rng.uniform(0.5, 2), step)
    noise = np.empty(clock.size)
    memory, white = rng.uniform(0, 0.8), rng.normal(0, 1, clock.size)
    noise[0] = white[0]
    for k in range(1, clock.size):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * white[k]
    level = rng.uniform(0.02, 0.15) * load.total.max()
    return clock, rng.uniform(100, 800) + np.interp(clock, time, power, left=0, right=0) + level * noise


def main() -> None:
    """Run the records and print what holds."""
    parser = CommandLine(__doc__)
    parser.cases("records", 200)
    parser.seed(1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    results = [run(rng) for _ in range(PROGRAMS_PER_SEED)]
    loads = [spindle_load(r.laid, r.removed, r.loads, setup=r.setup, step=0.005) for r in results if r.loads is not None]
    held, widths, placed, named, wrong, wrong_told = 0, [], 0, 0, 0, 0
    for n in range(options.records):
        k = n % len(results)
        factor = float(rng.uniform(0.6, 1.6))
        compared = studies.compare_record(results[k], *record(loads[k], rng, factor)).record
        assert compared is not None
        if compared.is_placed:
            placed += 1
            low, high = compared.interval
            held += low <= factor * 8e8 <= high
            widths.append((high - low) / 2 / (factor * 8e8))
            named += compared.unexpected.size > 0
        other = studies.compare_record(results[k], *record(loads[(k + 1) % len(loads)], rng, 1.0)).record
        assert other is not None
        wrong += 1
        wrong_told += other.is_placed
    print(f"of {options.records} records {placed} placed; interval holds K_t in {100 * held / placed:.1f} % (median half width "
          f"{100 * np.median(widths):.1f} %); blocks named in {100 * named / placed:.1f} % of good records; "
          f"{wrong_told} of {wrong} records of other programs believed")


if __name__ == "__main__":
    main()
