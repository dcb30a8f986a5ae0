"""Gains of a sensor's directions: estimated from rigid bodies, carried into the motions, and common to all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.joint_identification.machine.bending_share import _is_common
from toolpoint.joint_identification.modes.modal_data import ModalData
from toolpoint.joint_identification.motion.measured import component
from toolpoint.joint_identification.motion.motion_errors import with_errors
from toolpoint.joint_identification.motion.relative_motion import relative
from toolpoint.joint_identification.motion.rigid_motion import rigid_motion
from toolpoint.joint_identification.motion.sensor_gains import MAX_CORRECTED_GAIN, fit_gains
from toolpoint.vibration import Dof, Modes

POINTS, MODES, NOISE, CALIBRATION = 6, 8, 2e-3, 0.01


def drawn_test(seed: int, *, coordinates: float, gains: np.ndarray | None = None, ways=("+x", "-y", "+z")):
    """Return two rigid bodies in random motions with noise, wrong coordinates and wrong gains; and the true gains."""
    rng = np.random.default_rng(seed)
    factors = np.exp(CALIBRATION * rng.standard_normal(3)) if gains is None else gains
    labels = [Dof(point, way) for point in range(2 * POINTS) for way in ways]
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(2 * POINTS)}
    motions = rng.standard_normal((2, MODES, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions[int(dof.point) // POINTS]]
                      for dof in labels])
    shape *= np.array([factors["xyz".index(dof.direction[1])] for dof in labels])[:, None]
    shape += NOISE * rng.standard_normal(shape.shape)
    modes = Modes(10.0 * np.arange(1, MODES + 1), [0.01] * MODES, shape, labels, "unscaled",
                  shape_variance=np.full(shape.shape, NOISE**2))
    stated = {point: place + coordinates * rng.standard_normal(3) for point, place in places.items()}
    parts = {name: component(name, modes, stated, labels=list(range(k * POINTS, (k + 1) * POINTS)))
             for k, name in enumerate(("column", "head"))}
    return parts, factors, modes


@pytest.mark.parametrize("coordinates", [0.0, 2e-3])
def test_gains_are_as_far_off_as_their_covariance_says(coordinates):
    scores, sizes = [], []
    for seed in range(12):
        parts, factors, _ = drawn_test(seed, coordinates=coordinates)
        gains = fit_gains(parts, coordinates, CALIBRATION)
        error = np.log(gains.factors) - np.log(factors) + np.log(factors).mean()
        scores.append(error @ np.linalg.pinv(gains.covariance, rcond=1e-9) @ error / 2)
        sizes.append(np.sqrt(np.diag(gains.covariance)).max())
        assert np.linalg.norm(gains.covariance.sum(axis=0)) < 1e-12  # a gain common to all directions is left out
    assert 0.5 < np.mean(scores) < 1.8
    assert max(sizes) < (0.002 if coordinates == 0 else 0.4 * CALIBRATION)


def test_corrected_shapes_are_rigid_and_gains_out_of_bounds_are_left_to_the_doubt_that_names_them():
    parts, factors, modes = drawn_test(3, coordinates=0.0)
    gains = fit_gains(parts, 0.0, CALIBRATION)
    corrected = gains.corrected(modes).shape / modes.shape
    true = np.array([factors["xyz".index(dof.direction[1])] for dof in modes.dofs])[:, None]
    assert corrected * true == pytest.approx(np.full(corrected.shape, np.exp(np.log(factors).mean())), rel=2e-3)
    assert gains.doubts == [] and "x " in gains.note
    wrong = np.array([1.0, 1.0, np.exp(3 * MAX_CORRECTED_GAIN)])
    assert fit_gains(drawn_test(3, coordinates=0.0, gains=wrong)[0], 0.0, CALIBRATION) is None
    (doubt,) = fit_gains(drawn_test(3, coordinates=0.0, gains=np.array([1.0, 1.0, 1.09]))[0], 0.0, CALIBRATION).doubts
    assert "z 1.0" in doubt


def test_errors_of_gains_are_common_to_bodies_and_cancel_where_they_move_alike():
    parts, _, _ = drawn_test(5, coordinates=0.0)
    part, gains = parts["head"], fit_gains(parts, 0.0, CALIBRATION)
    motion = with_errors(part, rigid_motion(part), np.eye(MODES), gains=gains)
    assert motion.gain_errors.shape == (MODES, 6, 2) and np.abs(motion.gain_errors).max() > 0
    scale = (part.motion, part.centre, part.size)
    assert relative(motion, motion, "head", scale=scale).full_covariance == pytest.approx(2 * motion.full_covariance)
    to_ground = relative(None, motion, "ground", scale=scale).full_covariance - motion.full_covariance
    assert to_ground == pytest.approx(np.einsum("rin,sjn->risj", motion.gain_errors, motion.gain_errors))


def test_the_fit_of_a_machine_has_a_column_for_each_combination_of_gains():
    rng = np.random.default_rng(0)
    motions, errors = rng.standard_normal((2, 6, 3)), rng.standard_normal((2, 2, 6, 3))
    roots = tuple(rng.standard_normal((18, 18)) for _ in range(2))
    data = ModalData(motions, roots, np.stack([np.eye(6)] * 2), np.ones(3), np.ones(3), np.zeros((3, 2, 2)), gain_errors=errors)
    assert data.shares == pytest.approx(np.stack([np.concatenate([root @ part.T.ravel() for root, part in zip(
        roots, column, strict=True)]) for column in errors], axis=1))


def test_a_residual_that_all_components_show_alike_is_noise_of_the_mode_and_no_bending():
    motion = rigid_motion(drawn_test(1, coordinates=0.0)[0]["head"])
    names = ("b0", "b1", "b2", "b3")
    alike = {name: replace(motion, excess=np.full(MODES, 3.0)) for name in names}
    assert _is_common(alike, "b1").all()
    bent = {**alike, "b1": replace(motion, excess=np.full(MODES, 60.0))}
    assert not _is_common(bent, "b1").any()
    assert not _is_common({name: replace(motion, excess=np.full(MODES, 9.0)) for name in names}, "b1").any()
