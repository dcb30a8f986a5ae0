"""Cartesian chains: ISO 841 signs, closed-form inverse, refusal of what cannot be reached."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint.kinematics import cartesian

TOOL, TABLE = (0, (0.0, 0.0, 0.5)), (2, (0.0, 0.0, 0.0))


def test_positive_axes_move_the_tool_relative_to_the_work_in_the_positive_direction():
    chain = cartesian(["Z"], ["Y", "X"])
    for k, name in enumerate("XYZ"):
        step = chain.relative_position({name: 0.1}, TOOL, TABLE) - chain.relative_position({}, TOOL, TABLE)
        np.testing.assert_allclose(step[0], 0.1 * np.eye(3)[k], atol=1e-12)


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_inverse_undoes_forward(position):
    chain = cartesian(["Z"], ["Y", "X"])
    pose = chain.inverse(position, TOOL, TABLE)
    np.testing.assert_allclose(chain.relative_position(pose, TOOL, TABLE)[0], position, atol=1e-12)


def test_places_out_of_reach_are_refused():
    with pytest.raises(ValueError, match="cannot be reached"):
        cartesian(["Z"], ["X"]).inverse((0, 0.3, 0), (0, (0, 0, 0.5)), (1, (0, 0, 0)))
