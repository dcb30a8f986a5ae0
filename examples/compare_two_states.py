"""Two tests of a machine whose feet have settled: what moved, and what is noise (as `toolpoint compare BEFORE AFTER`)."""

import tempfile
from dataclasses import replace
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.pages import state_comparison_page
from toolpoint.studies import compare_two_states
from toolpoint.studies.machines.virtual_test import surface_points, true_modes


def tested(machine, points, rng):
    """Return modes of a machine as a test gives them: 0.02 % noise of the frequencies, 1 % of the shapes."""
    modes, spread = true_modes(machine, points, 0.03), 2e-4
    noise = 0.01 * np.abs(modes.shape).max(axis=0) * np.ones_like(modes.shape)
    covariance = (spread * modes.frequency[:, None, None]) ** 2 * np.diag([1.0, 0.0])
    return replace(modes, frequency=modes.frequency * (1 + spread * rng.standard_normal(modes.count)),
                   shape=modes.shape + noise * rng.standard_normal(modes.shape.shape), shape_variance=noise**2,
                   covariance=covariance)


def main() -> float:
    """Return how many of the six frequencies are said to have moved by feet that are 5 % softer about x: those that tilt."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    rng = np.random.default_rng(5)
    points = surface_points(machine, 30, rng)
    softer = machine.with_values({"joints.foundation.stiffness.rx": 0.95 * machine.value("joints.foundation.stiffness.rx")})
    before, after = (tested(one, points, rng) for one in (machine, softer))
    result = compare_two_states(("May", (before, None)), ("June", (after, None)), rng=rng)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(state_comparison_page(result).save(folder))
    return float(result.moved.sum())


if __name__ == "__main__":
    main()
