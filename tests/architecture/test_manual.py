"""The manual cannot fall behind: every error has its page, every key and command its row, every tutorial runs."""

import importlib
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from generate import against, commands, errors, keys  # noqa: E402
from generate.sites import sites  # noqa: E402
from generate.tutorials import blocks_of, run_tutorial  # noqa: E402

from toolpoint.io.quantities import units  # noqa: E402

TUTORIALS = sorted(page for page in (ROOT / "docs" / "tutorials").glob("*.md") if page.stem != "index")
THEORY = sorted(page for page in (ROOT / "docs" / "theory").glob("*.md") if page.stem != "index")
WRITTEN_PAGES = [*TUTORIALS, *THEORY, *(ROOT / "docs" / "how_to").glob("*.md"), ROOT / "docs" / "start.md"]
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)\s]*)?\)")
MIN_PAGE_WORDS = 300  # of a page that is no reference: a shorter one belongs to another


@pytest.mark.slow
def test_every_error_of_the_package_has_its_page(tmp_path):
    places = list(sites())
    rooms = {site.room for site in places}
    assert len(places) > 1000 and rooms <= set(errors.causes())
    for entry in errors.causes().values():
        assert {"title", "cause", "cure"} == set(entry) and all(len(text) > 4 for text in entry.values())
    errors.write_errors(tmp_path)
    pages = {room: (tmp_path / f"errors_{room.strip('_')}.md").read_text() for room in rooms}
    missing = [site for site in places if errors._code(site.seen) not in pages[site.room]]
    assert missing == []
    # Nine in ten messages say themselves what must be or is to be done; a doubt always does.
    assert sum(bool(site.cure) for site in places) > 0.85 * len(places)
    assert "average more hits or choose a reference that moves more" in pages["modal_identification"]


@pytest.mark.slow
def test_every_kind_of_file_has_its_page_with_examples(tmp_path):
    keys.write_keys(tmp_path)
    machine = (tmp_path / "keys_machine.md").read_text()
    assert "| `mass` | mass of the body; mass; a bare number is in kg; above 0 | none | `" in machine
    for name in keys.FILES:
        rows = [line for line in (tmp_path / f"keys_{name}.md").read_text().splitlines() if line.startswith("| `")]
        cells = [[cell.strip() for cell in row.replace("\\|", "").strip("|").split("|")] for row in rows]
        assert rows and [row for row in cells if len(row) != 4 or not all(row)] == []


@pytest.mark.parametrize("name", list(keys.FILES))
def test_written_examples_of_keys_are_of_their_kind(name):
    """No key without an example; quantities have the dimension of their key, choices are among those that are allowed."""
    kinds = {kind.unit: kind for kind in vars(units).values() if isinstance(kind, units.Kind)}
    schema = importlib.import_module(f"toolpoint.io.yaml.{keys.FILES[name][0]}").json_schema()
    for part, entry in [(name, schema), *schema.get("$defs", {}).items()]:
        for key, node in entry.get("properties", {}).items():
            text = keys.example_of(part.removesuffix("Model"), key, node)
            words = node.get("description", "").partition("a bare number is in ")[2].partition(";")[0]
            choices = [word for choice in [node, *node.get("anyOf", ())] for word in choice.get("enum", ())]
            if text and words in kinds:
                units.quantity(float(text) if re.fullmatch(r"[\d.e+-]+", text) else text, kinds[words])
            assert not (text and choices) or text in map(str, choices), (part, key, text)


def test_every_command_has_its_help(tmp_path):
    from toolpoint.app.main import MODULE_OF_COMMAND

    commands.write_commands(tmp_path)
    text = (tmp_path / "commands.md").read_text()
    assert all(f"\n## {name}\n" in text for name in MODULE_OF_COMMAND)


def test_the_page_of_peers_repeats_the_bars(tmp_path):
    against.write_against(tmp_path)
    rows = [line for line in (tmp_path / "against.md").read_text().splitlines() if line.startswith("| ")]
    assert len(rows) > 15 and all(row.count("|") >= 7 for row in rows)


def test_every_tutorial_is_listed_and_runs_commands():
    index = (ROOT / "docs" / "tutorials" / "index.md").read_text(encoding="utf-8")
    listed = set(re.search(r"```{toctree}.*?\n\n(.*?)```", index, re.DOTALL)[1].split())
    assert listed == {page.stem for page in TUTORIALS} and len(listed) >= 18
    assert all(len(blocks_of(page)) >= 1 for page in TUTORIALS)


def test_pages_of_theory_state_assumptions_and_check_themselves():
    index = (ROOT / "docs" / "theory" / "index.md").read_text(encoding="utf-8")
    assert len(THEORY) >= 17
    for page in THEORY:
        text = page.read_text(encoding="utf-8")
        assert f"\n{page.stem}\n" in index, page.stem
        assert "## Assumptions, and when they fail" in text or page.stem == "video", page.stem
        assert "## Check it" in text and "\nSources: " in text and len(blocks_of(page)) >= 1, page.stem


def test_no_written_page_is_a_stub():
    assert {page.stem: len(page.read_text(encoding="utf-8").split()) for page in WRITTEN_PAGES
            if len(page.read_text(encoding="utf-8").split()) < MIN_PAGE_WORDS} == {}


def test_links_within_the_repository_lead_somewhere():
    pages = [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
    broken = [(page.name, link) for page in pages if "generated" not in page.parts
              for link in LINK.findall(page.read_text(encoding="utf-8"))
              if not link.startswith(("http", "mailto")) and "generated/" not in link and not (page.parent / link).exists()]
    assert broken == []


@pytest.mark.slow
@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_a_page_of_theory_checks_itself(page):
    assert run_tutorial(page) >= 1


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_a_tutorial_runs(page):
    assert run_tutorial(page) >= 1


def test_every_view_of_the_workbench_has_its_pictures_in_the_manual():
    """At two widths, light and dark; together they are small."""
    from toolpoint.workbench.views.catalogue import VIEWS

    folder, text = ROOT / "docs/workbench", (ROOT / "docs/how_to/workbench.md").read_text(encoding="utf-8")
    names = {f"{view}_{width}_{theme}.webp" for view in VIEWS for width in (1400, 390) for theme in ("light", "dark")}
    assert names == {path.name for path in folder.iterdir()}
    assert all(f"../workbench/{name}" in text for name in names)
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1.6e6
