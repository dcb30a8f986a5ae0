"""The page of a calibration in a browser: measured points and fitted lines over rotation, and the table."""

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, MillingProblem, Tool
from toolpoint.cutting.build import engagement_of
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.force.calibration import average_force, forces_of_fit, instantaneous
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.pages.cuts.calibration import calibration_page
from toolpoint.studies.cuts.forces.calibration import CalibrationStudy, CuttingTest


@pytest.mark.slow
def test_measured_and_fitted_forces_are_drawn_over_rotation(opened):
    cut = CuttingDescription.of(diameter=0.016, teeth=4, immersion=0.5, tangential=7e8, normal=2e8, helix=0.5)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    problem = MillingProblem(Tool(0.016, 4, helix=0.5), engagement_of(cut), CuttingCoefficients(7e8, 2e8), rigid)
    feeds, angle = np.array([0.5e-4, 1e-4]), np.linspace(0, 2 * np.pi, 90, endpoint=False)
    force = np.array([rigid_forces(problem.changed(feed_per_tooth=f), 2e-3, angle).force for f in feeds])
    force = force + np.random.default_rng(0).standard_normal(force.shape)
    fit = instantaneous(problem, feeds, angle, forces=force, depth=2e-3)
    fitted = forces_of_fit(problem, fit, feeds, angle=angle, depth=2e-3)
    average = average_force(problem, feeds, force.mean(1), depth=2e-3)
    test = CuttingTest({}, 3000.0, 2e-3)
    found = CalibrationStudy(test, cut, average, fit, feeds, angle, force, fitted, ("slow <b>.csv", "fast.csv"))
    seen = opened(calibration_page(found).html(), reduced_motion="reduce")
    seen.wait("['means', 'forces0', 'forces1'].every(name => name in (window.toolpointCharts || {}))")
    drawn = seen.page.evaluate("Array.from(window.toolpointCharts.forces1.data, trace => trace.name)")
    assert drawn == [f"F{way} {kind}" for way in "xyz" for kind in ("measured", "fitted")]
    values = seen.page.evaluate("window.toolpointCharts.forces1.calcdata[1].map(point => point.y)")
    np.testing.assert_allclose(values, fitted[1, :, 0], rtol=1e-6)
    shown = seen.page.content()
    assert "K<sub>te</sub>" in shown and "95 % interval" in shown and "Fit of the mean forces" in shown
    assert seen.errors == [] and len(seen.requests) == 1
