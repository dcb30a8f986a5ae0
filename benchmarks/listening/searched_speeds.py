"""Calibration of the probability of chatter where the spindle speed is searched, not given: said against true, bin by bin.

    python benchmarks/listening/searched_speeds.py --cuts 60 --seed 4000
    python benchmarks/listening/searched_speeds.py --cuts 120 --seed 4000 --fit     # coefficients of the searched probability

The cuts are those of `random_cuts.py`; none is given its speed. The last line is the largest gap between said and true.
"""

from __future__ import annotations

import itertools
import json
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import scipy.optimize

from benchmarks.frame import CommandLine
from benchmarks.listening.heard_cuts import cuts
from toolpoint import ToolpointError, ToolpointWarning
from toolpoint.studies import listen

BINS = (0.0, 0.1, 0.35, 0.65, 0.9, 1.0)
SPEED_TOLERANCE = 2e-3  # relative


def reliability(said: np.ndarray, truth: np.ndarray) -> list[tuple[float, float, int, float]]:
    """Return mean said, share true, count and standard error of every bin that is not empty."""
    rows = []
    for low, high in itertools.pairwise(BINS):
        inside = (said >= low) & ((said < high) | (high == 1.0))
        if inside.any():
            share = float(truth[inside].mean())
            error = float(np.sqrt(max(share * (1 - share), 0.25 / inside.sum()) / inside.sum()))
            rows.append((float(said[inside].mean()), share, int(inside.sum()), error))
    return rows


def fit(said: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return constant and slope of the log odds that make said probabilities true ones, by penalised likelihood."""
    odds = np.log(np.clip(said, 1e-4, 1 - 1e-4) / (1 - np.clip(said, 1e-4, 1 - 1e-4)))

    def cost(coefficients: np.ndarray) -> float:
        p = 1 / (1 + np.exp(-(coefficients[0] + coefficients[1] * odds)))
        return float(-(truth * np.log(p) + (1 - truth) * np.log(1 - p)).sum() + 0.5 * (coefficients[1] - 1) ** 2
                     + 0.5 * coefficients[0] ** 2)

    return np.asarray(scipy.optimize.minimize(cost, [0.0, 1.0], method="Nelder-Mead").x)


def main() -> None:
    """Draw, listen, print."""
    parser = CommandLine(__doc__)
    parser.cases("cuts", 60)
    parser.seed(4000)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--seconds", type=float, default=540.0, help="stop after this time")
    parser.add_argument("--keep", type=Path, help="write what was said and true here (JSON)")
    options = parser.parse_args()
    warnings.simplefilter("ignore", ToolpointWarning)
    begun, rows = time.monotonic(), []
    for number, cut in cuts(options.cuts, options.seed):
        try:
            result = listen(cut.record, cut.problem.tool.teeth)
        except ToolpointError:
            continue
        is_speed = abs(result.evidence.speed.frequency / cut.spindle - 1) < SPEED_TOLERANCE
        rows.append((result.probability, float(cut.chatters), float(result.chatters is None), float(is_speed)))
        print(number, *(f"{value:.3f}" for value in rows[-1]), flush=True)
        if time.monotonic() - begun > options.seconds:
            break
    table = np.array(rows)
    said, truth, is_open, is_speed = table.T
    if options.keep:
        options.keep.write_text(json.dumps(table.tolist()))
    if options.fit:
        print("coefficients:", np.round(fit(said, truth), 2).tolist())
    bins = reliability(said, truth)
    for mean, share, count, error in bins:
        print(f"said {mean:.2f}: true {share:.2f} ± {error:.2f} of {count}")
    wrong = (is_open == 0) & ((said > 0.5) != (truth > 0.5))
    print(f"{truth.size} cuts, speed found {100 * is_speed.mean():.0f} %, cannot tell {100 * is_open.mean():.0f} %, wrong "
          f"{int(wrong.sum())} of {int((is_open == 0).sum())} decided; Brier score {np.mean((said - truth) ** 2):.3f}; largest "
          f"gap between said and true {max(abs(mean - share) for mean, share, _, _ in bins):.2f}")


if __name__ == "__main__":
    main()
