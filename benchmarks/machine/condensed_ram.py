"""Column, housing and ram, all elastic, condensed to a stated error: coordinates, time a position, error at 21 positions.

    python benchmarks/machine/condensed_ram.py [--error 0.001]

The machine is that of `full_mesh.py`. Run on one thread (OPENBLAS_NUM_THREADS=1). The last line is the time a position, the
stated error, and the largest true one against the reduction before it was condensed.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.machine.full_mesh import SIZES, TRAVEL, machine_text, model_of, write_mesh
from toolpoint.io import read_machine
from toolpoint.machine.assembly.condense import condense_bodies
from toolpoint.machine.frequencies import natural_frequencies

COUNT = 10


def main() -> None:
    """Print sizes, times and errors."""
    line = CommandLine(__doc__)
    line.add_argument("--error", type=float, default=1e-3)
    error = line.parse_args().error
    with tempfile.TemporaryDirectory() as folder:
        for name in SIZES:
            write_mesh(Path(folder) / f"{name}.inp", model_of(name, 0.1))
        (Path(folder) / "machine.yaml").write_text(machine_text())
        machine = read_machine(Path(folder) / "machine.yaml")
    begin = time.process_time()
    result = condense_bodies(machine, error=error)
    print(f"{result!r}, {time.process_time() - begin:.1f} CPU s")
    positions = {"Z": np.linspace(-TRAVEL, TRAVEL, 21)}
    frequencies = []
    for each in (machine, result.machine):
        natural_frequencies(each, {"Z": np.zeros(2)}, COUNT)
        wall, cpu = time.perf_counter(), time.process_time()
        frequencies.append(natural_frequencies(each, positions, COUNT))
        wall, cpu = ((now - then) / 21 for now, then in ((time.perf_counter(), wall), (time.process_time(), cpu)))
        print(f"{each.size} coordinates: {1e3 * wall:.2f} ms of wall time a position, {1e3 * cpu:.2f} ms of CPU")
    true = float(np.abs(frequencies[1] / frequencies[0] - 1).max())
    print(f"{1e3 * cpu:.2f} ms of CPU a position, stated {100 * result.error:.2g} %, true {100 * true:.2g} %")


if __name__ == "__main__":
    main()
