"""The identification page in a browser: a click on a stable pole of the diagram shows that pole's own shape."""

import numpy as np
import pytest

from toolpoint.modal_identification import identify
from toolpoint.pages.measured.identification import identification_page
from toolpoint.vibration import Dof, Frf, Modes, frequency_response
from toolpoint.vibration.geometry import Geometry


@pytest.mark.slow
def test_click_on_a_pole_animates_its_shape(opened):
    rng = np.random.default_rng(6)
    points = {i + 1: xyz for i, xyz in enumerate(rng.uniform(0, 1, (6, 3)))}
    dofs = tuple(Dof(point, way) for point in points for way in ("+x", "+y", "+z"))
    modes = Modes([20.0, 45.0], [0.02, 0.02], rng.normal(size=(18, 2)), dofs)
    frf = frequency_response.modal(modes, np.linspace(5, 80, 400), None, inputs=[dofs[0]], quantity="accelerance")
    values = frf.values * (1 + 0.005 * rng.normal(size=frf.values.shape))
    found = identify(Frf(frf.frequency, values, frf.outputs, frf.inputs, "accelerance"))
    seen = opened(identification_page(found, Geometry(points, [(1, 2), (2, 3)]), ["test.uff"]).html(), reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointCharts).length >= 4 && 'poles' in window.toolpointViews")
    chart = seen.page.locator(".tp-chart[data-name=stabilization]")
    stable = chart.locator(".overplot > .xy .trace").nth(-2).locator(".point")  # the last are the modes taken
    for number in (stable.count() - 1, 0):
        seen.click_point("stabilization", stable.nth(number))
        seen.wait(f"window.toolpointViews.poles.mode === {number}")
    assert seen.errors == []
    assert len(seen.requests) == 1


@pytest.mark.slow
def test_one_response_is_drawn_once_and_labels_of_low_modes_do_not_overlap(opened):
    rng = np.random.default_rng(0)
    modes = Modes([2.1, 2.4, 6.2, 8.4, 8.6, 9.5, 55.0], 0.01, rng.normal(size=(1, 7)), ("tip:+x",))
    frf = frequency_response.modal(modes, np.arange(0.5, 100, 0.05), ["tip:+x"], inputs=["tip:+x"])
    noisy = frf.values * (1 + 0.002 * rng.normal(size=frf.values.shape))
    found = identify(Frf(frf.frequency, noisy, frf.outputs, frf.inputs), band=(1, 99))
    html = identification_page(found, None, ["low.txt"]).html()
    assert "AutoMAC" not in html and "worst fit" not in html  # of one response both say nothing
    seen = opened(html, reduced_motion="reduce")
    seen.wait("document.querySelectorAll('.tp-chart').length === Object.keys(window.toolpointCharts).length")
    seen.wait("document.querySelectorAll('.annotation-text-g').length >= 3")
    boxes = seen.page.evaluate("Array.from(document.querySelectorAll('.annotation-text-g'), e => {"
                               "const b = e.getBoundingClientRect(); return [b.left, b.right, b.top, b.bottom]})")
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            assert a[0] >= b[1] or b[0] >= a[1] or a[2] >= b[3] or b[2] >= a[3], (a, b)
    assert seen.errors == []


@pytest.mark.slow
def test_poles_are_chosen_by_clicks_and_the_command_says_so(opened):
    rng = np.random.default_rng(6)
    dofs = tuple(Dof(point, "+x") for point in range(1, 7))
    modes = Modes([20.0, 45.0], [0.02, 0.02], rng.normal(size=(6, 2)), dofs)
    frf = frequency_response.modal(modes, np.linspace(5, 80, 400), inputs=[dofs[0], dofs[3]])
    values = frf.values * (1 + 0.005 * rng.normal(size=frf.values.shape))
    found = identify(Frf(frf.frequency, values, frf.outputs, frf.inputs))
    html = identification_page(found, None, ["a.txt"], command="toolpoint identify a.txt --band 5:80").html()
    seen = opened(html, reduced_motion="reduce")
    seen.wait("Object.keys(window.toolpointPickers).length === 1 && 'fit' in window.toolpointCharts")
    command = seen.page.locator(".tp-picker pre").first
    assert command.inner_text() == "toolpoint identify a.txt --band 5:80"
    chart = seen.page.locator(".tp-chart[data-name=stabilization]")
    taken = chart.locator(".overplot > .xy .trace").last.locator(".point")
    assert taken.count() == found.modes.count
    seen.click_point("stabilization", taken.nth(1))
    removed = f"--remove {found.modes.frequency[1]:.6g}"
    seen.wait(f"document.querySelector('.tp-picker pre').textContent.includes('{removed}')")
    assert "remove:" in seen.page.locator(".tp-picker pre").nth(1).inner_text()
    seen.page.locator(".tp-picker input").nth(1).check()  # by keyboard or tick: it stays after all
    assert "--remove" not in command.inner_text()
    orders = chart.locator(".overplot > .xy .trace").nth(-2).locator(".point")
    seen.click_point("stabilization", orders.nth(orders.count() - 1))  # a stable pole beside a mode: that one is there already
    seen.wait("document.querySelector('.tp-picker p').textContent.includes('already')")
    assert "--add" not in command.inner_text()
    first = seen.page.locator("h3.tp-title", has_text="fit").first.inner_text()
    seen.page.locator("#tp-series-fit-list").select_option(index=2)
    seen.wait("document.querySelector('.tp-chart[data-name=fit]').dataset.shown === '2'")
    assert seen.page.locator("h3.tp-title", has_text="fit").first.inner_text() != first
    assert seen.errors == [] and len(seen.requests) == 1
