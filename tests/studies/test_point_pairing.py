"""Point pairing: a known motion is found again, points without partner stay single, directions turn along."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.point_pairing import pair_points
from toolpoint.vibration import Modes


def scene(angle=0.3, turn=None):
    rng = np.random.default_rng(2)
    model = {f"m{k}": p for k, p in enumerate(rng.uniform(-1, 1, (12, 3)))}
    rot = rotation.about("z", angle) if turn is None else turn
    motion = tf.transform(rot, np.array([0.1, -0.05, 0.02]))
    back = tf.inverse(motion)
    order = rng.permutation(12)
    test = {int(k): tf.move(back, model[f"m{k}"][None])[0] + 1e-4 * rng.normal(size=3) for k in order}
    return test, model, motion


def test_known_pairs_and_small_motions_find_the_transform():
    test, model, motion = scene(1.2)
    known = pair_points(test, model, 0.01, known_pairs={0: "m0", 1: "m1", 2: "m2", 3: "m3"})
    near, other, small = scene(0.05)
    for found, want in ((known, motion), (pair_points(near, other, 0.01), small)):
        assert all(found.pairs[k] == f"m{k}" for k in range(12)) and not found.single
        assert found.transform == pytest.approx(want, abs=1e-3)


def test_a_point_without_partner_stays_single_and_is_said():
    test, model, _ = scene(0.05)
    known = {k: f"m{k}" for k in range(4)}
    del model["m7"]
    found = pair_points(test, model, 0.01, known_pairs=known)
    assert found.single == (7,) and "no model point" in found.status


def test_directions_turn_with_the_frame():
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    test, model, _ = scene(turn=quarter)
    found = pair_points(test, model, 0.01, known_pairs={k: f"m{k}" for k in range(6)})
    modes = Modes([10.0], 0.01, np.array([[1.0], [2.0]]), ("3:+x", "3:+y"))
    labels = found.renamed(modes).dofs
    assert [d.point for d in labels] == ["m3", "m3"]
    assert labels[0].unit[:3] == pytest.approx([0, 1, 0], abs=1e-3)
    assert labels[1].unit[:3] == pytest.approx([-1, 0, 0], abs=1e-3)


def test_bad_input_is_refused():
    test, model, _ = scene()
    with pytest.raises(ToolpointError, match="above zero"):
        pair_points(test, model, 0.0)
