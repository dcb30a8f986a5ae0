"""A plan of design changes, screened, and the cheapest of them that reach a goal (as `toolpoint screen` and `improve`)."""

import tempfile
from dataclasses import replace
from importlib import resources

from toolpoint.io import read_machine, read_plan
from toolpoint.pages import screening_page
from toolpoint.studies import improve_by_plan, run_plan


def main() -> float:
    """Return the static compliance that the full model has after the cheapest changes, over the goal."""
    with resources.as_file(resources.files("toolpoint.app") / "machines") as folder:
        plan = read_plan(folder / "milling_robot_screening.yaml")
        robot = read_machine(folder / plan.machine)
    frequencies = replace(plan, metrics=("frequency 1", "frequency 2"), square=None)
    result = run_plan(frequencies, robot)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(screening_page(result, "changes of the milling robot").save(folder))
    springs = replace(frequencies, factors=tuple(factor for factor in plan.factors if "stiffness" in factor.name), swaps=())
    better = improve_by_plan(springs, robot, "static compliance", goal=5.355e-5)
    print(better.table())
    return better.value / better.goal


if __name__ == "__main__":
    main()
