"""Mass scaling of operational modes against systems whose unit-modal-mass shapes are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.modal_identification.operational.mass_scaling import scale_by_added_mass, scale_by_driving_point, scale_by_model
from toolpoint.vibration import Modes, SecondOrderSystem, eigen, frequency_response

DOFS = ("1:+x", "2:+x", "3:+x")
MASS = np.diag([2.0, 1.0, 1.5])
STIFFNESS = 1e4 * np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.2]])


def system(added: float = 0.0) -> SecondOrderSystem:
    return SecondOrderSystem(MASS + np.diag([0.0, added, 0.0]), STIFFNESS, damping=1e-4 * STIFFNESS, outputs=DOFS, inputs=DOFS)


def truth(added: float = 0.0) -> Modes:
    return eigen.solve_undamped(system(added))


def unscaled(modes: Modes, seed: int = 0) -> Modes:
    """Return the modes as an operational test gives them: of unknown size and sign, turned in phase, with intervals."""
    rng = np.random.default_rng(seed)
    factor = rng.uniform(0.3, 3.0, modes.count) * np.exp(1j * rng.uniform(0, 2 * np.pi, modes.count))
    covariance = np.zeros((modes.count, 2, 2))
    covariance[:, 0, 0], covariance[:, 1, 1] = (1e-5 * modes.frequency) ** 2, 1e-8
    return replace(modes, shape=modes.shape * factor, scaling="unscaled", covariance=covariance,
                   shape_variance=np.full(modes.shape.shape, 1e-8))


def test_an_added_mass_gives_the_scale_to_first_order() -> None:
    """The error of the scale falls with the mass, as the method is of first order in it."""
    errors = []
    for added in (0.02, 0.01):
        scaled, doubts = scale_by_added_mass(unscaled(truth(), 1), unscaled(truth(added), 2), {"2:+x": added})
        assert doubts == () and scaled.scaling == "unit modal mass"
        errors.append(np.abs(np.abs(scaled.shape) / np.abs(truth().shape) - 1).max())
    assert errors[0] < 0.02
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.1)


def test_a_mode_that_the_mass_does_not_shift_is_left_out_and_named() -> None:
    noisy = unscaled(truth(), 1)
    covariance = noisy.covariance.copy()
    covariance[0, 0, 0] = (0.1 * noisy.frequency[0]) ** 2
    scaled, doubts = scale_by_added_mass(replace(noisy, covariance=covariance), unscaled(truth(0.02), 2), {"2:+x": 0.02})
    assert scaled.count == 2 and len(doubts) == 1
    assert "cannot be scaled" in doubts[0]


def test_a_large_mass_is_doubted() -> None:
    _, doubts = scale_by_added_mass(unscaled(truth(), 1), unscaled(truth(0.3), 2), {"2:+x": 0.3})
    assert any("of first order" in doubt for doubt in doubts)


def test_a_mass_where_nothing_was_measured_is_refused() -> None:
    with pytest.raises(ToolpointError, match="must be a measured degree of freedom"):
        scale_by_added_mass(unscaled(truth()), unscaled(truth(0.01)), {"9:+x": 0.01})


def test_a_driving_point_gives_the_scale() -> None:
    damped = eigen.solve_damped(system())
    frf = frequency_response.direct(system(), np.arange(2.0, 60.0, 0.05)).selected(["1:+x"], ["1:+x"])
    operational = replace(unscaled(truth(), 3), damping_ratio=damped.damping_ratio)
    scaled = scale_by_driving_point(operational, frf)
    assert np.abs(scaled.shape) == pytest.approx(np.abs(truth().shape), rel=2e-3)
    with pytest.raises(ToolpointError, match="driving-point"):
        scale_by_driving_point(operational, frequency_response.direct(system(), np.arange(2.0, 60.0, 0.5)))


def test_a_model_gives_the_scale() -> None:
    scaled = scale_by_model(unscaled(truth(), 4), truth())
    assert np.abs(scaled.shape) == pytest.approx(np.abs(truth().shape), rel=1e-9)
    with pytest.raises(ToolpointError, match="unit modal mass"):
        scale_by_model(unscaled(truth()), unscaled(truth()))
