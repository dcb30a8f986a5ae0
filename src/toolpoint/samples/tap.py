"""Sample of a tap test: blows on a tool tip of two modes a direction, one of them double and one weak."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint.studies.machines.virtual_test import Hammer, Imperfections, hammer_records
from toolpoint.vibration import Modes, Record
from toolpoint.vibration.dof import dofs

HAMMER = Hammer(contact=2e-4, force=300.0, hits=6, block=0.25, sample_rate=12_800.0)
FAULTS = Imperfections(noise=0.01, double_hits=(1,), weak_hits=(4,))
# Frequencies, Hz, and damping ratios of the spindle and of the tool; stiffness of the tool's mode, N/m.
TIP_MODES = {"x": ((640.0, 1120.0), (0.04, 0.03)), "y": ((610.0, 1180.0), (0.04, 0.028))}
TOOL_STIFFNESS, SPINDLE_STIFFNESS = 1.4e7, 4e7


def write(folder: Path) -> tuple[list[str], list[str]]:
    """Write a record of all blows along x and one along y; return what was put in, and the commands."""
    rng = np.random.default_rng(11)
    for direction, (frequency, ratio) in TIP_MODES.items():
        stiffness = np.array([SPINDLE_STIFFNESS, TOOL_STIFFNESS])
        shape = 2 * np.pi * np.array(frequency) / np.sqrt(stiffness)
        modes = Modes(np.array(frequency), np.array(ratio), shape[None], dofs([f"tip:+{direction}"]))
        record = hammer_records(modes, f"tip:+{direction}", [f"tip:+{direction}"], rng=rng, hammer=HAMMER, imperfections=FAULTS)
        # Four decimals are what a front end of 24 bits resolves here; the file stays small.
        rounded = Record(np.round(record.samples, 4), record.sample_rate, record.channels, record.quantities)
        io.write_noun(rounded, folder / f"blows_{direction}.csv")
    truth = ["Along x modes at 640 Hz (4 %, 40 N/um) and 1120 Hz (3 %, 14 N/um), along y at 610 and 1180 Hz (4 and 2.8 %).",
             "Blow 2 of each direction is a double hit; blow 5 is so weak that it counts as none; noise is 1 % of the largest "
             "acceleration."]
    return truth, ["toolpoint tap blows_x.csv --y blows_y.csv --diameter 12 --teeth 4 --direction slot --kt 800 --kn 250",
                   "toolpoint frf blows_x.csv --save tip_x.h5"]
