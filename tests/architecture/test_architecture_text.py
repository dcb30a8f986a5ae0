"""Text of the rooms that have been reread: names and first lines as docs/vocabulary.md asks."""

import re
from pathlib import Path

import pytest

from benchmarks.house import text_rules

ROOT = Path(__file__).resolve().parents[2]
# Folders of src/toolpoint that were reread whole. A folder is added when it is; none is taken out.
ROOMS_REREAD = (
    "acquisition", "app", "bodies", "cutting", "drives", "io/binary", "io/fmu", "io/matrices", "io/measured", "io/meshes",
    "io/multibody", "io/program", "io/quantities", "io/servo_data", "io/text", "io/uff", "io/urdf", "io/yaml",
    "joint_identification", "joints", "kinematics", "machine", "material_removal", "modal_identification",
    "pages", "plot", "project",
    "samples", "signals", "spatial", "studies", "substructuring", "updating", "vibration", "vision",
    "workbench",
)


@pytest.fixture(autouse=True, scope="module")
def _trees():
    """Syntax trees are let go of when these rules, and those of the module before, are through."""
    yield
    for kept in (text_rules.trees, text_rules.nodes):
        kept.cache_clear()


def test_rooms_that_were_reread_keep_the_rules_of_names_and_first_lines():
    """One test for all rooms: each worker that had one of them would parse the whole package."""
    faults = [f"{place.path.relative_to(ROOT)}:{place.line}: {place.rule}: {place.words}"
              for room in ROOMS_REREAD for place in text_rules.places(ROOT, f"src/toolpoint/{room}")]
    assert not faults, "\n".join(faults)


def test_tables_are_titled_in_words():
    """A reader of a terminal is shown no call of a class, as `repr` writes it."""
    title = re.compile(r"text_table\(\s*(repr\(|f\"[^\"]*![r]\})")
    faults = [str(path.relative_to(ROOT)) for path in sorted((ROOT / "src/toolpoint").rglob("*.py"))
              if title.search(path.read_text(encoding="utf-8"))]
    assert not faults, faults


@pytest.mark.parametrize(("line", "rule"), [
    ("MOST = 160", "unclear constant"),
    ("_BOUND = 2e-3", "unclear constant"),
    ("ALIKE = 'what is alike'", "unclear constant"),
    ("def scale(low):\n    return low", "place in a sentence"),
    ("rest = [1]", "place in a sentence"),
    ('"""What moves."""', "first line"),
    ('"""Of a misfit so large by noise alone."""', "first line"),
])
def test_each_rule_of_text_refuses_what_it_names(tmp_path, line, rule):
    folder = tmp_path / "src/toolpoint"
    folder.mkdir(parents=True)
    (folder / "module.py").write_text(line + "\n", encoding="utf-8")
    assert [place.rule for place in text_rules.places(tmp_path)] == [rule]


def test_a_number_of_two_modules_is_refused_in_both(tmp_path):
    folder = tmp_path / "src/toolpoint"
    folder.mkdir(parents=True)
    for name in ("first", "second"):
        (folder / f"{name}.py").write_text("MAX_BASIS_SIZE = 160  # vectors\n", encoding="utf-8")
    assert [place.rule for place in text_rules.places(tmp_path)] == ["constant of several modules"] * 2
