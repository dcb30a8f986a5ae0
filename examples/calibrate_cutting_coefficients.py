"""Cutting coefficients and run-out from measured forces, with intervals (as `toolpoint calibrate f1.csv f2.csv`)."""

import tempfile

import numpy as np

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.io import read_record
from toolpoint.io.text import record_table
from toolpoint.pages.cuts.calibration import calibration_page
from toolpoint.studies import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

FEEDS = (0.5e-4, 1e-4, 1.5e-4)


def main() -> float:
    """Return the fitted K_t over that of the simulated dynamometer."""
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    material, angle = CuttingCoefficients(7e8, 2e8), 2 * np.pi * 50 * np.arange(2000) / 10000.0
    labels = tuple(Dof("tool", f"+{way}") for way in "xyz")
    with tempfile.TemporaryDirectory() as folder:
        records = []
        for feed in FEEDS:
            problem = MillingProblem(Tool(0.016, 4), Engagement.down(0.5), material, rigid, feed_per_tooth=feed)
            force = rigid_forces(problem, 2e-3, angle).force
            record_table.write(Record(force, 10000.0, labels, ("force",) * 3), f"{folder}/f.csv")
            records.append((f"{feed} m", read_record(f"{folder}/f.csv")))
        test = CuttingTest({"diameter": 0.016, "teeth": 4, "immersion": 0.5}, 3000.0, 2e-3, FEEDS, runout=False)
        result = calibrate(records, test)
        print(result.table())
        print(calibration_page(result).save(folder))
    return result.fit.coefficients.kt / 7e8


if __name__ == "__main__":
    main()
