"""Strike the published machine with a virtual hammer at 40 points and find its modes again, with nobody picking poles."""

from importlib import resources

import numpy as np

from toolpoint.io.yaml import machine_file
from toolpoint.modal_identification.identify import identify
from toolpoint.signals.hammer import hammer_test
from toolpoint.signals.setups import join_setups
from toolpoint.studies.machines.virtual_test import Imperfections, hammer_records, surface_points, true_modes
from toolpoint.vibration import Dof


def main() -> float:
    """Return the largest deviation of an identified from a true frequency, in per cent."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = machine_file.read(path)
    rng = np.random.default_rng(7)
    points = surface_points(machine, 40, rng)
    truth = true_modes(machine, points, 0.03)
    share = np.abs(truth.shape) / np.abs(truth.shape).max(axis=0)
    struck = truth.dofs[int(np.argmax(share.min(axis=1)))]
    imperfect = Imperfections(noise=0.02, double_hits=(1,))
    tests = [hammer_test(hammer_records(truth, struck, [Dof(p, d) for d in ("+x", "+y", "+z")], rng=rng, hammer=None,
                                        imperfections=imperfect), 4.0,
                         highest=150) for p in points.places]
    print(tests[0].status)
    found = identify(join_setups([test.frf for test in tests]), band=(5, 150))
    print(found.table())
    return float(100 * np.abs(found.modes.frequency / truth.frequency - 1).max())


if __name__ == "__main__":
    main()
