"""Law: a joint is established only along directions that the test loads or pushes; elsewhere it may be soft and nobody sees it.

A box on springs of six freedoms about its centre, struck at its side. Modes are exact; those that the struck point does not
move are left out, as an identification leaves them out.
"""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.joint_identification import identify_joints
from toolpoint.joint_identification.joints.stiffness import ComponentMass
from toolpoint.vibration import Modes

MASS, INERTIA = 1000.0, np.array([60.0, 90.0, 120.0])
HERTZ = np.array([21.0, 24.0, 33.0, 38.0, 47.0, 55.0])  # along x y z rx ry rz
PLACES = {f"p{i}": np.array(corner) for i, corner in enumerate(np.ndindex(2, 2, 2))}
POINTS = {name: (place - 0.5) * [0.8, 0.6, 0.5] for name, place in PLACES.items()}
WAYS = ("x", "y", "z", "rx", "ry", "rz")


def box_test(struck: list[str]) -> Modes:
    """Modes of the box that unit forces at the struck Dofs excite, with a shape noise of a thousandth."""
    twists = np.eye(6) / np.sqrt([MASS] * 3 + list(INERTIA))
    dofs = [f"{name}:+{way}" for name in POINTS for way in "xyz"]
    shape = np.concatenate([twists[:3] + np.cross(twists[3:].T, place).T for place in POINTS.values()])
    rows = [dofs.index(label) for label in struck]
    seen = np.flatnonzero(np.abs(shape[rows]).max(axis=0) > 1e-9)
    rng = np.random.default_rng(1)
    noise = 1e-3 * np.abs(shape).max(axis=0)
    shape = (shape + noise * rng.normal(size=shape.shape))[:, seen]
    return Modes(HERTZ[seen], np.full(seen.size, 0.02), shape, dofs, scaling="unit modal mass", input_dofs=struck,
                 participation=shape[rows], shape_variance=np.broadcast_to(noise[seen] ** 2, shape.shape))


def doubts_of(struck: list[str]) -> list[str]:
    mass = ComponentMass(MASS, np.zeros(3), np.diag(INERTIA))
    result = identify_joints(box_test(struck), POINTS, {"box": list(POINTS)}, chain=["ground", "box"], masses={"box": mass})
    return [str(doubt) for doubt in result.joints[0].doubts if "nothing in this test loads" in doubt]


@pytest.mark.filterwarnings("ignore")
def test_directions_that_one_struck_point_leaves_at_rest_are_named():
    said = doubts_of(["p0:+x"])  # at a corner: x with ry and rz
    assert len(said) == 1 and "along y, z, rx:" in said[0]


@pytest.mark.filterwarnings("ignore")
def test_directions_that_are_pushed_are_not_doubted():
    assert doubts_of(["p0:+x", "p0:+y", "p5:+z"]) == []


def identified(modes: Modes):
    mass = ComponentMass(MASS, np.zeros(3), np.diag(INERTIA))
    return identify_joints(modes, POINTS, {"box": list(POINTS)}, chain=["ground", "box"], masses={"box": mass})


@pytest.mark.filterwarnings("ignore")
def test_fewer_modes_than_directions_leave_some_untested_whoever_struck():
    """The box of six freedoms by two of its modes looks like one of two, rigid along the others."""
    modes = box_test(["p0:+x", "p0:+y", "p5:+z"])
    silent = replace(modes, input_dofs=(), participation=None)
    assert not any("nothing in this test loads" in doubt for doubt in identified(silent).joints[0].doubts)
    some = identified(silent.selected([0, 1]))
    assert any("nothing in this test loads" in doubt for doubt in some.joints[0].doubts)
    assert some.tested_frequency["box"] < HERTZ[2]  # the hidden freedoms lie above what is said to be excluded
    assert any("modes of further freedoms are excluded below box" in note for note in some.notes)
