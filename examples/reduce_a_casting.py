"""A hollow column on springs, reduced by three methods: how far each is off in the modes of the whole."""

import numpy as np
from scipy.linalg import block_diag

from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Patch
from toolpoint.substructuring import ActingLoads, CraigBampton, LargeBody, ResidualFlexibility, reduce
from toolpoint.substructuring.estimate import Surroundings, couple_reduced

SIZE, WALL, MODES, BAND = np.array([0.5, 0.16, 0.9]), 0.02, 6, 700.0


def main() -> float:
    """Return the largest relative error of a frequency by responses to the acting loads, against a band three times as wide."""
    cuboids = (Cuboid([0, 0, 0], SIZE), Cuboid([WALL] * 3, SIZE - WALL, is_window=True))
    model = Casting(cuboids, {"body": CAST_IRON}).meshed(0.25)
    x, y, z = SIZE
    foot = Patch([x / 2, y / 2, 0], [1, 0, 0], [0, -1, 0], 0.1, 0.1)
    top = Patch([x / 2, y / 2, z], [1, 0, 0], [0, 1, 0], 0.1, 0.1)
    loads = np.hstack([patch.averages(model).toarray() for patch in (foot, top)])
    springs = np.diag(np.tile([3e8, 5e8, 2e8, 3e6, 2e6, 4e6], 2))
    head = np.diag([60, 60, 60, 1.2, 1.8, 0.6])  # a mass on the upper springs; the lower ones stand on the ground
    stiffness = np.block([[springs, -springs[:, 6:]], [-springs[6:], springs[6:, 6:]]])
    around = Surroundings(stiffness, block_diag(np.zeros((12, 12)), head))
    body = LargeBody(model.stiffness(), model.mass(), loads, model.rigid_motion(), np.sqrt(np.diag(springs)))
    truth = couple_reduced(reduce(body, ActingLoads(3 * BAND)), around, MODES).frequency
    errors = {}
    for method in (ActingLoads(BAND), CraigBampton(BAND), ResidualFlexibility(BAND)):
        solved = couple_reduced(reduce(body, method), around, MODES)
        errors[type(method).__name__] = float(np.abs(solved.frequency / truth - 1).max())
        print(f"{type(method).__name__}: error {errors[type(method).__name__]:.1e}")
    return errors["ActingLoads"]


if __name__ == "__main__":
    main()
