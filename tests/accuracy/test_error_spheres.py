"""Error spheres along a side: the mean of their radii is the side's, and they lie on the path."""

import re

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.pages import accuracy_page
from toolpoint.plot.figures.machines.screening import sphere_path
from toolpoint.studies import MillingSetup, line
from toolpoint.studies.accuracy.error_spheres import spheres_along
from toolpoint.studies.accuracy.milling_accuracy import MillingAccuracy
from toolpoint.studies.accuracy.side_run import SideAccuracy

TOOTH = 100.0  # Hz


def side(error, duration=1.0, path=True):
    """A side of 0.1 m along the diagonal of x and z with an error along y, one sample a millisecond."""
    time = np.arange(0.0, duration, 1e-3)
    relative = np.zeros((len(time), 6))
    relative[:, 1] = error(time)
    course = line((0.2, 0.5, 0.1), (0.28, 0.5, 0.16))[0] if path else None
    return SideAccuracy("side 1", (0.0, duration), time, 0.1 * time / duration, relative, np.zeros((0, 6)), 0.0, None,
                        path=course)


def test_spheres_share_the_error_of_the_side_and_lie_on_its_path():
    wave = side(lambda t: 1e-5 * np.sin(2 * np.pi * TOOTH * t) * (1 + t))
    spheres = spheres_along(wave, TOOTH)
    assert spheres.radii.mean() == pytest.approx(wave.position_error, rel=1e-2)
    assert (np.diff(spheres.radii) > 0).all()  # the wave grows along the way
    direction = np.array([0.8, 0.0, 0.6])
    along = (spheres.centres - [0.2, 0.5, 0.1]) @ direction
    assert spheres.centres == pytest.approx([0.2, 0.5, 0.1] + along[:, None] * direction, abs=1e-12)
    assert len(along) == 10  # ten periods a sphere


def test_a_short_run_is_one_sphere_and_a_side_without_its_path_is_refused():
    assert len(spheres_along(side(np.cos, duration=0.05), TOOTH).radii) == 1
    with pytest.raises(ToolpointError, match="side 1 without its path"):
        spheres_along(side(np.cos, path=False), TOOTH)


def test_circles_are_drawn_at_the_scale_that_the_page_states():
    wave = side(lambda t: 1e-5 * np.sin(2 * np.pi * TOOTH * t))
    text = accuracy_page(MillingAccuracy("slide", MillingSetup(speed=60 * TOOTH, depth=1e-3), (wave,)), 1).html()
    stated = float(re.search(r"Circles are drawn ([\d.e+]+) times the size", text).group(1))
    radius = 1e6 * spheres_along(wave, TOOTH).radii.max()
    assert stated * 1e-3 * radius == pytest.approx(0.04 * 80, rel=0.5)
    courses = [np.array([[0.0, 0.0], [10.0, 0.0]])]
    chart = sphere_path(courses, np.array([[5.0, 0.0]]), np.array([20.0]), axes=("x, mm", "y, mm"), scale=100.0,
                        quantity="radius, µm")
    circle = next(trace for trace in chart.data if trace.name == "error spheres")
    distance = np.hypot(np.array(circle.x[:-1]) - 5.0, np.array(circle.y[:-1]))
    assert distance == pytest.approx(np.full(len(distance), 2.0))
