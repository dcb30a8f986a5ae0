"""The workbench in headless Chromium: nothing is lost, no old number stands as one of today, and clicks do what commands do."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import tapping

from toolpoint.project import Project, write_demo
from workbench_tabs import PATIENCE_SECONDS, ready, wait

CONTRAST = Path(__file__).with_name("contrast.js")
pytestmark = [pytest.mark.slow, pytest.mark.browser]


def faint_texts(page: Any) -> list[str]:
    """Return the texts of a page whose contrast is below that of WCAG 2.1 AA in one of its themes."""
    script, faults = CONTRAST.read_text(encoding="utf-8"), []
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        faults += [f"{theme}: {fault}" for fault in page.evaluate(script)]
    return faults


@pytest.fixture(scope="module")
def run_demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demo project after its run; tests work on copies."""
    place = tmp_path_factory.mktemp("demo") / "mill"
    write_demo(place)
    Project.open(place).run()
    return place


@pytest.fixture
def demo(run_demo: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(run_demo, tmp_path / "mill"))


def test_a_slider_moves_modes_responses_and_limit_and_undo_takes_it_back(demo, serve, tab):
    page = tab(serve(demo).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")
    first = page.evaluate("[window.Workbench.last.frequency_hz.reduce((a, b) => a + b), window.Workbench.last.limit.limit_m]")
    identifier = "k-joints.column_head.stiffness.rx"
    page.evaluate(f"""() => {{ const s = document.getElementById('{identifier}'); window.Workbench.moves = 0;
                      s.value = 1; s.dispatchEvent(new Event('input')); }}""")
    wait(page, "window.Workbench.moves > 0 && window.Workbench.last.limit.is_exact")  # not the quick one
    moved = page.evaluate("[window.Workbench.last.frequency_hz.reduce((a, b) => a + b), window.Workbench.last.limit.limit_m]")
    assert moved[0] > first[0] and moved[1] != first[1]
    assert "without an interval" in page.inner_text(".wb-limit") and "was changed by hand" in page.inner_text("main")
    assert "column_head rx" in page.inner_text(".wb-changes")
    page.reload()
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")
    assert page.evaluate("window.Workbench.last.limit.limit_m") == moved[1]  # a reload loses nothing
    page.fill("#wb-save-name", "stiffer")
    page.click("text=Save as")
    wait(page, "document.body.innerText.includes('Written: stiffer.yaml')")
    commands = page.evaluate("window.Workbench.last.commands")
    made = subprocess.run([sys.executable, "-m", *re.sub("changed.yaml", "by_command.yaml", commands[0]).split()], cwd=demo)
    assert made.returncode == 0
    assert (demo / "by_command.yaml").read_bytes() == (demo / "stiffer.yaml").read_bytes()
    assert page.errors == []


def test_a_typed_number_needs_its_unit_and_a_wrong_one_is_refused_in_words(demo, serve, tab):
    page = tab(serve(demo).address.replace("#token", "#/machine&token"))
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    row = page.locator(".wb-slider", has=page.locator("[id='k-joints.bed_table.stiffness.x']"))
    row.locator(".wb-value").fill("200 N/um")
    row.locator(".wb-value").press("Enter")
    row.locator(".wb-value").blur()
    wait(page, "window.Workbench.last && document.querySelector('.wb-changes').innerText.includes('bed_table x')")
    row.locator(".wb-value").fill("200 kg")
    row.locator(".wb-value").blur()
    wait(page, "[...document.querySelectorAll('.wb-slider .wb-fault')].some((node) => node.innerText.includes('kg'))")


def test_reload_second_tab_and_a_killed_server_lose_no_job(demo, serve, tab):
    (demo / "project.yaml").write_text((demo / "project.yaml").read_text().replace("speed: 1200 rpm, depth: 7.5 mm",
                                                                                   "speed: 1250 rpm, depth: 7.5 mm"))
    server = serve(demo)
    page = tab(server.address)
    ready(page, "project")
    assert page.inner_text(".answer").startswith("Of an earlier state")  # the file was changed on the disk
    page.get_by_role("button", name="Run the project").click()
    held = server.hold_job()
    wait(page, "document.getElementById('wb-job').innerText.includes('Running')")
    page.reload()
    wait(page, "document.getElementById('wb-job').innerText.includes('Running')")
    other = tab(server.address, beside=page)
    wait(other, "document.getElementById('wb-job').innerText.includes('Running')")
    server.kill()
    wait(page, "!document.getElementById('wb-link').hidden")  # the page says that it may be old
    os.kill(held, signal.SIGKILL)  # it would end with its server, did it run
    server.start()
    held = server.hold_job()
    wait(page, "document.getElementById('wb-link').hidden")
    wait(page, "document.getElementById('wb-job').innerText.includes('Going on')")
    os.kill(held, signal.SIGCONT)
    for place in (page, other):
        wait(place, "document.querySelector('.answer')?.innerText.includes('1250 rev/min')", 3 * PATIENCE_SECONDS)
        wait(place, "!document.querySelector('.answer').innerText.startsWith('Of an earlier state')")
    results = json.loads((demo / "results/project.json").read_text())
    assert results["goals"]["as tested"]["speed_rpm"] == 1250


def test_what_a_command_changes_is_seen_and_old_numbers_are_marked(demo, serve, tab):
    page = tab(serve(demo).address)
    ready(page, "project")
    assert not page.inner_text(".answer").startswith("Of an earlier state")
    add = [sys.executable, "-m", "toolpoint", "add", ".", "--part", "goals.as tested: {speed: 1300 rpm, depth: 7.5 mm}"]
    assert subprocess.run(add, cwd=demo).returncode == 0
    wait(page, "document.querySelector('.answer').innerText.startsWith('Of an earlier state')")
    assert "state.stale" not in page.inner_text("main")
    assert faint_texts(page) == []  # what is of an earlier state is drawn fainter
    page.evaluate("location.hash = '#/lobes'")
    ready(page, "lobes")
    assert page.inner_text(".answer").startswith("Of an earlier state")


def test_a_blow_a_change_a_test_a_joint_and_a_pole_show_what_they_change(demo, serve, tab, tmp_path):
    page = tab(serve(demo).address)
    ready(page, "project")

    def go(view: str) -> None:
        page.evaluate(f"location.hash = '#/{view}'")
        ready(page, view)

    go("blows")
    page.get_by_role("button", name="Accept P6.csv#2").click()  # the double hit: the response follows at once
    wait(page, "document.getElementById('wb-followed')?.innerText.includes('from 131 of 131 hits')")
    assert "the decision changes it by at most" in page.inner_text("#wb-followed")
    go("advice")
    page.get_by_role("button", name="Show the difference: wider guide of the head").click()
    wait(page, "document.querySelectorAll('#wb-difference table').length === 3")
    first, second = (float(text.split()[0]) for text in page.locator(
        "#wb-difference tbody tr").first.locator("td").all_inner_texts()[2:])
    assert second > 1.1 * first  # the limit of the goal, with springs 30 % stiffer
    page.get_by_role("button", name="Show the difference: shapes at").first.click()
    assert "this test narrows it by" in page.inner_text("#wb-narrowed")
    go("machine")
    for colour in ("soft", "sure"):
        page.select_option("#wb-joints", colour)
        wait(page, "document.querySelector('.wb-run [aria-live]').textContent.includes('column_head')")
    go("modes")
    page.get_by_role("button", name="Show the page").first.click()
    frame = page.frame_locator("iframe.wb-page")
    frame.locator(".tp-picker input").first.uncheck(timeout=120_000)
    wait(page, "!document.getElementById('wb-choice').disabled")
    page.evaluate("window.frame = document.querySelector('iframe.wb-page')")
    page.click("#wb-choice")
    wait(page, "document.getElementById('wb-chosen').innerText.includes('choices/structure.yaml')")
    kept = (demo / "choices/structure.yaml").read_bytes()
    assert b"remove:" in kept and b"21.3" in kept
    wait(page, "document.querySelector('.answer').innerText.startsWith('Of an earlier state')")  # the view is drawn anew
    assert page.evaluate("document.querySelector('iframe.wb-page') === window.frame && window.frame.isConnected")
    (tmp_path / "choice.yaml").write_bytes(kept)
    shutil.rmtree(demo / "choices")
    command = shlex.split(page.inner_text("#wb-chosen").partition("The same: ")[2])[1:]
    words = [word.replace("=choice", f"={tmp_path}/choice") for word in command]
    done = subprocess.run([sys.executable, "-m", "toolpoint", *words], cwd=demo, capture_output=True, text=True)
    assert done.returncode == 0 and (demo / "choices/structure.yaml").read_bytes() == kept, done.stderr
    assert page.errors == []


def test_two_hundred_files_are_handed_over_at_once(tmp_path, serve, tab):
    sources = tmp_path / "sources"
    sources.mkdir()
    for number in range(200):
        (sources / f"P{number}.csv").write_text(f"time [s],ch1 [V]\n0,{number}\n")
    folder = tmp_path / "project"
    folder.mkdir()
    page = tab(serve(folder).address)
    ready(page, "project")
    page.click("#wb-begin")
    wait(page, "document.getElementById('wb-files')")
    page.set_input_files("#wb-files", [str(path) for path in sorted(sources.iterdir())])
    wait(page, "document.getElementById('wb-confirm')")  # once all of them are there
    assert len(list((folder / "incoming").iterdir())) == 200
    page.click("#wb-confirm")
    wait(page, "document.querySelector('.wb-entered').innerText.includes('200')")
    assert {path.name: path.read_bytes() for path in (folder / "records").iterdir()} == {
        path.name: path.read_bytes() for path in sources.iterdir()}


def test_no_view_asks_another_host_overflows_a_phone_is_faint_or_fails(demo, serve, tab):
    server = serve(demo)
    for width in (1400, 390):
        page = tab(server.address)
        page.set_viewport_size({"width": width, "height": 844})
        ready(page, "project")
        for view in page.evaluate("window.Workbench.known"):
            page.evaluate(f"window.Workbench.moves = 0; location.hash = '#/{view}'")
            ready(page, view)
            if view in ("machine", "lobes"):
                wait(page, "window.Workbench.moves > 0")  # their first numbers come after the view
            assert page.evaluate("document.documentElement.scrollWidth") <= width, view
            assert page.evaluate("document.querySelector('.answer').innerText.length") > 20, view
            left, right = page.evaluate("(({left, right}) => [left, right])(document.querySelector('#wb-nav [aria-current]')"
                                        ".getBoundingClientRect())")
            assert left >= 0 and right <= width, f"the name of {view} lies beyond the edge"
            assert faint_texts(page) == [], view
        own = (server.address.split("#")[0], "data:", "blob:")
        assert page.errors == [] and all(url.startswith(own) for url in page.requests)


def reading_faults(page: Any) -> list[str]:
    """Return what a screen reader would hear wrongly, by the browser's own tree, in the order of reading."""
    nodes = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    faults, level = [], 0
    for node in (node for node in nodes if not node["ignored"]):
        role, name = node["role"]["value"], node.get("name", {}).get("value", "")
        if role in ("button", "link", "slider", "textbox", "combobox", "checkbox", "image", "table", "region", "navigation",
                    "application") and not name.strip():
            faults.append(f"{role} without a name")
    for heading in page.evaluate("""() => [...document.querySelectorAll('h1, h2, h3, h4')]
          .filter((node) => node.checkVisibility())
          .map((node) => [Number(node.getAttribute('aria-level') || node.tagName[1]), node.textContent])"""):
        faults += [f"heading {heading} leaves a level out"] if heading[0] > level + 1 else []
        level = heading[0]
    # A slider's own number is a logarithm or SI: it speaks the words of its field.
    faults += page.evaluate("""() => [...document.querySelectorAll('.wb-slider')].filter((row) =>
          row.querySelector('input[type=range]').getAttribute('aria-valuetext') !== row.querySelector('.wb-value').value)
          .map((row) => `slider ${row.textContent} says another value than its field`)""")
    return faults if page.evaluate("document.querySelector('.answer').ariaLive") == "polite" else [*faults, "a silent answer"]


def test_every_control_has_a_name_and_the_keyboard_reaches_it(demo, serve, tab):
    page = tab(serve(demo).address)
    ready(page, "project")
    for view in page.evaluate("window.Workbench.known"):
        page.evaluate(f"location.hash = '#/{view}'")
        ready(page, view)
        nameless = page.evaluate("""() => [...document.querySelectorAll('button, input, select, a[href], svg[role=img]')]
          .filter((node) => !(node.textContent || node.ariaLabel || node.getAttribute('aria-label')
            || node.labels?.[0]?.textContent)).map((node) => node.outerHTML.slice(0, 120))""")
        assert nameless == [], view
        assert page.evaluate("document.querySelectorAll('h1').length") == 1
        assert reading_faults(page) == [], view
        # Every control that can be pressed is on the way of the tabulator, and none holds it.
        asked = page.evaluate("""() => [...document.querySelectorAll('#view button, #view input, #view select, #view summary')]
          .filter((node) => !node.disabled && node.checkVisibility({ visibilityProperty: true })
            && !node.closest('details:not([open]) > :not(summary)')).map((node, i) => { node.dataset.asked = i; return i; })""")
        page.evaluate("""() => { window.reached = []; document.getElementById('view').focus();
          document.addEventListener('focusin', (event) => window.reached.push(event.target.dataset.asked)); }""")
        for _ in range(2 * len(asked) + 30):
            page.keyboard.press("Tab")
        assert {str(number) for number in asked} <= set(page.evaluate("window.reached")), view


# Texts that are not marked as English and have words that no German text has; commands and code are of no language.
ENGLISH_TEXTS = r"""() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
  while (walker.nextNode()) {
    const { data, parentElement: place } = walker.currentNode;
    if (!place.closest("pre, code, script, style, noscript, .wb-same, [lang=en]")
      && /\b(is|are|has|that|with|which|of|and|from|the|to)\b/.test(data)) found.push(data);
  }
  return found;
}"""
NAMES_OF_DEMO = ("Demo mill from its test", "table at the side", "wider guide of the head", "bolt the column")


def test_words_are_complete_in_english_and_german(demo, serve, tab):
    page = tab(serve(demo).address, locale="de-DE")
    ready(page, "project")
    assert page.evaluate("document.documentElement.lang") == "de" and "Projekt rechnen" in page.inner_text("main")
    # What the package says is German where the catalogue has all of it; else English, and marked so for screen readers.
    assert "englischer Sprache" in page.inner_text("#wb-foot")
    assert "95-%-Intervall" in page.inner_text(".answer") and "7.95 mm" in page.inner_text(".answer")
    for view in page.evaluate("window.Workbench.known"):
        page.evaluate(f"location.hash = '#/{view}'")
        ready(page, view)
        spoken = page.evaluate("[...document.querySelectorAll('.answer, .wb-doubts li')].map((n) => [n.lang, n.innerText])")
        assert [text for language, text in spoken if language != "de"] == [], view
        found = page.evaluate(ENGLISH_TEXTS)
        assert [text for text in found if not any(name in text for name in NAMES_OF_DEMO)] == [], view
    unknown = page.evaluate("window.Workbench.spoken('hinges: squeak at 3 Hz; oil them')")
    assert unknown == {"text": "hinges: squeak at 3 Hz; oil them", "lang": "en"}


def test_a_written_folder_opens_without_a_server(demo, tab, tmp_path):
    target = tmp_path / "shared"
    made = subprocess.run([sys.executable, "-m", "toolpoint", "serve", str(demo), "--export", str(target)], capture_output=True,
                          text=True)
    assert made.returncode == 0, made.stderr
    page = tab((target / "index.html").as_uri())
    ready(page, "project")
    assert "7.95 mm" in page.inner_text(".answer")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")
    page.evaluate("""() => { const s = document.getElementById('k-joints.column_head.stiffness.rx'); window.Workbench.moves = 0;
                     s.value = 1; s.dispatchEvent(new Event('input')); }""")
    wait(page, "window.Workbench.moves > 0")
    assert "nearest state that was computed" in page.inner_text("main")
    page.evaluate("location.hash = '#/lobes'")
    ready(page, "lobes")
    wait(page, "document.querySelector('.wb-limit').innerText.includes('7.95 mm')")
    page.evaluate("""() => { const s = document.getElementById('cut-tangential'); s.value = s.max;
                     s.dispatchEvent(new Event('input')); }""")
    wait(page, "document.querySelector('main').innerText.includes('tangential = 7600 MPa')")  # four times K_t
    assert float(page.inner_text(".wb-limit").split(": ")[1].split(" mm")[0]) < 4
    assert page.errors == [] and all(url.startswith(("file:", "data:", "blob:")) for url in page.requests)


def send_form(page: Any, name: str) -> str:
    """Send a form and return the command that it says does the same."""
    page.click(f"[aria-label='{name}'] button")
    status = page.locator(f"[aria-label='{name}'] [role=status]")
    end = time.monotonic() + PATIENCE_SECONDS
    while "toolpoint add" not in status.inner_text():
        assert time.monotonic() < end, status.inner_text()
        time.sleep(0.05)
    return status.inner_text().partition("same: ")[2]


def test_from_an_empty_folder_to_a_limit_by_clicks_alone_and_the_commands_give_the_same_bytes(run_demo, serve, tab, tmp_path):
    """Raw records, a test file, places and components are dropped in; a cut and a goal are typed; the project is run."""
    folder, shell = tmp_path / "clicked" / "mill", tmp_path / "typed" / "mill"  # a project is called as its folder
    folder.mkdir(parents=True)
    files = [*sorted((run_demo / "records").iterdir()), run_demo / "components.yaml", run_demo / "points.csv"]
    page = tab(serve(folder).address)
    ready(page, "project")
    page.click("#wb-begin")
    wait(page, "document.getElementById('wb-files')")
    page.set_input_files("#wb-files", [str(path) for path in files])
    wait(page, "document.getElementById('wb-confirm')")
    page.click("#wb-confirm")
    wait(page, "document.querySelector('.wb-entered').innerText.includes('files entered')")
    commands = ["toolpoint new project .", *page.evaluate("window.Workbench.entered.commands")]
    page.click("text=Cuts, goals, cuts that were tried")
    commands.append(send_form(page, "A cut: tool, engagement, material"))
    page.fill("#goal-depth", "7.5 mm")
    commands.append(send_form(page, "A goal: a cut at a speed and depth"))
    page.evaluate("document.activeElement.blur()")
    page.reload()
    ready(page, "project")
    page.get_by_role("button", name="Run the project").click()
    answered = "/limit there is .* 95 % interval/.test(document.querySelector('.answer')?.innerText || '')"
    wait(page, answered, 3 * PATIENCE_SECONDS)
    commands.append("toolpoint run .")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    assert "column_head" in page.inner_text(".answer")  # the soft joint
    shell.mkdir(parents=True)
    for command in commands:
        words = shlex.split(command)[1:]
        if "FROM" in command:  # the files as a person names them, who has them elsewhere
            words = ["add", ".", *map(str, files)]
        done = subprocess.run([sys.executable, "-m", "toolpoint", *words], cwd=shell, capture_output=True, text=True)
        assert done.returncode == 0, (command, done.stderr)
    for place in ("project.yaml", *(path.relative_to(folder).as_posix() for path in sorted((folder / "results").rglob("*"))
                                    if path.is_file())):
        assert (shell / place).read_bytes() == (folder / place).read_bytes(), place


def test_a_redraw_from_the_server_loses_nothing_of_what_a_person_does(folder, serve, tab):
    """A form half filled, an open block, the focus with its selection, the scroll and a pressed button outlast a redraw."""
    page = tab(serve(folder).address)
    ready(page, "project")
    page.click("text=Cuts, goals, cuts that were tried")
    page.fill("#goal-depth", "7.5 mm")
    page.fill("#cut-name", "a new cut")
    page.click("[data-step='limits/roughing']")
    page.focus("#goal-speed")
    page.evaluate("""() => { const field = document.getElementById('goal-speed'); field.setSelectionRange(1, 3);
                     field.scrollIntoView({ block: "center", behavior: "instant" });
                     window.draws = window.Workbench.draws;
                     window.before = [field, document.querySelector('.wb-main'), field.getBoundingClientRect().top]; }""")
    project = folder / "project.yaml"
    slot = "  slot: {diameter: 50 mm, teeth: 5, immersion: 1.0, tangential: 1900 MPa, normal: 700 MPa, speeds: 500 2500 rpm}\n"
    project.write_text(project.read_text().replace("goals:\n", slot + "goals:\n").replace("{speed", "{cut: face, speed"))
    wait(page, "window.Workbench.draws > window.draws")  # the view was drawn anew
    assert page.evaluate("[...document.getElementById('goal-cut').options].map((option) => option.text)") == ["face", "slot"]
    assert page.input_value("#goal-depth") == "7.5 mm" and page.input_value("#cut-name") == "a new cut"
    assert page.is_visible("#goal-depth")  # the block is still open
    assert page.evaluate("""() => { const field = document.activeElement; return [
        field === window.before[0], field.selectionStart, field.selectionEnd,
        document.querySelector('.wb-main') === window.before[1],
        Math.abs(field.getBoundingClientRect().top - window.before[2]) < 2]; }""") == [True, 1, 3, True, True]
    assert page.inner_text("#wb-step h3").startswith("limits/roughing")  # the step that was chosen
    assert page.errors == []


def test_a_redraw_waits_for_the_mouse_and_for_a_field_without_a_place_of_its_own(folder, serve, tab):
    page = tab(serve(folder).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    page.fill("#wb-save-name", "half a na")
    page.evaluate("window.draws = window.Workbench.draws")
    machine = folder / "machine.yaml"
    machine.write_text(machine.read_text() + "# a person saved it\n")
    wait(page, "!document.getElementById('wb-held').hidden")  # the page says that it is behind
    assert page.input_value("#wb-save-name") == "half a na" and page.evaluate("window.Workbench.draws === window.draws")
    page.evaluate("document.activeElement.blur()")
    wait(page, "window.Workbench.draws > window.draws && document.getElementById('wb-held').hidden")
    page.evaluate("location.hash = '#/project'")
    ready(page, "project")
    page.evaluate("window.draws = window.Workbench.draws")
    page.locator("[data-step='limits/roughing']").hover()
    page.mouse.down()
    with page.expect_response(lambda response: "view/project" in response.url, timeout=1e3 * PATIENCE_SECONDS):
        project = folder / "project.yaml"
        project.write_text(project.read_text().replace("4 mm", "5 mm"))
    wait(page, "window.Workbench.isBehind()")  # the new view has arrived, and waits
    assert page.evaluate("window.Workbench.draws === window.draws")
    page.mouse.up()  # the click reaches the button that was pressed, then the view is drawn
    wait(page, "window.Workbench.draws > window.draws")
    assert page.inner_text("#wb-step h3").startswith("limits/roughing")
    assert page.errors == []


def test_a_click_on_the_map_takes_the_pose_and_undo_takes_it_back(folder, serve, tab):
    page = tab(serve(folder).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")
    first = page.evaluate("window.Workbench.last.frequency_hz[0]")
    page.click("#wb-map")
    wait(page, "window.Workbench.mapped > 0")
    page.select_option("#wb-map-of", "frequency_hz")
    cell = page.locator(".wb-map button[data-place='6 0']")
    shown = float(cell.inner_text())
    page.evaluate("window.Workbench.moves = 0")
    cell.click()
    wait(page, "window.Workbench.moves > 0")
    moved = page.evaluate("window.Workbench.last.frequency_hz[0]")
    assert moved == pytest.approx(shown, rel=1e-3) and moved != pytest.approx(first, rel=1e-6)
    assert page.evaluate("document.getElementById('axis-X').value === document.getElementById('axis-X').max")
    page.evaluate("window.Workbench.moves = 0")
    page.get_by_role("button", name="Undo").click()
    wait(page, "window.Workbench.moves > 0")
    assert page.evaluate("window.Workbench.last.frequency_hz[0]") == pytest.approx(first, rel=1e-9)
    assert page.errors == []


def test_a_cut_is_simulated_and_heard_and_twice_the_limit_chatters(folder, serve, tab):
    page = tab(serve(folder).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/lobes'")
    ready(page, "lobes")
    wait(page, "window.Workbench.moves > 0")
    wait(page, "document.querySelector('.wb-limit').innerText.includes('mm deep')")
    limit = float(page.inner_text(".wb-limit").split(": ")[1].split(" mm")[0])
    for depth, words in ((0.6 * limit, "is stable"), (1.6 * limit, "chatters")):
        field = page.locator(".wb-slider", has=page.locator("#lobes-depth")).locator(".wb-value")
        field.fill(f"{depth:.2f} mm")
        field.press("Enter")
        page.click("#lobes-hear")
        wait(page, f"document.getElementById('wb-heard')?.innerText.includes('{words}')")
        loudest = page.evaluate("Math.max(...window.Workbench.floats(window.Workbench.heard.sound).map(Math.abs))")
        assert loudest == pytest.approx(1)
    assert page.evaluate("window.Workbench.played") == 2
    row = page.locator(".wb-slider", has=page.locator("#lobes-depth"))
    depth = page.input_value("#lobes-depth")
    for text in ("1,5 mm", "0.2 cm", "deep"):  # neither 1 mm nor 0.2 mm
        row.locator(".wb-value").fill(text)
        row.locator(".wb-value").press("Enter")
        assert text in row.locator("[role=alert]").inner_text() and page.input_value("#lobes-depth") == depth
    row.locator(".wb-value").fill("1.5")
    row.locator(".wb-value").press("Enter")
    assert row.locator("[role=alert]").is_hidden()
    assert float(page.input_value("#lobes-depth")) == pytest.approx(1.5e-3, abs=1e-4)
    teeth = page.locator(".wb-slider", has=page.locator("#cut-teeth")).locator(".wb-value")
    teeth.fill("3.2")
    teeth.press("Enter")
    wait(page, "document.querySelector('.wb-same').textContent.includes('--teeth 3')")  # whole numbers alone
    page.evaluate("document.activeElement.blur(); window.draws = window.Workbench.draws")
    project = folder / "project.yaml"
    project.write_text(project.read_text().replace("draws: 20", "draws: 21"))
    wait(page, "window.Workbench.draws > window.draws")  # drawn anew, the cut stands as the sliders say
    assert page.input_value("#cut-teeth") == "3"
    wait(page, "document.querySelector('.wb-same').textContent.includes('--teeth 3')")
    assert page.errors == []


def test_while_a_slider_moves_the_limit_is_called_rough_and_the_exact_one_follows(folder, serve, tab):
    page = tab(serve(folder).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")
    # The clock of the page stands meanwhile: on a slow machine two moves would be too far apart to be those of one hand.
    page.evaluate("""async () => { window.words = []; performance.now = () => 0;
        new MutationObserver(() => window.words.push(document.querySelector('.wb-limit').textContent))
          .observe(document.querySelector('.wb-limit'), { childList: true, characterData: true, subtree: true });
        const slider = document.getElementById('k-joints.column_head.stiffness.rx');
        for (let i = 1; i <= 12; i++) { slider.value = i / 12; slider.dispatchEvent(new Event('input'));
          await new Promise((go) => setTimeout(go, 60)); } }""")
    wait(page, "window.Workbench.last.limit.is_exact && /would be/.test(document.querySelector('.wb-limit').textContent)")
    words = page.evaluate("window.words")
    assert any("about" in text and "single-frequency" in text for text in words) and "would be" in words[-1]
    assert page.errors == []


def test_on_paper_no_doubt_is_folded_away(demo, serve, tab):
    page = tab(serve(demo).address)
    ready(page, "project")
    page.evaluate("location.hash = '#/machine'")
    ready(page, "machine")
    wait(page, "window.Workbench.moves > 0")  # the last doubts come with the first answer about the machine
    folded = "document.querySelectorAll('.wb-doubts details:not([open])').length"
    assert page.evaluate(folded) > 0
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(folded) == 0
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(folded) > 0


def test_blows_are_recorded_from_a_watched_folder_judged_heard_and_entered(folder, serve, tab):
    """Waits are for states that stay: it waits for its records, and ends after the good blows that were asked for."""
    page = tab(serve(folder).address)
    ready(page, "project")
    (folder / "incoming_records").mkdir()
    held: list[Any] = []
    page.route("**/api/recording", lambda route: held.append(route))
    page.evaluate("location.hash = '#/record'")
    ready(page, "record")
    assert page.is_disabled("#rec-stop")  # whether anything runs is not known yet
    for route in held:
        route.continue_()
    page.unroute("**/api/recording")
    page.fill("#rec-channels", "\n".join(tapping.DESCRIBED))
    page.fill("#rec-blows", "3")
    page.click("#rec-start")
    wait(page, "document.body.dataset.recording === 'waiting 0'")
    tapping.write_records(folder / "incoming_records", (200.0, 180.0, 190.0))
    wait(page, "document.body.dataset.recording === 'ended 3'")
    assert page.locator("#rec-rows tbody tr").count() == 3 and "enough at tip:+x" in page.inner_text("#rec-last")
    assert "from 3 of 3 hits" in page.inner_text("#rec-study")
    page.click("[id='rec-decide-blow_0002.npz']")
    wait(page, "document.getElementById('rec-study').textContent.includes('from 2 of 3 hits')")
    wait(page, "document.getElementById('rec-decided').textContent.includes('--refuse')")
    command = page.inner_text("#rec-decided").partition("The same: ")[2]
    assert command.startswith("toolpoint frf records/tip_x/test.yaml --refuse blow_0002.npz")
    page.click("[id='rec-hear-blow_0001.npz']")
    wait(page, "window.Workbench.pulse && window.Workbench.played === 1")
    loudest = page.evaluate("Math.max(...window.Workbench.floats(window.Workbench.pulse.sound).map(Math.abs))")
    assert loudest == pytest.approx(1.0, abs=0.01)  # resampled
    page.reload()  # the state lies in the server and in the files
    ready(page, "record")
    wait(page, "document.body.dataset.recording === 'ended 3'")
    assert "from 2 of 3 hits" in page.inner_text("#rec-study")
    page.click("#rec-enter")
    wait(page, "document.getElementById('rec-decided').textContent.includes('toolpoint add')")
    assert "tip_x" in Project.open(folder).description.tests and page.errors == []
