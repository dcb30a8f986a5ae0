"""Joints from measured mode shapes, and the machine of them (as `toolpoint joints MODES --components PARTS`)."""

import tempfile
from importlib import resources

import numpy as np

from toolpoint.io import read_machine
from toolpoint.machine.components import Components
from toolpoint.machine.description import BodyDescription, ShapeDescription
from toolpoint.pages.measured.joints import joints_page
from toolpoint.studies import study_joints
from toolpoint.studies.machines.virtual_test import surface_points, true_modes
from toolpoint.vibration.geometry import Geometry

PARTS = {"base": ("base", "saddle", "table"), "column": ("column", "head"), "magazine": ("magazine",)}
BOXES = {"base": (6354, (0, 1.282, -0.679), (1.161, 1.821, 0.81)), "column": (2805, (0, 1.869, 0.355), (0.94, 0.99, 2.469)),
         "magazine": (300, (-0.553, 1.89, 1.265), (0.831, 0.92, 0.932))}  # kg, m: centre and size


def main() -> float:
    """Return the stiffness of the machine's feet about x over the published one."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    points = surface_points(machine, 60, np.random.default_rng(3))
    owner = {name: [p for p, (body, _) in points.places.items() if body in bodies] for name, bodies in PARTS.items()}
    bodies = {name: BodyDescription(mass=mass, centre=centre, shape=ShapeDescription("box", size=size))
              for name, (mass, centre, size) in BOXES.items()}
    components = Components("from its test", ("ground", *PARTS), owner, bodies)
    result = study_joints(true_modes(machine, points, 0.03), Geometry(points.coordinates, []), components)
    print(result.table())
    with tempfile.TemporaryDirectory() as folder:
        print(joints_page(result).save(folder))
    joint = result.joints.joints[0]
    return float(joint.stiffness[joint.freedoms.index("rx")]) / 902.78e6


if __name__ == "__main__":
    main()
