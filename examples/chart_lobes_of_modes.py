"""Stable depths of a cut from saved modes, with their error, and the page (as `toolpoint lobes --modes modes.h5`)."""

import tempfile

import numpy as np

from toolpoint.io import read_modes, write_nouns
from toolpoint.pages.cuts.lobes import lobes_page
from toolpoint.studies import chart_lobes, modal_dynamics
from toolpoint.vibration import Modes

CUT = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 6e8, "normal": 2e8}


def main() -> float:
    """Return the lowest stable depth, mm; the converged ones of this slot are about 0.0475 mm."""
    tip = Modes([922.0, 922.0], 0.011, np.eye(2) / np.sqrt(0.03993), ("tip:+x", "tip:+y"))
    with tempfile.TemporaryDirectory() as folder:
        write_nouns(tip, f"{folder}/modes.h5")
        result = chart_lobes(modal_dynamics(read_modes(f"{folder}/modes.h5")), CUT, speeds=np.linspace(5000, 25000, 100))
        print(result.table())
        print(lobes_page(result).save(folder))
    return 1e3 * float(result.chart.limit.min())


if __name__ == "__main__":
    main()
