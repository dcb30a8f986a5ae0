"""One point of a test stated elsewhere than it was measured: is it left out, and are the joints those without the slip.

The machines: benchmarks/joint_identification/joint_machines.py, three to five bodies, six points a body. Their undamped modes
with noise of 1 % of each mode's rms, coordinates within 2 mm (told), masses exact, one random point moved by each of the
distances along a random direction.

    python benchmarks/joint_identification/misplaced_points.py [--first 0] [--seeds 10]
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from benchmarks.joint_identification import joint_machines as jm
from toolpoint.joint_identification import ComponentMass, JointIdentification, identify_joints
from toolpoint.machine import assemble, build
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof, Modes, eigen

DISTANCES = (0.0, 0.02, 0.05, 0.1, 0.2)  # m
NOISE, COORDINATE_DEVIATION, CALIBRATION_DEVIATION = 0.01, 2e-3, 0.01
HALF_WIDTH_DEVIATIONS = 1.96


@dataclass(frozen=True, eq=False)
class Shapes:
    """Modes of a case with noise, points as they are stated, the one that is moved, and the direction of its move."""

    case: jm.Case
    modes: Modes
    points: dict
    moved: str
    way: np.ndarray


def random_shapes(seed: int, per_body: int = 6) -> Shapes:
    """Return the test of a seed; per_body : measured points of a body."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 6))
    case = jm.random_case(seed, "coupled", (count, max(4 * per_body, per_body * count)))
    machine = with_measured_points(case.machine, case.points.coordinates, case.points.components)
    labels = [Dof(point, way) for point in case.points.places for way in ("+x", "+y", "+z")]
    system = assemble(build(replace(machine.description, modal_damping="")), outputs=labels)
    modes = eigen.solve_undamped(replace(system, damping=None, structural_damping=None))
    spread = np.broadcast_to(NOISE * np.sqrt((modes.shape**2).mean(axis=0)), modes.shape.shape)
    shape = modes.shape + spread * rng.standard_normal(spread.shape)
    points = {name: place + COORDINATE_DEVIATION * rng.standard_normal(3) for name, place in case.points.coordinates.items()}
    way = rng.standard_normal(3)
    moved = list(points)[int(rng.integers(len(points)))]
    return Shapes(case, replace(modes, shape=shape, shape_variance=spread**2), points, moved, way / np.linalg.norm(way))


def moved_points(test: Shapes, distance: float) -> dict:
    """Return the points with the moved one stated a distance (m) off."""
    return {**test.points, test.moved: test.points[test.moved] + distance * test.way}


def identified(test: Shapes, points: dict) -> JointIdentification:
    """Return the joints with the points stated at these places."""
    masses = {}
    for name, body in test.case.machine.description.bodies.items():
        square = np.array(body.shape.size) ** 2
        masses[name] = ComponentMass(body.mass, body.centre, body.mass / 12 * np.diag(square.sum() - square))
    chain = {joint.child: joint.parent for joint in test.case.machine.description.joints.values()}
    return identify_joints(test.modes, points, test.case.points.components, chain=chain, masses=masses,
                           coordinate_deviation=COORDINATE_DEVIATION, calibration_deviation=CALIBRATION_DEVIATION)


def errors_of(test: Shapes, result: JointIdentification) -> tuple[list[float], list[bool]]:
    """Return the relative errors of all stiffnesses and whether their intervals hold; a joint of another kind errs by 1."""
    true = {joint.child: sorted(joint.stiffness.values()) for joint in test.case.machine.description.joints.values()}
    errors, held = [], []
    for joint in result.joints:
        if joint.stiffness is None or len(joint.stiffness) != len(true[joint.child]):
            errors.append(1.0)
            held.append(False)
            continue
        order, values = np.argsort(joint.stiffness), np.array(true[joint.child])
        difference = np.abs(joint.stiffness[order] - values)
        errors += list(difference / values)
        held += list(difference <= HALF_WIDTH_DEVIATIONS * joint.stiffness_deviation[order])
    return errors, held


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.seed(0, "first")
    parser.cases("seeds", 10)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    named, wrong, errors, held = ({distance: [] for distance in DISTANCES} for _ in range(4))
    for seed in range(given.first, given.first + given.seeds):
        test = random_shapes(seed)
        for distance in DISTANCES:
            result = identified(test, moved_points(test, distance))
            left_out = [str(each.point) for each in result.wrong_points.misplaced]
            named[distance].append(str(test.moved) in left_out)
            wrong[distance].append(any(point != str(test.moved) for point in left_out))
            error, inside = errors_of(test, result)
            errors[distance] += error
            held[distance] += inside
        print(f"{seed}: {[max(errors[distance]) for distance in DISTANCES]}", file=sys.stderr, flush=True)
    for distance in DISTANCES:
        print(f"{1e3 * distance:.0f} mm: left out {sum(named[distance])} of {len(named[distance])}, another point "
              f"{sum(wrong[distance])}, stiffness error median {100 * np.median(errors[distance]):.2f} %, worst "
              f"{100 * max(errors[distance]):.1f} %, intervals hold {100 * np.mean(held[distance]):.0f} % of "
              f"{len(held[distance])}")


if __name__ == "__main__":
    main()
