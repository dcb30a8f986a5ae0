"""Registration of a test's points from any frame: turned, mirrored, ambiguous, in other units; and MAC that chance gives."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.model_correlation import _pair_doubts
from toolpoint.studies.measured.point_registration import register_anywhere
from toolpoint.vibration import Modes
from toolpoint.vibration.correlation import pair_modes


def scattered(seed, count=20):
    rng = np.random.default_rng(seed)
    return rng, {f"p{k}": rng.uniform(-0.5, 0.5, 3) * [1, 0.7, 1.3] for k in range(count)}


@pytest.mark.parametrize("seed", range(5))
def test_any_frame_is_found_from_some_points_a_millimetre_off(seed):
    rng, model = scattered(seed)
    turn, shift = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    test = {k: turn.T @ (model[f"p{k}"] - shift) + 0.001 / np.sqrt(3) * rng.normal(size=3) for k in range(3, 13)}
    matrix, doubts = register_anywhere(test, model, 0.05)
    assert np.abs(matrix - tf.transform(turn, shift)).max() < 0.005 and doubts == ()


def test_a_box_looks_alike_from_several_sides_unless_names_or_frame_tell():
    corners = {f"c{k}": np.array(at) for k, at in enumerate([(x, y, z) for x in (0, 0.4) for y in (0, 0.4) for z in (0, 0.9)])}
    turn = Rotation.from_euler("z", 1.0).as_matrix()
    other = {k: turn @ at for k, at in enumerate(corners.values())}
    assert any("another placing" in doubt for doubt in register_anywhere(other, corners, 0.05)[1])
    named = {name: turn @ at for name, at in corners.items()}
    matrix, doubts = register_anywhere(named, corners, 0.05)
    assert np.abs(matrix[:3, :3] - turn.T).max() < 1e-9 and doubts == ()
    matrix, doubts = register_anywhere(dict(enumerate(corners.values())), corners, 0.05)
    assert np.abs(matrix - np.eye(4)).max() < 1e-9 and doubts == ()


def test_a_left_handed_frame_and_other_units_are_named():
    rng, model = scattered(7)
    mirrored = {k: at * [1, 1, -1] + 0.001 * rng.normal(size=3) for k, at in model.items()}
    assert any("left-handed" in doubt for doubt in register_anywhere(mirrored, model, 0.05)[1])
    _, doubts = register_anywhere({k: 1000 * at for k, at in model.items()}, model, 0.05)
    assert any("mm read as m" in doubt for doubt in doubts)


def test_points_on_a_line_fix_no_frame():
    _, model = scattered(8)
    assert register_anywhere({k: np.array([0.1 * k, 0, 0]) for k in range(6)}, model, 0.05)[0] is None


def modes(frequency, shape):
    return Modes(np.array(frequency), np.full(len(frequency), 0.01), shape, [f"{k}:+x" for k in range(len(shape))],
                 scaling="unscaled")


def test_pairs_that_random_shapes_give_too_are_doubted():
    """Shapes of nothing but chance over three Dofs: doubted in at least 19 of 20; true ones over 30 are not."""
    rng, said = np.random.default_rng(1), 0
    for _ in range(20):
        first, second = (modes([10, 20, 30, 40], rng.normal(size=(3, 4))) for _ in range(2))
        said += any("random shapes" in doubt for doubt in _pair_doubts(first, second, pair_modes(first, second)))
    assert said >= 19
    shape = rng.normal(size=(30, 4))
    first, second = modes([10, 20, 30, 40], shape), modes([11, 21, 31, 42], shape + 0.1 * rng.normal(size=shape.shape))
    assert _pair_doubts(first, second, pair_modes(first, second)) == []
    far = modes([20, 41, 31, 42], shape)
    assert any("in frequency" in doubt for doubt in _pair_doubts(first, far, pair_modes(first, far)))
