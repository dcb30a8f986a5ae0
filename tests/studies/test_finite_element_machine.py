"""A machine of solid parts: laws of energy, springs and rigid masses, and a tuned damper after Den Hartog."""

import numpy as np
import pytest

from solid_models import brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import Material, Patch
from toolpoint.studies.finite_elements.tuned_damper import tune_damper
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint
from toolpoint.vibration import Dof, Modes

STIFF = Material(1e16, 0.3, 1000.0)
X, Y, Z = np.eye(3)


def two_blocks(material, k=(1e6, 2e6, 3e6, 1e8, 1e8, 1e8)):
    """Two 0.2 m cubes of 8 kg on each other, the lower one on the ground."""
    low, high = brick([0.2] * 3, [2, 2, 2], material), brick([0.2] * 3, [1, 1, 1], material)
    high = type(high)(high.nodes + np.array([0, 0, 0.2]), high.blocks, high.materials)
    top = np.array([0.1, 0.1, 0.2])
    joints = (PatchJoint("foot", GROUND, "low", np.array(k), Patch([0.1, 0.1, 0.0], X, -Y, 0.2, 0.2)),
              PatchJoint("flange", "low", "high", np.array(k), Patch(top, X, -Y, 0.2, 0.2), Patch(top, X, Y, 0.2, 0.2)))
    return FiniteElementMachine({"low": low, "high": high}, joints, {"tool": ("high", Patch([0.1, 0.1, 0.4], X, Y, 0.1, 0.1),
                                                                              (0, 0, 0.0))})


def test_rigid_parts_on_springs_are_a_chain_of_masses():
    """Along z two masses m on two springs k: k/m (3 -+ sqrt 5)/2."""
    pairs = two_blocks(STIFF).solve(6)
    exact = np.sqrt(3e6 / 8 * (3 + np.array([-1, 1]) * np.sqrt(5)) / 2) / (2 * np.pi)
    assert all(abs(pairs.frequency / f - 1).min() < 1e-5 for f in exact)


def test_energies_of_parts_and_joints_add_up():
    machine = two_blocks(Material(1e9, 0.3, 1000.0))
    pairs = machine.solve(5)
    parts = machine.sensitivities(pairs)
    total = sum(2 * s.modulus.sum(axis=1) for s in parts.values()) + sum(machine.joint_shares(pairs).values())
    assert np.allclose(total, 1, atol=1e-8)
    assert np.allclose(sum(s.density.sum(axis=1) for s in parts.values()), -0.5, atol=1e-9)
    shape = machine.point_modes(pairs, 0.01)
    assert shape.dofs[0] == Dof("tool", "+x") and np.isfinite(shape.shape).all()


def test_a_part_left_free_is_named():
    machine = two_blocks(STIFF, (1e6, 2e6, 3e6, 1e8, 1e8, 1e8))
    free = FiniteElementMachine(machine.parts, machine.joints[:1], {})
    with pytest.raises(ToolpointError, match="6 motions without stiffness, of high most of all"):
        free.solve(4)


def test_patches_apart_are_refused():
    with pytest.raises(ToolpointError, match="patches 50 mm apart"):
        PatchJoint("a", "low", "high", np.ones(6), Patch([0, 0, 0.05], X, Y, 1, 1), Patch([0, 0, 0.0], X, Y, 1, 1))


def test_damper_of_one_mode_is_den_hartogs():
    """Undamped mode of 100 Hz, unit mass, mu = 0.05: f/(1 + mu), sqrt(3 mu/(8 (1 + mu))), peak sqrt(1 + 2/mu) static.

    Den Hartog, Mechanical Vibrations, 4th ed., section 3.3, where the ratio sqrt(3 mu/(8 (1 + mu)^3)) is c/(2 m omega) of the
    structure's frequency: of the damper's own it is 1 + mu times as large. His damping makes one of the two equal peaks exact
    and the other a little higher; the search may gain 0.5 %.
    """
    mu, w = 0.05, 2 * np.pi * 100
    modes = Modes([100.0], [1e-9], [[1.0]], [Dof("tool", "+x")])
    damper = tune_damper(modes, "tool:+x", "tool:+x", mass=mu, lines=np.linspace(70, 130, 6001))
    assert damper.start == pytest.approx((100 / (1 + mu), np.sqrt(3 * mu / (8 * (1 + mu)))))
    assert damper.damping_ratio == pytest.approx(damper.start[1], rel=0.03)
    assert abs(damper.with_damper).max() * w**2 == pytest.approx(np.sqrt(1 + 2 / mu), rel=5e-3)
    assert damper.frequency == pytest.approx(damper.start[0], rel=2e-3)


def test_damper_for_depth_gains_more_depth_than_the_one_for_the_peak():
    modes = Modes([100.0], [0.01], [[1.0]], [Dof("tool", "+x")])
    lines = np.linspace(60, 150, 4001)
    by_peak, by_depth = (tune_damper(modes, "tool:+x", "tool:+x", mass=0.05, lines=lines, goal=goal)
                         for goal in ("peak", "depth"))
    assert by_depth.depth_ratio > by_peak.depth_ratio > 1 and by_peak.peak_ratio < by_depth.peak_ratio < 1
