"""A column that bends: no joint's stiffness is stated within less than the bending moves it, and unseen modes are said."""

import warnings

import numpy as np
import pytest

from toolpoint.joint_identification import ComponentMass, identify_joints
from toolpoint.machine import build
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.machine.parts.mass import mass_properties
from toolpoint.studies.machines.virtual_test import surface_points, true_modes

BED = {"rx": 6e8, "ry": 4e8}
HEAD = {"rx": 4e7, "rz": 3e7}
SIZES = {"bed": (1.6, 2.0, 0.6), "lower": (0.8, 0.7, 0.9), "upper": (0.8, 0.7, 0.9), "head": (0.6, 0.5, 0.7)}
CENTRES = {"bed": (0.0, 0.0, 0.3), "lower": (0.0, 0.5, 1.05), "upper": (0.0, 0.5, 1.95), "head": (0.1, -0.15, 1.9)}
MASSES = {"bed": 4000.0, "lower": 700.0, "upper": 700.0, "head": 500.0}


def machine(bending):
    """A bed on two rotations, a column of two halves on a stiff hinge (N m/rad), a head on two rotations."""
    bodies = {name: BodyDescription(MASSES[name], CENTRES[name], shape=ShapeDescription("box", SIZES[name])) for name in SIZES}
    joints = {
        "feet": JointDescription("ground", "bed", FrameDescription((0.1, 0.0, 0.0)), BED, loss_factor=0.02),
        "guide": JointDescription("bed", "lower", FrameDescription((0.0, 0.5, 0.6)), {"ry": 3e8, "rx": 3.5e8},
                                loss_factor=0.03),
        "bending": JointDescription("lower", "upper", FrameDescription((0.0, 0.5, 1.5)), {"rx": bending, "ry": bending}),
        "bearing": JointDescription("upper", "head", FrameDescription((0.05, 0.2, 1.9)), HEAD, loss_factor=0.05)}
    return build(MachineDescription("column", bodies, joints, points={"tip": PointDescription("head", (0.1, -0.15, 1.5))}))


@pytest.fixture(scope="module", params=[2e9, 5e9])
def found(request):
    truth = machine(request.param)
    points = surface_points(truth, 100, np.random.default_rng(1))
    parts = dict(points.components)
    parts["column"] = [*parts.pop("lower"), *parts.pop("upper")]
    modes = true_modes(truth, points, 0.02).selected(list(range(6)))
    masses = {}
    for name in ("bed", "head"):
        known = mass_properties(truth.description.bodies[name])
        masses[name] = ComponentMass(known.mass, known.centre, known.inertia)
    whole = mass_properties(BodyDescription(1400.0, (0.0, 0.5, 1.5), shape=ShapeDescription("box", (0.8, 0.7, 1.8))))
    masses["column"] = ComponentMass(whole.mass, whole.centre, whole.inertia)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return identify_joints(modes, points.coordinates, parts, chain=["ground", "bed", "column", "head"], masses=masses)


@pytest.mark.slow
def test_intervals_of_all_joints_cover_what_the_bending_moves(found):
    for child, true in (("bed", BED), ("head", HEAD)):
        joint = found.joint(child)
        if set(joint.freedoms) != set(true):
            assert joint.doubts
            continue
        for way, value, half in zip(joint.freedoms, joint.stiffness, joint.stiffness_interval, strict=True):
            assert abs(value - true[way]) < 1.5 * half + 1e-3 * value, (child, way)
            if abs(value / true[way] - 1) > 0.02:
                assert joint.doubts


@pytest.mark.slow
def test_bending_widens_joints_that_the_column_does_not_touch(found):
    if any("bends" in doubt for doubt in found.joint("column").doubts):
        assert found.machine.moved["bed"] > 1e-4
