"""Sensitivity study of elastic bodies and cumulated shapes."""

from __future__ import annotations

import numpy as np
import pytest
from four_part_mill import four_part_mill

from toolpoint.bodies import beam as beams
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    BodyDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.studies.machines.sensitivity_study import study_sensitivity
from toolpoint.vibration import correlation, eigen


def arm(modulus=210e9, density=7850.0, height=0.06):
    """A steel cantilever on an elastic foot, its end carrying a rigid head."""
    body = beams.beam(beams.rectangle(0.05, height, modulus, density=density), 1.0, 20, modes=8)
    unit = InertiaDescription(0.25, 0.2, 0.15)
    bodies = {"arm": BodyDescription(mass=1.0, inertia=unit), "head": BodyDescription(mass=5.0, inertia=unit)}
    joints = {"foot": JointDescription("ground", "arm", child_interface="root",
                                       stiffness={"x": 2e8, "y": 2e8, "z": 2e8, "rx": 2e5, "ry": 3e5, "rz": 2e5}),
              "wrist": JointDescription("arm", "head", parent_interface="tip")}
    points = {"tip": PointDescription("arm", interface="tip"), "head": PointDescription("head", (0.1, 0.1, 0.0))}
    return build(MachineDescription("arm", bodies, joints, points=points), {"arm": body})


def test_moduli_and_joint_stiffnesses_share_one_half_and_masses_the_other():
    """Euler: homogeneous of degree 1/2 in all stiffnesses and -1/2 in all masses (inertia of the head included)."""
    paths = [*(f"joints.foot.stiffness.{w}" for w in ("x", "y", "z", "rx", "ry", "rz")), "bodies.arm.modulus"]
    masses = ["bodies.arm.density", "bodies.head.mass", *(f"bodies.head.inertia.{w}" for w in ("xx", "yy", "zz"))]
    study = study_sensitivity(arm(), [*paths, *masses], 5)
    assert study.frequency[:len(paths)].sum(axis=0) == pytest.approx(np.full(5, 0.5), abs=1e-9)
    assert study.frequency[len(paths):].sum(axis=0) == pytest.approx(np.full(5, -0.5), abs=1e-9)


@pytest.mark.parametrize(("name", "changed"), [
    ("modulus", {"modulus": 210e9 * 1.001}), ("density", {"density": 7850.0 * 1.001})])
def test_elastic_bodies_foretell_the_frequencies_of_the_changed_material(name, changed):
    study = study_sensitivity(arm(), [f"bodies.arm.{name}"], 5)
    here, there = (eigen.solve_undamped(assemble(m), 5).frequency for m in (arm(), arm(**changed)))
    assert np.log(there / here) / np.log(1.001) == pytest.approx(study.frequency[0], abs=2e-4)


def test_left_out_paths_name_modulus_and_density_of_elastic_bodies():
    study = study_sensitivity(arm(), None, 3)
    assert {"bodies.arm.modulus", "bodies.arm.density", "bodies.head.mass"} <= set(study.paths)
    assert "bodies.arm.mass" not in study.paths


def test_cumulated_shapes_foretell_the_mac_after_all_stiffnesses_of_an_interface_change():
    mill, change = four_part_mill(), 1e-3
    study = study_sensitivity(mill, None, 6)
    paths = [p for p in study.paths if p.startswith("joints.column_housing.stiffness")]
    moved = mill.with_values({p: mill.value(p) * (1 + change) for p in paths})
    here, there = (eigen.solve_undamped(assemble(m), 6).shape for m in (mill, moved))
    lost = 1 - np.diag(correlation.mac(here, there))
    told = (study.cumulative_shape("stiffness")["joints.column_housing"] * change) ** 2
    assert lost == pytest.approx(told, rel=0.02, abs=1e-12)
