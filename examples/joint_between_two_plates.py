"""The joint of two plates from their mode shapes alone, the plates found from the shapes, too."""

import numpy as np

from toolpoint.joint_identification import JointEstimate, JointIdentification, group_points, identify_joints
from toolpoint.vibration import Modes

HINGE = np.array([1.5, 0.2, 0.0])  # m, on its axis along z


def shapes(rng: np.random.Generator) -> tuple[Modes, dict[int, np.ndarray]]:
    """Return three modes of two plates, the second turned about the hinge, with 0.1 % of noise; and the points' places."""
    places = rng.uniform(0, 1, (16, 3)) + np.repeat([[0, 0, 0], [2, 0, 0]], 8, axis=0)
    move, turn, angle = rng.standard_normal((3, 3)), rng.standard_normal((3, 3)), np.array([1.0, -2.0, 0.5])
    motion = move[:, None] + np.cross(turn[:, None], places)
    motion[:, 8:] += angle[:, None, None] * np.cross([0, 0, 1], places[8:] - HINGE)
    shape = motion.reshape(3, -1).T
    shape = shape + 1e-3 * np.sqrt((shape**2).mean(axis=0)) * rng.standard_normal(shape.shape)
    dofs = [f"{point}:+{way}" for point in range(16) for way in "xyz"]
    return Modes([50.0, 80.0, 120.0], 0.02, shape, dofs), dict(enumerate(places))


def main() -> float:
    """Return the distance of the joint from the true axis, mm."""
    modes, places = shapes(np.random.default_rng(1))
    plates = group_points(modes, places, noise=1e-3).components
    found: JointIdentification = identify_joints(modes, places, plates, chain=list(plates))
    print(found.table())
    joint: JointEstimate = found.joints[0]
    assert joint.kind == "hinge" and abs(joint.axis[2]) > 0.999
    return 1e3 * float(np.linalg.norm((joint.position - HINGE)[:2]))


if __name__ == "__main__":
    main()
