"""What is published beside the package says what the package says: versions, dependencies, licence, supported Pythons."""

import importlib.util
import json
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import toolpoint
from toolpoint import substructuring
from toolpoint._deprecation import ToolpointDeprecationWarning
from toolpoint.io import write_template
from toolpoint.io.yaml.document import parse
from toolpoint.vibration import Modes, frequency_response

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from generate import public_names  # noqa: E402

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def _recipe() -> dict:
    return parse(ROOT / "packaging/conda/recipe.yaml").data


def test_citation_and_recipe_have_the_package_s_version():
    citation = parse(ROOT / "CITATION.cff").data
    assert str(citation["version"]) == toolpoint.__version__ == str(_recipe()["package"]["version"])
    assert citation["license"] == _recipe()["about"]["license"] == "BSD-3-Clause"


def test_recipe_asks_for_the_dependencies_of_the_package():
    asked = {re.sub(r"\s", "", line) for line in _recipe()["requirements"]["run"]} - {"python>=3.11"}
    assert asked == {line.replace(" ", "") for line in PROJECT["dependencies"]}


def test_recipe_starts_the_same_command():
    assert f"toolpoint = {PROJECT['scripts']['toolpoint']}" in _recipe()["build"]["python"]["entry_points"]


def test_the_recipe_is_read_by_the_program_that_builds_it():
    """Where that is installed (py-rattler-build): the package does not need it."""
    builder = pytest.importorskip("rattler_build")
    recipe = builder.Stage0Recipe.from_yaml((ROOT / "packaging/conda/recipe.yaml").read_text(encoding="utf-8"))
    assert type(recipe).__name__ == "SingleOutputRecipe"


def test_the_container_asks_for_extras_that_there_are_and_known_instructions_alone():
    lines = [line for line in (ROOT / "packaging/Containerfile").read_text(encoding="utf-8").splitlines()
             if line and not line.startswith("#")]
    assert [line.split()[0] for line in lines] == ["FROM", "COPY", "RUN", "WORKDIR", "ENTRYPOINT"]
    assert "app" in (extras := re.search(r"/source\[([\w,]+)\]", lines[2])[1].split(","))
    assert set(extras) <= PROJECT["optional-dependencies"].keys() and json.loads(lines[4].split(" ", 1)[1]) == ["toolpoint"]


@pytest.mark.parametrize("name", ["packaging/Containerfile", ".github/workflows/tests.yml", "SECURITY.md"])
def test_files_of_publication_are_plain_text_and_name_no_machine(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert text.isascii() and "/home/" not in text and "\r" not in text


def test_the_workflow_runs_every_python_that_the_package_names():
    text = (ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8")
    listed = re.findall(r'"(3\.\d+)"', text.split("matrix:")[1].split("runs-on")[0])
    named = [line.rsplit(" ", 1)[1] for line in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", line)]
    assert set(named) <= set(listed)


def test_python_of_the_readme_runs_as_it_stands(monkeypatch, capsys, tmp_path):
    """The blocks are one program, run in a folder that has the machine file of the block of the drawing alone."""
    monkeypatch.chdir(tmp_path)
    write_template("my.yaml", "machine", "three-axis-vertical")
    blocks = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    exec(compile("\n".join(blocks), "README.md", "exec"), {})
    assert len(blocks) == 2 and " 137.15" in capsys.readouterr().out  # root of det(K - w^2 M): 137.157 Hz


def test_every_line_of_the_readme_is_run_by_the_ci():
    """Lines that `.ci/readme_lines.py` leaves out are run by `.ci/run` itself, or by tests of the workbench."""
    spec = importlib.util.spec_from_file_location("readme_lines", ROOT / ".ci/readme_lines.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = [line.strip() for block in re.findall(r"^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
             for line in block.splitlines() if line.strip() and not line.startswith("#")]
    run = "\n".join(module.blocks())
    ci = (ROOT / ".ci/run").read_text(encoding="utf-8")
    names = re.search(r"for name in ([\w -]+);", ci)
    assert "readme_lines.py" in ci and names is not None
    for line in lines:
        demo = re.match(r"toolpoint demo ([\w-]+)", line)
        assert line in run or "venv" in line or "sphinx-build" in line or line.startswith("toolpoint serve") or (
            demo is not None and demo[1] in names[1].split()), line
    assert len(module.blocks()) >= 5


def test_no_public_name_vanishes():
    """New names are entered by `python docs/generate/public_names.py --write`; one that goes is told in the migration notes."""
    gone = {*public_names.listed_names()} - {*public_names.public_names()}
    assert gone == set(), "deprecate it (toolpoint._deprecation), and tell it in docs/how_to/from_0_1_to_0_2.md"


def test_old_arguments_and_names_go_on_with_a_warning_that_says_the_new_ones():
    modes = Modes([20.0], [0.02], np.ones((2, 1)), ("1:+x", "2:+x"))
    frf = frequency_response.modal(modes, np.linspace(5, 80, 5), inputs=["1:+x"])
    part = replace(frf, values=3 * frf.values)
    with pytest.warns(ToolpointDeprecationWarning, match="'whole' is called 'assembly' since 0.2"):
        old = substructuring.decouple_responses(whole=frf, part=part, shared=["1:+x"], internal_outputs=["2:+x"])
    new = substructuring.decouple_responses(frf, part, ["1:+x"], internal_outputs=["2:+x"])
    assert np.array_equal(old.values, new.values, equal_nan=True)
    with pytest.raises(TypeError, match="give one of them"):
        substructuring.decouple_responses(frf, part, ["1:+x"], beside=(), internal_outputs=())
