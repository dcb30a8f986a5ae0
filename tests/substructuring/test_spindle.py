"""A tool on a spindle that answers in both planes: each plane as by receptance coupling, draws together, faults named.

That the whole is the machine with the tool as a body of it stands in tests/machine/test_attached_tool.py.
"""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.studies.cuts.coupling.machine_spindle import tip_frf
from toolpoint.substructuring import (
    ContactDescription,
    PlaneReceptance,
    SegmentDescription,
    ShaftDescription,
    SpindleReceptance,
    couple_spindle,
    couple_tool,
)

LINES = np.linspace(15.0, 1500.0, 300)
ROD = ShaftDescription({"rod": SegmentDescription(0.18, 0.03)})


def test_one_plane_alone_is_the_receptance_carried_through_the_shaft():
    shaft = ShaftDescription({"holder": SegmentDescription(0.06, 0.05, contact=ContactDescription(3e8, 2e5, 0.05)),
                              "tool": SegmentDescription(0.09, 0.016, material="carbide", loss_factor=0.004)})
    section = 1e-8 / (1 - (LINES / 420) ** 2 + 0.05j * LINES / 420)[:, None, None] * np.outer([1, 5.0], [1, 5.0])
    section = section + np.diag([1e-9, 3e-6])
    values = np.zeros((LINES.size, 6, 6), complex)
    values[:, :2, :2], values[:, 2:4, 2:4] = section, 0.7 * section
    coupled = couple_spindle(SpindleReceptance(LINES, values), shaft)
    for tip, scale in zip(coupled.tips, (1.0, 0.7), strict=True):
        expected = couple_tool(PlaneReceptance(LINES, scale * section, tip.plane), shaft).values
        np.testing.assert_allclose(tip.values, expected, rtol=1e-8, atol=1e-8 * np.abs(expected[:, 0, 0]).max())
    assert not np.abs(coupled.cross).max()


def test_draws_of_spindle_and_tool_go_together_and_faults_are_named():
    values = np.zeros((LINES.size, 6, 6), complex) + np.diag([1e-8, 1e-6, 1e-8, 1e-6, 1e-9, 1e-7]) * (1 - 0.02j)
    spindle = SpindleReceptance(LINES, values, np.stack([0.9 * values, 1.1 * values]))
    unsure = replace(ROD, diameter_deviation=0.03)
    with pytest.raises(ToolpointError, match="needs a numpy Generator"):
        couple_spindle(spindle, unsure)
    coupled = couple_spindle(spindle, unsure, generator=np.random.default_rng(1))
    assert all(tip.draws.shape == (2, LINES.size, 2, 2) for tip in coupled.tips)
    np.testing.assert_allclose(coupled.tips[0].draws, coupled.tips[1].draws)  # one tool in both planes
    frf = tip_frf(coupled)
    assert frf.draws.shape == (2, LINES.size, 2, 2) and frf.variance.max() > 0
    with pytest.raises(ToolpointError, match="6 of the section"):
        SpindleReceptance(LINES, values[:, :5, :5])
