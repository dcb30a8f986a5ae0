"""Chatter frequency named by the sound alone, without the modes of the tool: how often rightly, and how often doubted.

    python benchmarks/listening/named_lines.py --cuts 40 --seed 1

The cuts are those of `heard_cuts.py` that chatter; the truth is the strongest line of the motion beside the orders.
The last line counts the lines named rightly, those of them that are doubted, and those named wrongly and doubted.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.listening.heard_cuts import hear, random_cut
from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.studies import listen

FREQUENCY_TOLERANCE = 0.01  # relative, of a line named rightly: recordings drift


def main() -> None:
    """Draw, listen, count."""
    parser = CommandLine(__doc__)
    parser.cases("cuts", 40)
    parser.seed(1)
    parser.add_argument("--seconds", type=float, default=540.0, help="stop after this time")
    options = parser.parse_args()
    warnings.simplefilter("ignore", ToolpointWarning)
    rng, begun, rows = np.random.default_rng(options.seed), time.monotonic(), list[tuple[bool, bool]]()
    while len(rows) < options.cuts and time.monotonic() - begun < options.seconds:
        drawn = random_cut(rng)
        if drawn is None or drawn[0].verdict().state != "chatter":
            continue
        cut = hear(drawn[0], drawn[1], rng)
        try:
            result = listen(cut.record, cut.problem.tool.teeth, speed=cut.programmed)
        except ToolpointError:
            continue
        if result.line is None:
            continue
        rows.append((abs(result.line.frequency / cut.chatter_frequency - 1) < FREQUENCY_TOLERANCE, bool(result.line.rivals)))
        print(f"true {cut.chatter_frequency:.1f} Hz, named {result.line.frequency:.1f} Hz, "
              f"{'doubted' if rows[-1][1] else 'not doubted'}", flush=True)
    rightly = [doubted for is_right, doubted in rows if is_right]
    wrongly = [doubted for is_right, doubted in rows if not is_right]
    print(f"named rightly: {len(rightly)} of {len(rows)}, {sum(rightly)} of them doubted; named wrongly: {len(wrongly)}, "
          f"{sum(wrongly)} of them doubted")


if __name__ == "__main__":
    main()
