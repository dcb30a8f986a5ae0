"""Levels of depth at which the engines look, and bands of depths that lie between them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cutting.cutting_cases import altintas
from toolpoint import Modes
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    HillDeterminant,
    MillingProblem,
    PanelArnoldi,
    Tool,
    stability,
)
from toolpoint.cutting.stability.levels import LEVELS_PER_AXIAL_PITCH, MAX_ADDED_LEVELS, axial_pitch, depth_levels
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.panels.bumps import Level, predict_meeting


@given(teeth=st.integers(1, 8), helix=st.floats(0, 60), reach=st.floats(0.01, 40), number=st.integers(4, 60),
       power=st.sampled_from([1.5, 2.0]))
def test_levels_follow_the_axial_pitch(teeth: int, helix: float, reach: float, number: int, power: float) -> None:
    """The engine's own depths are all among them, every multiple of the pitch is, and no gap is above a sixth of a pitch, as
    long as that asks for fewer levels than are allowed."""
    problem = altintas().changed(tool=Tool(0.0254, teeth, helix=np.radians(helix)))
    depth_max = 0.02 * reach
    levels = depth_levels(problem, depth_max, number, power=power)
    grid = depth_max * (np.arange(1, number + 1) / number) ** power
    pitch = axial_pitch(problem)
    assert levels[-1] == pytest.approx(depth_max) and (np.diff(levels) > 0).all() and levels[0] > 0
    step = max(pitch / LEVELS_PER_AXIAL_PITCH, depth_max / MAX_ADDED_LEVELS)
    assert np.diff(levels, prepend=0.0).max() <= max(1.002 * step, 1e-12) or levels.size == number
    assert all(np.abs(levels - w).min() <= 1.1e-3 * step for w in grid)
    if pitch / LEVELS_PER_AXIAL_PITCH > depth_max / MAX_ADDED_LEVELS and levels.size > number:
        assert all(np.abs(levels - w).min() <= 1.1e-3 * step for w in pitch * np.arange(1, int(depth_max / pitch) + 1))


def test_axial_pitch() -> None:
    """pi D/(N tan beta): 10 mm, four edges, 45 degrees: 7.853981634 mm."""
    tool = Tool(0.010, 4, helix=np.pi / 4)
    assert axial_pitch(altintas().changed(tool=tool)) == pytest.approx(7.853981634e-3)
    assert axial_pitch(altintas().changed(tool=Tool(0.010, 4))) == np.inf


def two_modes(hertz: list[float], damping: list[float], stiffness: list[float], angle: list[float]) -> Modes:
    """Modes in these directions of the plane."""
    shapes = 2 * np.pi * np.array(hertz) / np.sqrt(stiffness) * np.stack([np.cos(angle), np.sin(angle)])
    return Modes(hertz, damping, shapes, ("tool:+x", "tool:+y"))


HIDDEN = {  # one edge, 10 mm, low immersion: a band behind the first limit, narrower than a hundredth of the depths charted
    "after a flip": (0.52728626, 2.765338925, (1112.47e6, 124.299e6), 18527.63, 0.2024,
                     ([659.0081, 1659.6876], [0.0091274, 0.0291803], [15.423996e6, 25.945774e6], [0.998075, 2.992051])),
    "45 degrees": (np.pi / 4, 2.690565842, (1408.676e6, 553.529e6), 33846.76, 0.0916,
                   ([716.64998, 1151.29329], [0.01133, 0.0278249], [5.1273786e6, 6.4966529e6], [0.3229098, 2.6094385])),
}


def hidden(name: str) -> tuple[MillingProblem, float, float]:
    """The problem, the speed and the largest depth."""
    helix, start, (tangential, radial), speed, depth_max, modes = HIDDEN[name]
    arc = Engagement(start, np.pi)
    problem = MillingProblem(Tool(0.010, 1, helix=helix), arc, CuttingCoefficients(tangential, radial), two_modes(*modes))
    return problem, speed, depth_max


ENGINES = [("after a flip", HillDeterminant()), ("45 degrees", HillDeterminant()),
           pytest.param("45 degrees", FloquetDeterminant(), marks=pytest.mark.slow),
           pytest.param("after a flip", FloquetDeterminant(), marks=pytest.mark.slow)]


@pytest.mark.parametrize(("name", "counting"), ENGINES, ids=str)
@pytest.mark.default_cases(1)
def test_a_stable_band_behind_the_first_limit_is_found(name: str, counting: StabilityMethod) -> None:
    """Where one multiplier comes back and others have not left yet: the largest multiplier over many levels finds the bands
    that engines find which count the multipliers near them."""
    problem, speed, depth_max = hidden(name)
    bands = stability.chart(problem, [speed], PanelArnoldi(), depth_max=depth_max).intervals(0)
    assert bands.shape == (2, 2)
    near = stability.chart(problem, [speed], counting, depth_max=1.03 * bands[1, 1])
    assert near.intervals(0) == pytest.approx(bands, rel=1e-5)
    assert near.change[:3].tolist() == [1, -1, 2]


def test_a_pair_that_meets_between_two_levels_is_looked_at_there() -> None:
    """Real at one level, complex at the next, its mean inside the circle at the meeting: there, by the two lines' crossing."""
    real, complex_ = Level(1.0, 0.2, -0.10, -1.04), Level(2.0, 0.02, 0.02, -0.99)
    place = predict_meeting((None, real, complex_, None))
    assert place == pytest.approx(1.8)  # 1 - |c| vanishes after 0.04/0.05 of the way
    assert predict_meeting((None, Level(1.0, 0.4, 0.3, -1.04), complex_, None)) is None  # the mean stays outside
