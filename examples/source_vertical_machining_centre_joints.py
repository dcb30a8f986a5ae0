"""Joints of the machining centre's source from the shapes of 131 points: by the package, and by the source's bisectors."""

from importlib import resources
from typing import Any

import numpy as np

from toolpoint.io import read_machine
from toolpoint.joint_identification.motion.finite_motion import meeting_point, relative_bisector_axes
from toolpoint.joint_identification.motion.measured import component
from toolpoint.machine.components import Components
from toolpoint.machine.description import BodyDescription, ShapeDescription
from toolpoint.studies import study_joints
from toolpoint.studies.machines.virtual_test import surface_points, true_modes
from toolpoint.vibration.geometry import Geometry

PARTS = {"base": ("base", "saddle", "table"), "column": ("column", "head"), "magazine": ("magazine",)}
BOXES = {"base": (6354, (0, 1.282, -0.679), (1.161, 1.821, 0.81)), "column": (2805, (0, 1.869, 0.355), (0.94, 0.99, 2.469)),
         "magazine": (300, (-0.553, 1.89, 1.265), (0.831, 0.92, 0.932))}  # kg, m: centre and size, chosen
PLACES = {"base": (0, 1.063, -1.5), "column": (0, 1.3, 0.1), "magazine": (-0.28, 1.5, 1.35)}  # m, table 3


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        machine = read_machine(path)
    numbers: dict[str, Any] = {}
    points = surface_points(machine, 131, np.random.default_rng(3))
    owner = {name: [p for p, (body, _) in points.places.items() if body in bodies] for name, bodies in PARTS.items()}
    boxes = {name: BodyDescription(mass=mass, centre=centre, shape=ShapeDescription("box", size=size))
             for name, (mass, centre, size) in BOXES.items()}
    modes = true_modes(machine, points, 0.03)
    study = study_joints(modes, Geometry(points.coordinates, []), Components("test", ("ground", *PARTS), owner, boxes))
    for joint in study.joints.joints:
        away = np.array(joint.position) - PLACES[joint.child]
        numbers[f"away_{joint.child}"] = 1e3 * np.linalg.norm(away - joint.undetermined.T @ (joint.undetermined @ away))
        numbers |= {f"{joint.child}_{way}": k / 1e6 for way, k in zip(joint.freedoms, joint.stiffness, strict=True)}
    for steps in study.steps():
        name = steps.joint.split(" - ")[1]
        numbers |= {f"passes_{name}": 1e3 * steps.passes().max(), f"plain_passes_{name}": 1e3 * steps.plain_passes().max()}
    parts = {name: component(name, modes, points.coordinates, labels=owner[name]) for name in PARTS}
    for before, name in ((None, "base"), ("base", "column"), ("column", "magazine")):
        for size, amplitude in (("small", 1e-4), ("large", 0.02)):
            axes = relative_bisector_axes(parts[before] if before else None, parts[name], amplitude)
            away = 1e3 * (meeting_point(axes) - PLACES[name])  # parallel axes meet nowhere along them
            numbers[f"bisectors_{name}_{size}"] = np.linalg.norm(away[1:] if name == "column" else away)
            numbers |= {f"axis_{name}_{k + 1}": str(np.round(axis.direction, 2).tolist()) for k, axis in enumerate(axes)}
    return numbers


if __name__ == "__main__":
    print(main())
