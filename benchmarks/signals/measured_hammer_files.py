"""Measured files as they come, nobody choosing a band: modes beside those picked by hand, and how many are marked.

`../shared/data/tool_holder_frf` (five text FRFs, not renamed): its author picked 1074, 1961 and 2617 Hz with
3.40, 4.54 and 3.40 %.
`../shared/data/beam_hammer` (one raw record): picked here by hand from the record itself, by the decay of the acceleration in a
band of 8 % about each clear peak (slope of the logarithm of its envelope, between 2 % and 25 % of the block).
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.signal import butter, hilbert, sosfiltfilt

from benchmarks.frame import CommandLine, measured_data
from toolpoint.io import read_frf, read_records
from toolpoint.studies.measured.hammer_study import study_hammer_records
from toolpoint.studies.measured.identification import identify_modes

HOLDER = ((1074.0, 0.0340), (1961.0, 0.0454), (2617.0, 0.0340))
PEAKS = (695.6, 1898.0, 3671.0, 5974.0)  # Hz, read off the spectrum of the acceleration


def pick_by_decay(record, peak: float) -> tuple[float, float]:
    """Return frequency and damping ratio of one peak from the decay of the acceleration about it."""
    acceleration = record.samples[:, record.quantities.index("acceleration")]
    sos = butter(4, [0.96 * peak, 1.04 * peak], "bandpass", fs=record.sample_rate, output="sos")
    signal = hilbert(sosfiltfilt(sos, acceleration))
    n = signal.size
    part = slice(int(0.02 * n), int(0.25 * n))
    time = record.time[part]
    size, phase = np.abs(signal[part]), np.unwrap(np.angle(signal[part]))
    loud = size > 0.02 * size.max()
    decay = -np.polyfit(time[loud], np.log(size[loud]), 1, w=size[loud])[0]
    omega = np.polyfit(time[loud], phase[loud], 1, w=size[loud])[0]
    natural = float(np.hypot(omega, decay))
    return natural / (2 * np.pi), float(decay / natural)


def compare(name: str, result, picked) -> list[tuple[float, float]]:
    """Print every picked mode beside the nearest one that stands out, and return relative differences."""
    modes, differences = result.modes, []
    for frequency, ratio in picked:
        k = min(result.dominant, key=lambda i: abs(modes.frequency[i] / frequency - 1))
        pair = modes.frequency[k] / frequency - 1, modes.damping_ratio[k] / ratio - 1
        differences.append(pair)
        print(f"{name}: picked {frequency:8.1f} Hz {100 * ratio:6.3f} %; identified {modes.frequency[k]:8.1f} Hz "
              f"{100 * modes.damping_ratio[k]:6.3f} % ({100 * pair[0]:+.2f} %, {100 * pair[1]:+.1f} %)")
    print(f"{name}: {modes.count} modes, {int(result.doubtful.sum())} marked doubtful, band {result.frf.frequency[0]:.0f} .. "
          f"{result.frf.frequency[-1]:.0f} Hz")
    return differences


def main() -> None:
    """Compare both measurements."""
    CommandLine(__doc__).parse_args()
    warnings.simplefilter("ignore")
    holder = read_frf(sorted(measured_data("tool_holder_frf").glob("*.txt")), pattern="Point_{output}_*")
    every = compare("tool holder", identify_modes(holder), HOLDER)
    records = read_records(measured_data("beam_hammer", "acceleration.lvm"))
    study = study_hammer_records(records)
    picked = [pick_by_decay(records.records[0], peak) for peak in PEAKS]
    every += compare("beam", identify_modes(study.frf, band=study.band.ends), picked)
    near = sum(abs(f) <= 0.01 for f, _ in every)
    damped = sum(abs(z) <= 0.15 for _, z in every)
    print(f"{near} of {len(every)} frequencies within 1 %, {damped} of {len(every)} damping ratios within 15 % of those picked "
          "by hand")


if __name__ == "__main__":
    main()
