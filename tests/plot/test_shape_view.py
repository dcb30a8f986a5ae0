"""The animated shape page in a real browser: what it draws, what it asks for, how it is driven."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.plot import AnimatedShapes, Scene, ShapeView
from toolpoint.plot.shape_view.view import pack_array

VIEW = "window.toolpointViews.shapes"
NO_WEBGL = """const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return String(kind).startsWith("webgl") ? null : get.call(this, kind, ...rest); };"""


def picture(seen):
    """The canvas once it has drawn what was asked of it, and stands still: a busy machine may take some frames."""
    canvas, before = seen.page.locator(".tp-stage canvas"), None
    canvas.scroll_into_view_if_needed()  # what is not in the window is not drawn
    for _ in range(200):
        seen.wait(f"!{VIEW}.dirty")
        seen.wait_for_frames()
        now = canvas.screenshot()
        if now == before:
            return now
        before = now
    raise AssertionError("the view never stands still")


@pytest.fixture
def view(machine, shapes):
    return ShapeView(machine, shapes, title="A small machine")


@pytest.mark.slow
def test_pixels_change_between_phases_and_between_modes(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    seen.page.evaluate(f"{VIEW}.setPhase(0)")
    start = picture(seen)
    assert picture(seen) == start  # at rest nothing moves: differences below are the shape's
    seen.page.evaluate(f"{VIEW}.setPhase(Math.PI)")
    assert picture(seen) != start
    seen.page.evaluate(f"{VIEW}.showMode(2); {VIEW}.setPhase(0)")
    assert picture(seen) != start
    seen.page.evaluate(f"{VIEW}.showMode(0); {VIEW}.setPhase(0)")
    assert picture(seen) == start
    assert seen.errors == []


@pytest.mark.slow
def test_page_asks_no_host_and_is_small(opened, view):
    html = view.html()
    seen = opened(html)
    seen.page.wait_for_timeout(300)
    assert [url for url in seen.requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert len(seen.requests) == 1
    assert seen.errors == []
    assert len(html) < 100_000
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", html)


def test_policy_stops_requests_and_foreign_scripts(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    blocked = seen.page.evaluate("fetch('http://127.0.0.1:9/x').then(() => 'sent', () => 'refused')")
    assert blocked == "refused" and any("Content Security Policy" in error for error in seen.errors)
    seen.page.evaluate("""const s = document.createElement('script'); s.textContent = 'window.broken = 1';
        document.body.append(s)""")
    assert seen.page.evaluate("window.broken") is None


@pytest.mark.slow
def test_shader_positions_are_the_real_part_of_the_turned_shape(opened, view, machine, shapes):
    seen = opened(view.html(), reduced_motion="reduce")
    for mode, phase in itertools.product(range(3), [0.0, np.pi / 2, 2.2]):
        seen.page.evaluate(f"{VIEW}.showMode({mode}); {VIEW}.setPhase({phase})")
        drawn = np.reshape(seen.page.evaluate(f"{VIEW}.positions()"), (-1, 3))
        scale = seen.page.evaluate(f"{VIEW}.scale(0)")
        # x + s Re(u exp(i phi)); the shape travels as 16-bit numbers: half a step of 1/32767 of its largest part
        wanted = machine.nodes + scale * np.real(shapes.displacement[mode] * np.exp(1j * phase))
        step = scale * np.abs(shapes.displacement[mode]).max() / 32767
        np.testing.assert_allclose(drawn, wanted, atol=2 * step + 1e-6)


@pytest.mark.slow
def test_complex_shape_travels_and_real_one_stands_still_at_90_degrees(opened, view, machine):
    seen = opened(view.html(), reduced_motion="reduce")
    for mode, moves in ((0, False), (1, True)):
        seen.page.evaluate(f"{VIEW}.showMode({mode}); {VIEW}.setPhase(Math.PI / 2)")
        drawn = np.reshape(seen.page.evaluate(f"{VIEW}.positions()"), (-1, 3))
        assert (np.abs(drawn - machine.nodes).max() > 0.01) == moves


@pytest.mark.slow
def test_mode_buttons_name_and_change_the_mode(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    buttons = seen.page.locator(".tp-modes button")
    assert buttons.count() == 3
    text = buttons.nth(2).inner_text()
    assert "132.8 Hz" in text and "3.10 %" in text and "swaying" in text
    before = picture(seen)
    buttons.nth(2).click()
    assert seen.page.evaluate(f"{VIEW}.mode") == 2
    assert buttons.nth(2).get_attribute("aria-pressed") == "true"
    assert buttons.nth(0).get_attribute("aria-pressed") == "false"
    assert "132.8 Hz" in seen.page.locator(".tp-caption").inner_text()
    assert picture(seen) != before


@pytest.mark.slow
def test_keyboard_drives_the_view(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    seen.page.locator(".tp-stage canvas").focus()
    still = picture(seen)
    seen.page.keyboard.press("ArrowLeft")
    assert picture(seen) != still
    seen.page.keyboard.press("Home")
    assert picture(seen) == still
    seen.page.keyboard.press("+")
    assert picture(seen) != still
    seen.page.keyboard.press("n")
    assert seen.page.evaluate(f"{VIEW}.mode") == 1
    seen.page.keyboard.press("3")
    assert seen.page.evaluate(f"{VIEW}.mode") == 2
    seen.page.keyboard.press("Space")
    assert seen.page.evaluate(f"{VIEW}.playing") is True


@pytest.mark.slow
def test_mouse_turns_moves_and_zooms(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    box = seen.page.locator(".tp-stage canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    camera = lambda: seen.page.evaluate(f"structuredClone({VIEW}.camera)")
    start = camera()
    seen.page.mouse.move(x, y)
    seen.page.mouse.down()
    seen.page.mouse.move(x + 50, y + 20)
    seen.page.mouse.up()
    turned = camera()
    assert turned["azimuth"] != start["azimuth"] and turned["elevation"] != start["elevation"]
    seen.page.mouse.wheel(0, -300)
    seen.wait(f"{VIEW}.camera.zoom > 1")
    seen.page.keyboard.down("Shift")
    seen.page.mouse.down()
    seen.page.mouse.move(x, y)
    seen.page.mouse.up()
    assert camera()["pan"] != [0, 0]


@pytest.mark.slow
def test_sliders_ghost_and_bodies_change_the_picture(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    still = picture(seen)
    seen.page.get_by_label("column").uncheck()
    without = picture(seen)
    assert without != still
    seen.page.get_by_label("column").check()
    assert picture(seen) == still
    seen.page.get_by_label("Undeformed outline").uncheck()
    assert picture(seen) != still
    seen.page.get_by_label("Amplitude").fill("0")
    drawn = seen.page.evaluate(f"{VIEW}.positions()")
    np.testing.assert_allclose(np.reshape(drawn, (-1, 3)), view.scene.nodes, atol=1e-6)
    seen.page.get_by_label("Phase").fill("90")
    assert seen.page.evaluate(f"{VIEW}.phase") == pytest.approx(np.pi / 2)


def test_readable_message_where_webgl_is_missing(opened, view):
    seen = opened(view.html(), script=NO_WEBGL)
    message = seen.page.get_by_role("alert")
    assert "WebGL2" in message.inner_text()
    assert message.is_visible()
    assert seen.page.locator("canvas").count() == 0
    assert "21.50 Hz" in seen.page.locator(".tp-modes").inner_text()  # the figures stay readable
    assert seen.errors == []


@pytest.mark.slow
def test_reduced_motion_starts_at_rest_and_full_motion_plays(opened, view):
    for preference, plays in (("reduce", False), ("no-preference", True)):
        seen = opened(view.html(), reduced_motion=preference)
        assert seen.page.evaluate(f"{VIEW}.playing") is plays
        if plays:
            seen.wait(f"{VIEW}.phase > 0")
        else:
            seen.page.wait_for_timeout(250)
            seen.wait_for_frames()
            assert seen.page.evaluate(f"{VIEW}.phase") == 0


@pytest.mark.slow
def test_dark_and_light_differ(opened, view):
    pages = [opened(view.html(), color_scheme=scheme, reduced_motion="reduce") for scheme in ("dark", "light")]
    colours = [seen.page.evaluate("getComputedStyle(document.body).backgroundColor") for seen in pages]
    assert colours[0] != colours[1]


@pytest.mark.slow
def test_set_shape_from_a_script(opened, view, machine):
    seen = opened(view.html(), reduced_motion="reduce")
    count = machine.nodes.size
    seen.page.evaluate(f"{VIEW}.setShape({{real: new Array({count}).fill(1), frequency: 99, damping: 0.01}})")
    seen.page.evaluate(f"{VIEW}.setPhase(0)")
    moved = np.reshape(seen.page.evaluate(f"{VIEW}.positions()"), (-1, 3)) - machine.nodes
    np.testing.assert_allclose(moved, seen.page.evaluate(f"{VIEW}.scale(0)"), rtol=1e-4)
    assert "99.00 Hz" in seen.page.locator(".tp-caption").inner_text()
    with pytest.raises(Exception, match="the scene needs"):
        seen.page.evaluate(f"{VIEW}.setShape({{real: [1, 2, 3]}})")


@pytest.mark.slow
def test_two_scenes_side_by_side_move_together(opened, machine, shapes):
    points = dict(enumerate(machine.nodes))
    wire = Scene.of_points(points, [(i, i + 1) for i in range(7)])
    pair = ShapeView(machine, shapes, other=(wire, shapes.selected([2, 1, 0]), "Test"), title="Model")
    seen = opened(pair.html(), reduced_motion="reduce")
    seen.page.evaluate(f"{VIEW}.showMode(0); {VIEW}.setPhase(0.5)")
    for pane, mode in ((0, 0), (1, 2)):
        drawn = np.reshape(seen.page.evaluate(f"{VIEW}.positions({pane})"), (-1, 3))
        scale = seen.page.evaluate(f"{VIEW}.scale({pane})")
        np.testing.assert_allclose(drawn, machine.nodes + scale * shapes.at_phase(0.5)[mode], atol=1e-4)
    assert seen.page.locator(".tp-caption").count() == 2
    assert seen.errors == []


def test_names_cannot_start_a_script(opened, machine, shapes):
    evil = "</script ><script >window.broken = 1</script><img src=x onerror='window.broken = 2'>"
    scene = Scene(machine.nodes, machine.triangles, machine.lines, machine.node_body, (evil, "b", "c", "d"))
    labelled = AnimatedShapes(shapes.frequency, shapes.damping_ratio, shapes.displacement, (evil,) * 3, notes=(evil,))
    seen = opened(ShapeView(scene, labelled, title=evil, caption=evil).html(), reduced_motion="reduce")
    seen.page.wait_for_timeout(100)
    assert seen.page.evaluate("window.broken") is None
    assert seen.page.locator("img").count() == 0
    assert "onerror" in seen.page.locator(".tp-modes").inner_text()  # shown as text
    assert seen.errors == []


@pytest.mark.slow
def test_mode_of_zeros_is_drawn_at_rest(opened, machine):
    still = AnimatedShapes([10.0], [0.0], np.zeros((1, machine.nodes.shape[0], 3)))
    seen = opened(ShapeView(machine, still).html(), reduced_motion="reduce")
    drawn = np.reshape(seen.page.evaluate(f"{VIEW}.positions()"), (-1, 3))
    np.testing.assert_allclose(drawn, machine.nodes, atol=1e-6)
    assert seen.errors == []


def test_wrong_pairs_are_refused(machine, shapes):
    with pytest.raises(ToolpointError, match="must be the 8 nodes"):
        ShapeView(Scene(machine.nodes[:8]), shapes)
    with pytest.raises(ToolpointError, match="equally many"):
        ShapeView(machine, shapes, other=(machine, shapes.selected([0]), ""))
    with pytest.raises(ToolpointError, match="name"):
        ShapeView(machine, shapes, name="a b")


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2, 300, 20_000])
def test_packed_arrays_arrive_exactly(opened, view, count):
    rng = np.random.default_rng(count)
    seen = opened(view.html(), reduced_motion="reduce")
    cases = [
        (rng.normal(size=(count, 3)), "<f4", "Float32Array"),
        (np.tile(np.arange(count), (3, 1)).T + 70_000, "<u4", "Uint32Array"),
        (rng.integers(-32767, 32768, (count, 3)), "<i2", "Int16Array"),
        (rng.integers(0, 2, count), "u1", "Uint8Array"),
        (rng.integers(0, 3, (count, 2)) + 65_530, "<u2", "Uint16Array"),
        (np.zeros((0, 3), int), "<u2", "Uint16Array")]
    for values, kind, name in cases:
        back = seen.page.evaluate(f"(p) => Array.from(new {name}(window.ToolpointData(p)))", pack_array(values, kind))
        assert np.array_equal(back, np.asarray(values).astype(kind).ravel())


@pytest.mark.slow
def test_a_slow_machine_gets_less_detail_in_motion_and_all_of_it_at_rest(opened, view):
    seen = opened(view.html(), reduced_motion="reduce")
    still, width = picture(seen), seen.page.evaluate(f"{VIEW}.canvas.width")
    seen.page.evaluate(f"{VIEW}.level = 4; {VIEW}.play(true)")
    seen.wait(f"{VIEW}.canvas.width < {width}")  # at the next frame, whenever a busy machine draws it
    seen.page.evaluate(f"{VIEW}.setPhase(0)")
    assert seen.page.evaluate(f"{VIEW}.canvas.width") == width
    assert picture(seen) == still


@pytest.mark.slow
def test_a_large_scene_moves_with_fewer_faces_says_so_and_rests_with_all(opened):
    x, y = np.meshgrid(np.linspace(0, 1, 61), np.linspace(0, 1, 61), indexing="ij")
    nodes = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    at = np.arange(61 * 61).reshape(61, 61)
    p, q, r, s = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel()
    scene = Scene(nodes, np.concatenate([np.stack([p, q, r], -1), np.stack([q, s, r], -1)]), np.zeros((0, 2), int))
    shape = np.zeros((1, 61 * 61, 3), complex)
    shape[0, :, 2] = np.sin(3 * x.ravel())
    seen = opened(ShapeView(scene, AnimatedShapes(np.array([20.0]), 0.01, shape)).html(), reduced_motion="reduce")
    own = f"{VIEW}.renderer.panes[0]"
    assert seen.page.evaluate(f"{own}.faceCount") == 3 * 7200
    assert 0 < seen.page.evaluate(f"{own}.coarseCount") < 3 * 2400
    still, note = picture(seen), seen.page.locator(".tp-coarse")
    assert not note.is_visible()
    seen.page.evaluate(f"{VIEW}.level = 4; {VIEW}.play(true)")
    seen.wait("!document.querySelector('.tp-coarse').hidden")
    seen.page.evaluate(f"{VIEW}.setPhase(0)")
    assert not note.is_visible() and picture(seen) == still and seen.errors == []


@pytest.mark.slow
def test_a_printer_gets_a_picture_on_white_also_in_the_dark_and_while_it_moves(opened, view):
    seen = opened(view.html(), color_scheme="dark")
    seen.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    corner, drawn = seen.page.evaluate("""() => {
      const canvas = document.querySelector('canvas.tp-print'), context = canvas.getContext('2d');
      const all = context.getImageData(0, 0, canvas.width, canvas.height).data;
      let other = 0;
      for (let i = 0; i < all.length; i += 4) if (all[i] + all[i + 1] + all[i + 2] < 705) other += 1;
      return [[...all.slice(0, 4)], other]; }""")
    assert corner == [255, 255, 255, 255] and drawn > 1000
    seen.page.emulate_media(media="print")
    assert seen.page.locator("canvas.tp-print").is_visible() and seen.errors == []
