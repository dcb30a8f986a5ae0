"""Where to measure and strike a machine, what to expect, and the files for it (as `toolpoint plan machine.yaml`)."""

import tempfile
from pathlib import Path

import numpy as np

import toolpoint
from toolpoint.io import read_machine
from toolpoint.io.yaml.testing import plan_writing
from toolpoint.pages.testing.test_plan import plan_page
from toolpoint.studies import plan_test

MACHINE = Path(toolpoint.__file__).parent / "app" / "machines" / "three_axis_vertical.yaml"


def main() -> float:
    """Return the least MAC of the shapes that twelve points give, expanded to 131."""
    plan = plan_test(read_machine(MACHINE), 12, rng=np.random.default_rng(1))
    print(plan.table())
    with tempfile.TemporaryDirectory() as folder:
        points, test = Path(folder) / "points.csv", Path(folder) / "test.yaml"
        plan_writing.write_geometry(plan.candidates.coordinates, plan.points, points)
        plan_writing.write_test("mill", plan.struck, test, block=plan.block, geometry=points.name)
        print(test.read_text())
        print(plan_page(plan).save(Path(folder) / "page"))
    return plan.expected.least_mac


if __name__ == "__main__":
    main()
