"""Cuts on structures with overdamped modes: real poles are followed closely or refused, never answered with nonsense."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    FloquetDeterminant,
    MillingProblem,
    PanelArnoldi,
    SemiDiscretization,
    SpeedVariation,
    Tool,
    stability,
)
from toolpoint.cutting.stability.automatic import Automatic
from toolpoint.vibration import Dof, SecondOrderSystem, eigen, frequency_response

SPEEDS = np.array([2000.0, 3000.0])


def cut_on_a_damper(damper, helix=0.0):
    """A mass on a spring carries the tool's own by a spring and a damper that joins them more and more firmly."""
    joint = np.array([[1, -1], [-1, 1.0]])
    system = SecondOrderSystem(
        np.diag([10.0, 1.0]), np.diag([5e6, 0]) + 1e6 * joint, np.diag([300.0, 0]) + damper * joint,
        output_map=np.array([[0, 1.0]]), input_map=np.array([[0], [1.0]]), outputs=[Dof("t", "+y")], inputs=[Dof("t", "+y")])
    modes = eigen.solve_damped(system)
    lines = np.linspace(1, 800, 20)
    np.testing.assert_allclose(frequency_response.modal(modes, lines).values, frequency_response.direct(system, lines).values,
                               rtol=1e-9)
    return MillingProblem(Tool(20e-3, 3, helix=helix), Engagement.down(0.3), CuttingCoefficients(8e8, 3e8), modes, None, "t:+y")


@pytest.mark.parametrize("damper", [2e3, pytest.param(3e3, marks=pytest.mark.slow), 8e3])
@pytest.mark.parametrize("method", [pytest.param(PanelArnoldi(), marks=pytest.mark.slow), FloquetDeterminant(),
                                    pytest.param(Automatic(), marks=pytest.mark.slow)])
def test_limits_with_real_poles_are_those_of_semi_discretization(method, damper):
    cut = cut_on_a_damper(damper)
    if isinstance(method, FloquetDeterminant) and damper > 5e3:
        with pytest.raises(ToolpointError, match="overdamped"):
            stability.chart(cut, SPEEDS, method, depth_max=0.05)
        return
    # The same within a part in a hundred (second order in 1/intervals).
    expected = stability.chart(cut, SPEEDS, SemiDiscretization(intervals=100), depth_max=0.05).limit
    np.testing.assert_allclose(stability.chart(cut, SPEEDS, method, depth_max=0.05).limit, expected, rtol=8e-3)


@pytest.mark.parametrize("method", [PanelArnoldi(), pytest.param(Automatic(), marks=pytest.mark.slow)])
@pytest.mark.parametrize("damper", [pytest.param(2e4, marks=pytest.mark.slow), 2e6])
def test_dampers_that_decay_beyond_double_precision_are_integrated_in_closed_form(method, damper):
    """Real poles of -22 000 and -2 200 000 1/s, which decay by exp(-22 000) in a tooth period."""
    cut = cut_on_a_damper(damper)
    expected = stability.chart(cut, SPEEDS, SemiDiscretization(intervals=100), depth_max=0.05).limit
    np.testing.assert_allclose(stability.chart(cut, SPEEDS, method, depth_max=0.05).limit, expected, rtol=8e-3)


@pytest.mark.parametrize("damper", [2e4, 2e6])
def test_dampers_beyond_double_precision_are_refused_with_what_to_use(damper):
    with pytest.raises(ToolpointError, match=r"overdamped mode that decays by exp.*--method panel, zero-order"):
        stability.chart(cut_on_a_damper(damper), SPEEDS, FloquetDeterminant(), depth_max=0.05)
    varied = cut_on_a_damper(damper).changed(speed_variation=SpeedVariation(0.1))
    with pytest.raises(ToolpointError, match="PanelArnoldi with a varying speed"):
        stability.chart(varied, SPEEDS, PanelArnoldi(), depth_max=0.05)
