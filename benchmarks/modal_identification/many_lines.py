"""CPU seconds of the identification of FRFs of very many lines, without a band; last line: one FRF, nine FRFs.

Run: python benchmarks/modal_identification/many_lines.py --lines 51201
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.modal_identification import identify
from toolpoint.vibration import Frf, Modes, frequency_response


def measured(points: int, lines: int, seed: int) -> Frf:
    """Ten modes between 100 and 4800 Hz at some points, struck at the first; noise of 1 % of the root mean square."""
    rng = np.random.default_rng(seed)
    frequency = np.sort(rng.uniform(100, 4800, 10))
    modes = Modes(frequency, 10 ** rng.uniform(-2.5, -1.5, 10), rng.standard_normal((points, 10)),
                  [f"{k}:+x" for k in range(1, points + 1)])
    frf = frequency_response.modal(modes, np.linspace(1, 5120, lines)).selected(range(points), [0])
    pair = rng.standard_normal(frf.values.shape) + 1j * rng.standard_normal(frf.values.shape)
    level = 0.01 * np.sqrt((np.abs(frf.values) ** 2).mean() / 2)
    return Frf(frf.frequency, frf.values + level * pair, frf.outputs, frf.inputs, "receptance")


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("--lines", type=int, default=51_201)
    lines = parser.parse_args().lines
    seconds = []
    for points in (1, 9):
        frf = measured(points, lines, 0)
        start = time.process_time()
        count = identify(frf).modes.count
        seconds.append(time.process_time() - start)
        print(f"{points} FRFs of {lines} lines: {count} of 10 modes (the weakest are below the noise), {seconds[-1]:.1f} s")
    print(f"{seconds[0]:.1f} s, {seconds[1]:.1f} s")


if __name__ == "__main__":
    main()
