"""Chatter judged by the sound of random cuts: verdicts, frequency, speed, speeds to try, against the simulated truth."""

from __future__ import annotations

import json
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.listening.heard_cuts import HeardCut, cuts
from toolpoint import ToolpointWarning
from toolpoint.cutting import stability
from toolpoint.studies import SpindleRange, listen
from toolpoint.studies.listening.listened_cut import ListenedCut

FREQUENCY_TOLERANCE, SPEED_TOLERANCE = 5e-3, 2e-3  # relative
SPEED_MARGIN = 0.005  # relative: a speed exists where this much beside it is stable as well
HIGHEST_RATIO = 1.5  # of the spindle's highest speed over the present one
SEARCHED_SPEEDS = 40  # speeds among which a stable one is looked for
DEPTH_MAX_RATIO = 1.5  # of the charts over the cut's depth


def judge_speeds(cut: HeardCut, result: ListenedCut) -> tuple[bool, bool, bool]:
    """Return whether a stable speed exists, whether the first proposed one is stable, and whether one of the first three is."""
    highest = HIGHEST_RATIO * cut.speed
    grid = np.linspace(0.3 * highest, highest, SEARCHED_SPEEDS)
    is_stable = _stable(cut, grid)
    exists = bool((is_stable[:-2] & is_stable[1:-1] & is_stable[2:]).any())
    proposed = np.array([each.speed for each in result.speeds[:3]])
    if not exists or proposed.size == 0:
        return exists, False, False
    right = _stable(cut, proposed)
    return exists, bool(right[0]), bool(right.any())


def _stable(cut: HeardCut, speeds: np.ndarray) -> np.ndarray:
    chart = stability.chart(cut.problem, speeds, depth_max=DEPTH_MAX_RATIO * cut.depth)
    return np.asarray(chart.stable([cut.depth]))[:, 0].astype(bool)


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.json()
    parser.cases("cuts", 150)
    parser.seed(2000)
    parser.add_argument("--no-speeds", action="store_true", help="leave the charts of proposed speeds out")
    options = parser.parse_args()
    warnings.simplefilter("ignore", ToolpointWarning)
    start, counts = time.perf_counter(), Counter[str]()
    for number, cut in cuts(options.cuts, options.seed):
        highest = HIGHEST_RATIO * cut.speed
        result = listen(cut.record, cut.problem.tool.teeth, cut.programmed, spindle=SpindleRange(highest))
        _count(counts, cut, result, not options.no_speeds)
        print(f"{number}: {'chatter' if cut.chatters else 'stable'}, heard {result.verdict} ({result.probability:.2f}), "
              f"{'' if result.line is None else f'{result.line.frequency:.1f} for {cut.chatter_frequency:.1f} Hz, '}"
              f"speed {100 * (result.evidence.speed.frequency / cut.spindle - 1):+.3f} %"
              f"{' searched' if cut.programmed is None else ''}, {', '.join(cut.faults) or 'clean'} | {_summary(counts)}",
              flush=True)
    seconds = time.perf_counter() - start
    print(json.dumps({**counts, "seconds": round(seconds, 1)}) if options.json else f"{_summary(counts)}; {seconds:.0f} s")


def _count(counts: Counter[str], cut: HeardCut, result: ListenedCut, with_speeds: bool) -> None:
    counts["cuts"] += 1
    counts["right"] += result.chatters == cut.chatters
    counts["undecided"] += result.chatters is None
    known = "searched" if cut.programmed is None else "given"
    counts[f"{known} wrong"] += result.chatters is not None and result.chatters != cut.chatters
    counts[f"{known} undecided"] += result.chatters is None
    off = abs(result.evidence.speed.frequency / cut.spindle - 1)
    counts[known] += 1
    counts[f"{known} speed"] += off < SPEED_TOLERANCE
    if cut.chatters and result.chatters and result.line is not None:
        lines = np.array([result.line.frequency, *result.line.others])
        near = np.abs(lines / cut.chatter_frequency - 1) < FREQUENCY_TOLERANCE
        counts["lines"] += 1
        counts["named"] += bool(near[0])
        counts["among"] += bool(near.any())
        if with_speeds:
            exists, first, several = judge_speeds(cut, result)
            counts["speeds exist"] += exists
            counts["first stable"] += exists and first
            counts["one of three stable"] += exists and several


def _summary(counts: Counter[str]) -> str:
    decided = counts["cuts"] - counts["undecided"]
    return (f"right {_share(counts['right'], decided)} of {decided} decided, cannot tell "
            f"{_share(counts['undecided'], counts['cuts'])} of {counts['cuts']} (speed given: {counts['given wrong']} wrong, "
            f"{counts['given undecided']} open of {counts['given']}); frequency named "
            f"{_share(counts['named'], counts['lines'])}, among the side bands {_share(counts['among'], counts['lines'])}; "
            f"speed given {_share(counts['given speed'], counts['given'])}, searched "
            f"{_share(counts['searched speed'], counts['searched'])}; first speed stable "
            f"{_share(counts['first stable'], counts['speeds exist'])}, one of three "
            f"{_share(counts['one of three stable'], counts['speeds exist'])} of {counts['speeds exist']}")


def _share(part: int, total: int) -> str:
    return f"{100 * part / max(total, 1):.1f} %"


if __name__ == "__main__":
    main()
