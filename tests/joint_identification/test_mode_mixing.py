"""Shapes of overlapping modes take up parts of each other where poles are off: against residues fitted on many lines."""

import numpy as np
import pytest

from toolpoint.joint_identification.modes.modal_data import ModalData
from toolpoint.joint_identification.modes.mode_mixing import shape_mixing, with_mixing
from toolpoint.vibration import Modes

OMEGA, RATIO = 2 * np.pi * np.array([40.0, 41.0, 90.0]), np.array([0.04, 0.035, 0.02])
POLES = OMEGA * (-RATIO + 1j * np.sqrt(1 - RATIO**2))
LINES = np.linspace(-400.0, 1200.0, 400_001)  # rad/s, so wide that the ends matter little


def case(seed=0, points=5, inputs=2):
    rng = np.random.default_rng(seed)
    shape = rng.normal(size=(points, 3)) + 0.1j * rng.normal(size=(points, 3))
    given = rng.normal(size=(inputs, 3)) + 0.1j * rng.normal(size=(inputs, 3))
    return shape, given


def fitted(shape, given, errors):
    """Shapes by least squares at wrong poles: residues first, then their part along the given participation."""
    responses = np.einsum("pr,ir,rw->wpi", shape, given, 1 / (1j * LINES - POLES[:, None]), optimize=True)
    wrong = (1 / (1j * LINES - (POLES + errors)[:, None])).T
    residues = np.linalg.lstsq(wrong, responses.reshape(len(LINES), -1), rcond=None)[0].reshape(3, *responses.shape[1:])
    return np.einsum("rpi,ir->pr", residues, given.conj()) / (np.abs(given) ** 2).sum(axis=0)


def modes(shape, given):
    labels = [f"{i}:+x" for i in range(shape.shape[0])]
    return Modes(OMEGA / (2 * np.pi), RATIO, shape, labels, "modal A", participation=given, input_dofs=labels[:len(given)])


@pytest.mark.parametrize("errors", [[0.02, 0, 0], [0, 0.02j, 0], [0.01 - 0.02j, 0.015j, 0]])
@pytest.mark.default_cases(1)
def test_mixing_is_what_a_fit_at_wrong_poles_does(errors):
    shape, given = case()
    errors = np.array(errors, complex)
    measured = fitted(shape, given, errors)
    mixing = shape_mixing(modes(measured, given))
    mixed = -np.einsum("ps,rs,s->pr", shape, mixing, errors)
    # What is left of shapes one and two after their own scale.
    for r in (0, 1):
        own = shape[:, r]
        change = measured[:, r] - shape[:, r] - mixed[:, r]
        change = change - own * np.vdot(own, change) / np.vdot(own, own)
        before = measured[:, r] - shape[:, r]
        before = before - own * np.vdot(own, before) / np.vdot(own, own)
        if np.linalg.norm(mixed[:, r]) > 1e-5:
            assert np.linalg.norm(change) < 0.05 * np.linalg.norm(before)


def test_modes_apart_and_real_shapes_do_not_mix():
    shape, given = case()
    mixing = shape_mixing(modes(shape, given))
    assert (mixing[2] == 0).all() and (mixing[:, 2] == 0).all() and (np.diag(mixing) == 0).all()
    assert abs(mixing[0, 1]) > 0 and abs(mixing[1, 0]) > 0
    assert shape_mixing(modes(shape.real, given)) is None


@pytest.mark.slow
def test_data_are_set_right_by_the_poles_of_a_machine_and_stay_open_for_what_is_missed():
    shape, given = case(points=12)
    errors = np.array([0.02 - 0.01j, 0.01j, 0.0])
    measured = fitted(shape, given, errors)
    moved = POLES + errors
    twists = measured.reshape(2, 6, 3)
    data = ModalData(twists, (np.eye(36), np.eye(36)), np.stack([np.eye(6)] * 2), np.abs(moved) / (2 * np.pi),
                     -moved.real / np.abs(moved), np.broadcast_to(np.diag([1e4, 1e3]), (3, 2, 2)))
    data = with_mixing(data, shape_mixing(modes(measured, given)))
    right = data.unmixed(POLES).reshape(12, 3)
    for r in (0, 1):
        off = [np.linalg.norm(v - shape[:, r] * np.vdot(shape[:, r], v) / np.vdot(shape[:, r], shape[:, r]))
               for v in (measured[:, r], right[:, r])]
        assert off[1] < 0.1 * off[0]
    assert data.shares.shape == (72, 4) and (data.mixing_deviation[2] == 0).all()
    size = np.linalg.norm(data.shares[:, 0])
    assert size == pytest.approx(data.mixing_deviation[0, 1] * np.linalg.norm(measured[:, 1]))
