"""A mode that a test holds twice counts once, said; joints are those of the test without it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from joint_identification import p1_case as p1
from toolpoint import ToolpointError
from toolpoint.machine.components import Components
from toolpoint.studies import study_joints
from toolpoint.studies.measured.doubled_modes import leave_doubled_out
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry


def doubled(modes: Modes, number: int, ratio: float, scale: float, noise: float, seed: int = 0) -> Modes:
    """Return modes with one of them once more, at another frequency and of another size."""
    shape = scale * modes.shape[:, [number]]
    shape = shape * (1 + noise * np.random.default_rng(seed).standard_normal(shape.shape))
    return replace(modes, frequency=np.append(modes.frequency, ratio * modes.frequency[number]),
                   damping_ratio=np.append(modes.damping_ratio, modes.damping_ratio[number]),
                   shape=np.hstack([modes.shape, shape]), participation=None, covariance=None, shape_variance=None)


@given(seed=st.integers(0, 10_000), number=st.integers(0, 4), ratio=st.floats(0.996, 1.004),
       scale=st.floats(0.1, 0.9) | st.floats(1.2, 5.0))
def test_the_mode_that_moves_less_is_left_out(seed: int, number: int, ratio: float, scale: float) -> None:
    rng = np.random.default_rng(seed)
    shape = rng.standard_normal((24, 5)) + 1j * rng.standard_normal((24, 5)) * 0.1
    modes = Modes(np.array([20.0, 40.0, 80.0, 160.0, 320.0]), np.full(5, 0.02), shape, [f"{k}:+x" for k in range(24)])
    kept, doubts = leave_doubled_out(doubled(modes, number, ratio, scale, 0.02, seed))
    assert len(doubts) == 1 and kept.count == 5
    stays = modes.frequency[number] * (1.0 if scale < 1 else ratio)
    assert sorted(kept.frequency) == pytest.approx(sorted([*np.delete(modes.frequency, number), stays]))


@pytest.mark.parametrize(("ratio", "noise"), [(1.02, 0.02), (1.001, 0.5), (1.001, 0.0)])
def test_modes_apart_by_frequency_or_shape_stay_and_so_do_exact_copies(ratio: float, noise: float) -> None:
    """A copy to the last digit is a slip in a file, which the joints refuse."""
    shape = np.random.default_rng(3).standard_normal((24, 2))
    modes = Modes(np.array([20.0, 40.0]), np.full(2, 0.02), shape, [f"{k}:+x" for k in range(24)])
    kept, doubts = leave_doubled_out(doubled(modes, 1, ratio, 0.5, noise))
    assert kept.count == 3 and not doubts


@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_joints_of_a_test_with_a_doubled_mode_are_those_without_it() -> None:
    """Before, such a test was refused, and a project ended there."""
    case = p1.case(p1.machine(), np.random.default_rng(1), 30)
    components, geometry = Components("test", p1.CHAIN, case.components, {}), Geometry(case.points, [])
    expected = study_joints(case.truth, geometry, components).joints.joints
    study = study_joints(doubled(case.truth, 2, 1.003, 0.6, 0.01), geometry, components)
    assert any("one mode found twice" in doubt for doubt in study.doubts)
    for joint, other in zip(study.joints.joints, expected, strict=True):
        assert joint.position == pytest.approx(other.position, abs=1e-9)
    with pytest.raises(ToolpointError, match="every mode must be given once"):
        study_joints(doubled(case.truth, 2, 1.0, 1.0, 0.0), geometry, components)
