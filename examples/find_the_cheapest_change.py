"""The cheapest changes of a robot's springs that bring its static compliance to a goal (as `toolpoint improve`)."""

from importlib import resources

from toolpoint.io import read_machine
from toolpoint.studies import Factor, ResponsePeak, improve_machine


def main() -> float:
    """Return the compliance that the full model has after the changes, over the goal."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "elastic_robot.yaml") as path:
        robot = read_machine(path)
    springs = [Factor(f"torsion of axis {i}", (f"joints.joint_q{i}.stiffness.rz",), 1.0, 2.0, cost=1.0) for i in (1, 2, 3)]
    result = improve_machine(robot, springs, ResponsePeak(static=True), goal=6.5e-6)
    print(result.table())
    return result.value / result.goal


if __name__ == "__main__":
    main()
