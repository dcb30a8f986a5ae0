"""Spindle power beside the program that was computed: where it lies, and what the coefficient of the material is."""

import numpy as np

from toolpoint import studies
from toolpoint.io.program.gcode import parse
from toolpoint.studies.machining.recorded.spindle_load import spindle_load

HIDDEN_FACTOR = 1.25  # of K_t, in the "machine" that is recorded
PASSES = "\n".join(f"G0 X-7 Y{y} Z-{z}\nG1 X60 F{f}\nG0 Z8" for y, z, f in (
    (4, 1, 900), (11, 3, 1800), (17, 2, 2400), (26, 4, 1200), (31, 1.5, 3000), (39, 3.5, 600)))


def main() -> float:
    """Return K_t by the record over the true one, after a record with noise, an idle load and an override of 90 %."""
    cut = studies.cuts_of_options(None, {"diameter": 0.01, "teeth": 4, "tangential": 8e8, "normal": 3e8,
                                         "edge_tangential": 1.5e4})
    setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.02, 0.05, 0.045, 0)), cut, spacing=5e-4)
    result = studies.run_program(parse("S9000\n" + PASSES, start=(0, 0, 0.1)), setup)
    load = spindle_load(result.laid, result.removed, result.loads, setup=setup, step=0.01)
    time = np.arange(0, load.time[-1] / 0.9 + 2, 0.01)
    power = 0.9 * HIDDEN_FACTOR * load.shearing + load.edges
    recorded = 350 + np.interp(0.9 * (time - 1), load.time, power, left=0, right=0)
    recorded += np.random.default_rng(0).normal(0, 15, time.size)
    record = studies.compare_record(result, time, recorded, unit="W", name="spindle power").record
    print(record.table())
    return record.fit.factor / HIDDEN_FACTOR


if __name__ == "__main__":
    main()
