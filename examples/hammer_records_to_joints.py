"""From the records of a hammer test to the joints of a machine, in five calls (as `toolpoint joints` after the test)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_components, read_machine, write_machine
from toolpoint.modal_identification import identify
from toolpoint.pages.measured.joints import joints_page
from toolpoint.signals import hammer_test, join_setups
from toolpoint.studies import study_joints
from toolpoint.studies.machines.virtual_test import hammer_records, surface_points, true_modes
from toolpoint.vibration.geometry import Geometry

PARTS = {"base": (6354, (0, 1.282, -0.679), (1.161, 1.821, 0.81)), "column": (2805, (0, 1.869, 0.355), (0.94, 0.99, 2.469)),
         "magazine": (300, (-0.553, 1.89, 1.265), (0.831, 0.92, 0.932))}  # kg, m: centre and size of a box
RIDES_ON = {"base": "base", "saddle": "base", "table": "base", "column": "column", "head": "column", "magazine": "magazine"}


def struck_machine(rng):
    """Return points, their bodies' components as text of a file, and the records of a hammer test of the published machine."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    points = surface_points(machine, 60, rng)
    truth = true_modes(machine, points, 0.03)
    struck = truth.dofs[int(np.argmax((np.abs(truth.shape) / np.abs(truth.shape).max(axis=0)).min(axis=1)))]
    lines = ["toolpoint: 1", "name: from its test", "chain: [ground, base, column, magazine]", "components:"]
    for name, (mass, centre, size) in PARTS.items():
        ridden = [point for point, (body, _) in points.places.items() if RIDES_ON[body] == name]
        lines += [f"  {name}:", f"    points: {ridden}", f"    body: {{mass: {mass} kg, centre: {list(centre)}, "
                  f"shape: {{kind: box, size: {list(size)}}}}}"]
    records = [hammer_records(truth, struck, [f"{point}:+{way}" for way in "xyz"], rng=rng) for point in points.places]
    return Geometry(points.coordinates, []), "\n".join(lines), records


def main() -> float:
    """Return the stiffness of the machine's feet about x over the published one."""
    with tempfile.TemporaryDirectory() as folder:
        geometry, text, records = struck_machine(np.random.default_rng(3))
        with open(f"{folder}/parts.yaml", "w") as file:
            file.write(text)
        tests = [hammer_test(record, 4.0, highest=150) for record in records]
        frf = join_setups([test.frf for test in tests])
        modes = identify(frf, band=(5, 150)).modes
        result = study_joints(modes, geometry, read_components(f"{folder}/parts.yaml"))
        write_machine(result.machine, f"{folder}/machine.yaml")
        print(result.table())
        print(joints_page(result).save(folder))
        machine = read_machine(f"{folder}/machine.yaml")
    return machine.value("joints.ground_base.stiffness.rx") / 902.78e6


if __name__ == "__main__":
    main()
