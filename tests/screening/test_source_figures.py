"""Figures of the robot's source by its equations: closed forms of its forces and of the zero-order limit of one mode."""

from importlib import resources

import numpy as np
import pytest

from toolpoint.io import read_machine
from toolpoint.studies.screening.source_figures import _zero_order, compute_source_figures


@pytest.fixture(scope="module")
def figures():
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        return compute_source_figures(read_machine(path), {"q2": 0.2, "q3": -0.5, "q5": 0.5})


@pytest.mark.slow
def test_forces_are_those_of_the_printed_constants(figures):
    # Table 6 of the source: 1780 and 593 N/mm2, 9 and 7 N/mm, 0.01 mm, for a millimetre of depth.
    middle = len(figures.angle) // 2
    assert figures.force[middle] == pytest.approx([-(5.93 + 7), 17.8 + 9])
    assert figures.force[0] == pytest.approx([-9, -7]) and figures.force[-1] == pytest.approx([9, 7])


def test_the_limit_of_one_mode_is_its_closed_form():
    # Re H of a mode is -1/(4 k zeta (1 + zeta)) at least, and eq. 12 of the source is -1/(K_s Z Re H).
    k, zeta, natural = 1e6, 0.03, 300.0
    lines = np.linspace(200, 600, 40001)
    response = 1 / (k * (1 - (lines / natural) ** 2 + 2j * zeta * lines / natural))
    limit = _zero_order(lines, response, np.linspace(2000, 24000, 221), teeth=2, specific=1e9)
    assert np.nanmin(limit) == pytest.approx(4 * k * zeta * (1 + zeta) / (1e9 * 2), rel=1e-3)


@pytest.mark.slow
def test_every_figure_stands_beside_the_sources(figures):
    words = figures.words()
    assert [line.split(",")[0] for line in words] == ["figure 34", "figure 35", "figure 36", "figure 37", "figure 41"]
    assert all("the source" in line for line in words) and "1025 Hz" in words[0]
    assert figures.to_dict()["lobes_hz"]["y"] == figures.lobe_starts("y").tolist()
