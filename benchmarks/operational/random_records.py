"""Operational modal analysis of random machines at work: modes, harmonics, intervals; beside pyOMA2 where it is installed.

The records: benchmarks/operational/machines_at_work.py, ten minutes each. A mode counts as found within half its half-power
width. Found by pyOMA2 are the poles that it picks where it is told to look (the true frequencies, `order_in="find_min"`), at
its default settings and at 40 block rows, order 60: it has no automatic choice of modes and takes off no harmonics.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 \
        python benchmarks/operational/random_records.py [--first 0] [--machines 100] [--peer]

The last line is the figure.
"""

from __future__ import annotations

import contextlib
import io
import logging
import resource
import sys
import time
import warnings
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, needed_peer
from benchmarks.operational.machines_at_work import Work, random_work
from toolpoint.modal_identification import identify_operational
from toolpoint.vibration.correlation import mac

HARMONIC_TOLERANCE = 1e-3  # relative, between a line and the harmonic that it is

PEER_SETTINGS = {"pyOMA2, 20 rows (its default), order 40": {"br": 20, "ordmax": 40},
                 "pyOMA2, 40 rows, order 60": {"br": 40, "ordmax": 60}}


@dataclass
class Score:
    """What one program found on all machines so far."""

    name: str
    expected: int = 0
    found: int = 0
    false: int = 0
    harmonics_as_modes: int = 0
    frequency_errors: list[float] = field(default_factory=list)
    damping_errors: list[float] = field(default_factory=list)
    likeness: list[float] = field(default_factory=list)
    frequency_inside: list[bool] = field(default_factory=list)
    damping_inside: list[bool] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, work: Work, frequency: np.ndarray, damping: np.ndarray, shape: np.ndarray,
            intervals: np.ndarray | None) -> None:
        """Take the modes of one machine; `intervals` (n, 2) are 95 % half widths of frequency and damping ratio."""
        self.expected += work.frequency.size
        free = set(range(frequency.size))
        for k in range(work.frequency.size):
            width = work.damping_ratio[k] * work.frequency[k]
            near = [j for j in free if abs(frequency[j] - work.frequency[k]) < max(
                0.5 * width, 0.0 if intervals is None else 2 * intervals[j, 0])]
            if not near:
                continue
            j = min(near,
                    key=lambda i: abs(frequency[i] - work.frequency[k]) / width + abs(damping[i] / work.damping_ratio[k] - 1))
            free.remove(j)
            self.found += 1
            self.frequency_errors.append(abs(frequency[j] / work.frequency[k] - 1))
            self.damping_errors.append(abs(damping[j] / work.damping_ratio[k] - 1))
            self.likeness.append(float(mac(shape[:, [j]], work.shape[:, [k]])[0, 0]))
            if intervals is not None:
                self.frequency_inside.append(bool(abs(frequency[j] - work.frequency[k]) < intervals[j, 0]))
                self.damping_inside.append(bool(abs(damping[j] - work.damping_ratio[k]) < intervals[j, 1]))
        as_harmonic = [j for j in free if (np.abs(work.harmonics / frequency[j] - 1) < HARMONIC_TOLERANCE).any()]
        self.harmonics_as_modes += len(as_harmonic)
        self.false += len(free)

    def line(self) -> str:
        """Return the figures so far as a line."""
        text = (f"{self.name}: {self.found} of {self.expected} modes ({100 * self.found / max(self.expected, 1):.1f} %), "
                f"{self.false} false, {self.harmonics_as_modes} harmonics as modes; errors (median, 95 %) frequency "
                + _quantiles(self.frequency_errors) + ", damping " + _quantiles(self.damping_errors)
                + f"; MAC (median, 5 %) {np.median(self.likeness):.4f}, {np.quantile(self.likeness, 0.05):.3f}")
        if self.frequency_inside:
            text += (f"; intervals hold {100 * np.mean(self.frequency_inside):.1f} % (frequency), "
                     f"{100 * np.mean(self.damping_inside):.1f} % (damping)")
        return text + f"; {self.seconds:.1f} CPU s"


def _quantiles(errors: list[float]) -> str:
    return f"{100 * np.median(errors):.3f} %, {100 * np.quantile(errors, 0.95):.3f} %"


def run_toolpoint(work: Work, score: Score) -> int:
    """Identify one record; return the number of harmonics that were found among the true ones."""
    start = time.process_time()
    found = identify_operational(work.record)
    score.seconds += time.process_time() - start
    modes = found.modes
    score.add(work, modes.frequency, modes.damping_ratio, modes.shape,
              np.stack([modes.frequency_interval, modes.damping_interval], axis=1))
    lines = np.array([h.frequency for h in found.harmonics])
    return sum(bool((np.abs(lines / f - 1) < HARMONIC_TOLERANCE).any()) for f in work.harmonics)


def run_peer(work: Work, score: Score, settings: dict[str, int]) -> None:
    """Identify one record with pyOMA2's covariance-driven SSI, told the true frequencies."""
    algorithms, setups = needed_peer("pyoma2.algorithms"), needed_peer("pyoma2.setup")
    logging.disable(logging.CRITICAL)
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        setup = setups.SingleSetup(work.record.samples, fs=work.record.sample_rate)
        setup.add_algorithms(algorithms.SSI(name="ssi", **settings))
        setup.run_by_name("ssi")
        frequency, damping, shape = [], [], []
        for target in work.frequency:
            try:
                setup.mpe("ssi", sel_freq=[float(target)], order_in="find_min")
            except Exception:  # the program has no pole that is stable there
                continue
            result = setup["ssi"].result
            values = np.ravel(result.Fn), np.ravel(result.Xi)
            if values[0].size and np.isfinite(values[0]).all() and np.isfinite(values[1]).all():
                frequency.append(float(values[0][0]))
                damping.append(float(values[1][0]))
                shape.append(np.asarray(result.Phi).reshape(work.shape.shape[0], -1)[:, 0])
    score.seconds += time.process_time() - start
    if frequency:
        score.add(work, np.array(frequency), np.array(damping), np.array(shape).T, None)
    else:
        score.expected += work.frequency.size


def main() -> None:
    """Run the machines and print the figures as they come."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("machines", 100)
    parser.add_argument("--peer", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    mine = Score("toolpoint")
    peers = PEER_SETTINGS if options.peer else {}
    scores = {name: Score(name) for name in peers}
    harmonics = detected = 0
    for seed in range(options.first, options.first + options.machines):
        work = random_work(seed)
        detected += run_toolpoint(work, mine)
        harmonics += work.harmonics.size
        for name, settings in peers.items():
            run_peer(work, scores[name], settings)
        print(f"{seed + 1:4d} {mine.line()}; harmonics {detected} of {harmonics}", flush=True)
        for score in scores.values():
            if (seed + 1) % 10 == 0:
                print("     " + score.line(), flush=True)
    for score in scores.values():
        print(score.line())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"{mine.line()}; harmonics {detected} of {harmonics} found; {memory:.0f} MB with the records")


if __name__ == "__main__":
    main()
