"""Real responses identified in several bands: are the differences of the same modes within their intervals?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/modal_identification/real_bands.py

The measured tool holder (`../shared/data/tool_holder_frf`, five points); every pair of bands, every mode that both show
(nearest within a half-power width, shapes alike). Beside it what the covariance of the fit alone would have said.
"""

from __future__ import annotations

import itertools
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, measured_data
from toolpoint.io.text import frf_table
from toolpoint.modal_identification import identify
from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.correlation import mac

BANDS = ((500, 4000), (300, 4500), (700, 3200), (400, 5000), (900, 3000), (600, 3500), (800, 4200), (500, 3000))


def measured() -> Frf:
    """Return the responses of the five points."""
    parts = [frf_table.read(measured_data("tool_holder_frf") / f"Point_{i}_Channel_1_CH1.txt") for i in range(1, 6)]
    values = np.concatenate([part.values for part in parts], axis=1)
    return Frf(parts[0].frequency, values, [f"{i}:+x" for i in range(1, 6)], ["1:+x"])


def pairs(first: Modes, second: Modes) -> list[tuple[int, int]]:
    """Return the modes that both show."""
    away, alike = np.abs(first.frequency[:, None] - second.frequency), mac(first.shape, second.shape)
    near = (away < (first.damping_ratio * first.frequency)[:, None]) & (alike > 0.8)
    return [(i, int(np.where(near[i], away[i], np.inf).argmin())) for i in range(first.count) if near[i].any()]


def main(words: Sequence[str] | None = None) -> None:
    """Run and print; the figure last."""
    parser = CommandLine(__doc__)
    parser.cases("bands", len(BANDS))
    options = parser.parse_args(words)
    warnings.simplefilter("ignore")
    frf = measured()
    results = [identify(frf, band=band) for band in BANDS[:options.bands]]
    inside, alone = [], []
    for a, b in itertools.combinations(results, 2):
        moved = [r.steadiness.moved if r.steadiness is not None else np.zeros((r.modes.count, 2)) for r in (a, b)]
        for i, j in pairs(a.modes, b.modes):
            if a.doubtful[i] or b.doubtful[j]:
                continue
            difference = np.array([a.modes.frequency[i] - b.modes.frequency[j],
                                   a.modes.damping_ratio[i] - b.modes.damping_ratio[j]])
            variance = [np.diag(r.modes.covariance[k]) for r, k in ((a, i), (b, j))]
            fit = [v - m[k] ** 2 for v, m, k in zip(variance, moved, (i, j), strict=True)]
            inside.append(np.abs(difference) < 1.96 * np.sqrt(variance[0] + variance[1]))
            alone.append(np.abs(difference) < 1.96 * np.sqrt(np.maximum(fit[0] + fit[1], 0)))
    print(f"{len(inside)} pairs of modes; by the fit's covariance alone: frequency {100 * np.mean(alone, axis=0)[0]:.0f} %, "
          f"damping {100 * np.mean(alone, axis=0)[1]:.0f} %")
    print(f"differences within 95 % intervals: frequency {100 * np.mean(inside, axis=0)[0]:.1f} %, damping "
          f"{100 * np.mean(inside, axis=0)[1]:.1f} % of {len(inside)}")


if __name__ == "__main__":
    main()
