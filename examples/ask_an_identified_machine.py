"""Responses of a machine at a pose with their intervals, and the test to make next (as `toolpoint frf`, `toolpoint
next-test`)."""

import tempfile
from dataclasses import replace
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.machine import assemble, build
from toolpoint.machine.description import IdentifiedDescription
from toolpoint.pages.machines.machine_responses import responses_page
from toolpoint.studies import rank_tests, study_responses_of_machine


def main() -> float:
    """Return the response at a tenth of a hertz over the static one."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    # Two stiffnesses as `toolpoint joints` would write them: identified together, each to about one per cent.
    paths = ("joints.foundation.stiffness.rx", "joints.column_foot.stiffness.rx")
    size = np.array([0.01 * machine.value(p) for p in paths])
    covariance = np.outer(size, size) * np.array([[1.0, -0.4], [-0.4, 1.0]])
    identified = IdentifiedDescription(paths, tuple(tuple(map(float, row[:n + 1])) for n, row in enumerate(covariance)))
    machine = build(replace(machine.description, identified=identified))
    label = f"{machine.description.tool}-{machine.description.table}:+y"
    result = study_responses_of_machine(machine, outputs=[label], frequency=np.linspace(0.1, 120.0, 200))
    print(result.table())
    print(rank_tests(machine, {}, [{}], points=[machine.description.tool]).table())
    with tempfile.TemporaryDirectory() as folder:
        print(responses_page(result).save(folder))
    system = assemble(machine, outputs=[label])
    static = system.output_map @ np.linalg.solve(system.stiffness, system.input_map)
    return float(np.abs(result.frfs[0].values[0, 0, 0]) / static[0, 0])


if __name__ == "__main__":
    main()
