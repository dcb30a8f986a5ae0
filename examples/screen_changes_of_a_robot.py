"""Design changes of a robot screened, with the payload uncertain: which does most, and how sure that is (as `toolpoint
screen`)."""

from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.studies import Factor, NamedMetrics, one_at_a_time, rank_changes, screen


def main() -> float:
    """Return what twice all springs do to the first frequency, relative: the root of two."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "elastic_robot.yaml") as path:
        robot = read_machine(path)
    changes = [Factor(f"all {what}", (f"joints.*.stiffness.{way}",), 1.0, 2.0) for what,
               way in (("torsion", "rz"), ("bending", "r*"))]
    result = screen(robot, one_at_a_time(changes), NamedMetrics(("frequency 1",)),
                    doubts=[Factor("tool", ("bodies.link6.mass",), 0.5, 2.0)],
                    draws=10, rng=np.random.default_rng(1))
    print(rank_changes(result).table())
    return float(result.stated[2, 0] / result.stated[0, 0])


if __name__ == "__main__":
    main()
