"""Measured responses beside a machine's: the error over each joint parameter in closed form, FRAC, points that are missing."""

import numpy as np
import pytest

from toolpoint.machine import assemble, build
from toolpoint.machine import description as d
from toolpoint.studies.video.response_error import SWEPT_FACTORS, compare_updated, points_missing, sweep_response_error
from toolpoint.vibration import Frf, frequency_response

MASS, STIFFNESS, DAMPING = 100.0, {"x": 4e6, "y": 9e6}, {"x": 800.0, "y": 0.0}
LINES = np.linspace(5.0, 80.0, 60)


def slide(factor=1.0):
    """A body of 100 kg on a spring and a damper along x and a spring along y."""
    inertia = d.InertiaDescription(1.0, 1.0, 1.0)
    joint = d.JointDescription("ground", "head", stiffness={"x": factor * STIFFNESS["x"], "y": STIFFNESS["y"]}, damping=DAMPING)
    return build(d.MachineDescription("slide", {"head": d.BodyDescription(MASS, inertia=inertia)}, {"slide": joint},
                                      points={"tip": d.PointDescription("head")}))


def response(stiffness, damping=DAMPING["x"]):
    w = 2 * np.pi * LINES
    return -(w**2) / (stiffness + 1j * w * damping - w**2 * MASS)  # accelerance


def test_error_over_each_parameter_is_that_of_the_closed_form():
    """Along x the spring and the damper of x alone move the error; that of y cannot be told from x."""
    test = frequency_response.direct(assemble(slide(1.3), None, ["tip:+x"]), LINES, "accelerance")
    result = sweep_response_error(slide(), [test])
    exact = response(1.3 * STIFFNESS["x"])
    assert result.paths == ("joints.slide.stiffness.x", "joints.slide.stiffness.y", "joints.slide.damping.x")
    for row, curves in ((0, [response(f * STIFFNESS["x"]) for f in SWEPT_FACTORS]),
                        (2, [response(STIFFNESS["x"], f * DAMPING["x"]) for f in SWEPT_FACTORS])):
        wanted = [np.linalg.norm(curve - exact) / np.linalg.norm(exact) for curve in curves]
        np.testing.assert_allclose(result.error[row], wanted, rtol=1e-9)
    np.testing.assert_allclose(result.error[1], result.unchanged, rtol=1e-9)
    assert result.ranking[-1] == 1 and result.rows()[-1][0] == "joints.slide.stiffness.y"


def test_two_tests_are_weighed_together_and_an_update_is_judged_by_frac():
    along_x, along_y = (frequency_response.direct(assemble(slide(1.3), None, [f"tip:+{way}"]), LINES) for way in "xy")
    both = sweep_response_error(slide(), [along_x, along_y])
    powers = [float((np.abs(test.values) ** 2).sum()) for test in (along_x, along_y)]
    alone = sweep_response_error(slide(), [along_x]).unchanged
    assert both.unchanged == pytest.approx(alone * np.sqrt(powers[0] / sum(powers)), rel=1e-9)
    result = compare_updated(slide(), slide(1.3), along_x, band=(10.0, 70.0))
    (name, before, after), = result.rows()
    assert (name, after) == ("tip:+x / tip:+x", "1.0000") and float(before) < 0.9
    assert result.error.unchanged < 1e-9 and result.measured.frequency[0] >= 10.0


def test_points_that_the_machine_lacks_are_named():
    values = np.ones((3, 2, 1))
    assert points_missing(slide(), Frf([1.0, 2.0, 3.0], values, ["tip:+x", "7:+x"], ["blow:+x"])) == ["7", "blow"]
