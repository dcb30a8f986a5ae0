"""Exact shapes, real and complex: the joints are right and finite, where coordinates and gains are told as less certain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joint_identification import p1_case as p1
from toolpoint.joint_identification import identify_joints


@pytest.fixture(scope="module")
def case():
    return p1.case(p1.machine(), np.random.default_rng(4), number=24)


def exact(modes):
    return replace(modes, shape_variance=None)


def without_imaginary_part(modes):
    return replace(modes, shape=modes.shape * np.exp(0.3j), shape_variance=None)


@pytest.mark.filterwarnings("ignore::toolpoint._check.ToolpointWarning")
@pytest.mark.parametrize("change", [pytest.param(exact, marks=pytest.mark.slow), without_imaginary_part])
def test_joints_of_unusual_shapes_are_finite_and_right(case, change):
    """Places may be 2 mm off and gains 1 %, by what is told; the shapes leave next to nothing of either."""
    result = identify_joints(change(case.truth), case.points, case.components, chain=p1.CHAIN, masses=case.masses,
                             coordinate_deviation=2e-3, calibration_deviation=0.01)
    for child, kind in p1.KINDS.items():
        joint = result.joint(child)
        assert joint.kind == kind and "nan" not in repr(joint)
        assert joint.stiffness == pytest.approx(p1.STIFFNESS[child], rel=0.01)
        assert np.isfinite(joint.position_covariance).all() and np.isfinite(joint.stiffness_deviation).all()
