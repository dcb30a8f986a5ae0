"""Stable depths straight from responses along x and y (as `toolpoint lobes --frf-x x.txt --frf-y y.txt`)."""

import tempfile
from pathlib import Path

import numpy as np

from toolpoint.io import read_frf
from toolpoint.io.binary.numpy_arrays import write_frf
from toolpoint.pages.cuts.lobes import lobes_page
from toolpoint.studies import chart_lobes, modal_dynamics, separate_dynamics
from toolpoint.vibration import Modes, frequency_response

CUT = {"diameter": 0.012, "teeth": 2, "direction": "slot", "tangential": 6e8, "normal": 2e8}
SPEEDS = np.linspace(8000.0, 20000.0, 7)


def main() -> float:
    """Return the largest difference of a limit from that of the modes which the responses are of, relative."""
    tip = Modes([900.0, 1100.0], 0.03, np.eye(2) / np.sqrt(0.04), ("tip:+x", "tip:+y"))
    with tempfile.TemporaryDirectory() as folder:
        frf = {}
        for way in ("x", "y"):
            file = Path(folder) / f"{way}.npz"
            label = [f"tip:+{way}"]
            write_frf(frequency_response.modal(tip, np.arange(2.0, 6000.0, 1.0), outputs=label, inputs=label), file)
            frf[way] = read_frf(file)
        result = chart_lobes(separate_dynamics(frf["x"], frf["y"], band=(50, 6000)), CUT, speeds=SPEEDS)
        print(result.table())
        print(lobes_page(result).save(folder))
    exact = chart_lobes(modal_dynamics(tip), CUT, speeds=SPEEDS)
    return float(np.abs(result.chart.limit / exact.chart.limit - 1).max())


if __name__ == "__main__":
    main()
