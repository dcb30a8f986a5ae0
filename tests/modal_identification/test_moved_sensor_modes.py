"""Modes that stay where the mass of a moved sensor was taken out: never a faint one without a shape."""

import numpy as np

from toolpoint.modal_identification.judgement.moved_sensor import steady_modes
from toolpoint.vibration import Modes


def test_faint_modes_without_a_shape_are_no_modes_and_loud_or_real_ones_are():
    rng = np.random.default_rng(0)
    real, turning = rng.standard_normal(30), rng.standard_normal(30) + 1j * rng.standard_normal(30)
    shape = np.stack([real, turning, 1e-2 * real[::-1], 1e-2 * turning[::-1]], axis=1).astype(complex)
    labels = [f"{point}:+{way}" for point in range(1, 11) for way in "xyz"]
    modes = Modes([30.0, 40.0, 50.0, 60.0], [0.02] * 4, shape, labels, "modal A", participation=shape[:2],
                  input_dofs=labels[:2])
    assert steady_modes(modes) == [0, 1, 2]
