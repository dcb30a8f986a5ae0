"""The motion that a virtual video shows: the free response of the machine with all its damping."""

import numpy as np
import pytest
import scipy.linalg

from toolpoint import ToolpointError
from toolpoint.studies.video.virtual_video import ring
from toolpoint.vibration import SecondOrderSystem, eigen, frequency_response

MASS = np.diag([3.0, 2.0, 1.0])
STIFFNESS = 1e5 * np.array([[6.0, -2.0, 0.0], [-2.0, 3.0, -1.0], [0.0, -1.0, 1.0]])
TIMES = np.linspace(0.0, 0.4, 300)


def in_modes(system, motion):
    _, vectors = eigen.mass_normalised(system.mass, system.stiffness)
    return motion @ np.linalg.inv(vectors).T


@pytest.mark.parametrize("damper", [30.0, 2000.0], ids=["oscillating", "overdamped"])
def test_dampers_that_couple_modes_ring_as_the_state_matrix(damper):
    damping = np.zeros((3, 3))
    damping[2, 2] = damper
    system = SecondOrderSystem(MASS, STIFFNESS, damping)
    inverse = np.linalg.inv(MASS)
    state = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ STIFFNESS, -inverse @ damping]])
    start = np.concatenate([np.zeros(3), inverse[:, 0]])
    exact = np.stack([scipy.linalg.expm(state * t) @ start for t in TIMES])[:, :3]
    assert ring(system)(TIMES) == pytest.approx(in_modes(system, exact), abs=1e-9 * np.abs(exact).max())


def test_loss_factors_ring_as_the_response_at_positive_frequencies():
    """Its motion begins a little before the blow; well after it, both are the inverse transform of the response."""
    loss = np.array([[0.02, 0, 0], [0, 0.0, 0], [0, 0, 0.3]]) * np.diag(STIFFNESS)
    system = SecondOrderSystem(MASS, STIFFNESS, structural_damping=loss)
    lines = np.arange(1, 40000) * 0.05
    response = frequency_response.direct(system, lines).values[:, :, 0]
    late = TIMES[TIMES > 0.15][::20]
    motion = 2 * 0.05 * np.real(np.stack([np.exp(2j * np.pi * lines * t) @ response for t in late]))
    # The static line, which a sum over positive lines holds half of.
    motion += 0.05 * np.real(np.linalg.inv(STIFFNESS + 1j * loss)[:, 0])
    exact = in_modes(system, motion)
    assert ring(system)(late) == pytest.approx(exact, abs=0.01 * np.abs(exact).max())


def test_a_machine_that_is_not_held_is_refused():
    loose = SecondOrderSystem(np.eye(2), 1e4 * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    with pytest.raises(ToolpointError, match="1 motions without stiffness; must be held"):
        ring(loose)
