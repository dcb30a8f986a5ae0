"""Examples in docstrings run, and show every name that their room exports."""

import doctest
import importlib
import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2] / "src" / "toolpoint"
# Rooms whose examples are run. A room is added when its exported names have theirs.
ROOMS_WITH_EXAMPLES = ("kinematics", "substructuring")
MODULES = [f"toolpoint.{path.relative_to(SOURCE).with_suffix('').as_posix().replace('/', '.')}"
           for room in ROOMS_WITH_EXAMPLES for path in sorted((SOURCE / room).rglob("*.py"))
           if ">>> " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_run(name):
    module = importlib.import_module(name)
    result = doctest.testmod(module, verbose=False)
    assert result.attempted and not result.failed


@pytest.mark.parametrize("room", ROOMS_WITH_EXAMPLES)
def test_every_exported_name_stands_in_an_example(room):
    text = "\n".join(path.read_text(encoding="utf-8") for path in (SOURCE / room).rglob("*.py"))
    examples = "\n".join(re.findall(r"^ +(?:>>>|\.\.\.) .*$", text, re.MULTILINE))
    names = importlib.import_module(f"toolpoint.{room}").__all__
    assert not [name for name in names if not re.search(rf"\b{name}\b", examples)]
