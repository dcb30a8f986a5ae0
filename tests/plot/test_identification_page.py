"""The identification page in a browser: a click on a stable pole of the diagram shows that pole's own shape."""

import numpy as np

from toolpoint.app.identify import Geometry, page
from toolpoint.modal_identification import identify
from toolpoint.vibration import Dof, Frf, Modes, frequency_response


def test_click_on_a_pole_animates_its_shape(opened):
    rng = np.random.default_rng(6)
    points = {i + 1: xyz for i, xyz in enumerate(rng.uniform(0, 1, (6, 3)))}
    dofs = tuple(Dof(point, way) for point in points for way in ("+x", "+y", "+z"))
    modes = Modes([20.0, 45.0], [0.02, 0.02], rng.normal(size=(18, 2)), dofs)
    frf = frequency_response.modal(modes, np.linspace(5, 80, 400), None, [dofs[0]], "accelerance")
    values = frf.values * (1 + 0.005 * rng.normal(size=frf.values.shape))
    found = identify(Frf(frf.frequency, values, frf.outputs, frf.inputs, "accelerance"))
    seen = opened(page(found, Geometry(points, [(1, 2), (2, 3)]), ["test.uff"]).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length >= 4 && 'poles' in window.toolpointViews")
    chart = seen.page.locator(".tp-chart[data-name=stabilization]")
    chart.scroll_into_view_if_needed()
    seen.page.wait_for_timeout(300)
    stable = chart.locator(".overplot > .xy .trace").last.locator(".point")
    for number in (stable.count() - 1, 0):
        box = stable.nth(number).bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        seen.page.mouse.move(x + 1, y)
        seen.page.wait_for_timeout(200)
        seen.page.mouse.click(x, y)
        seen.wait(f"window.toolpointViews.poles.mode === {number}")
    assert seen.errors == []
    assert len(seen.requests) == 1
