"""The house rules that a program can hold: floors, forbidden libraries, light import, size of modules, no drawers."""

import ast
import json
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from benchmarks import bars
from benchmarks.house import counts, text_rules

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "toolpoint"
MODULES = sorted(SOURCE.rglob("*.py"))
HOME = {"plotly": "plot", "h5py": "io", "netgen": "io", "ruamel": "io", "distributed": "studies/execute.py",
        "dask": "studies/execute.py", "pydantic": "io", "click": "app", "rich": "app", "av": "vision/", "PIL": "vision/",
        "sounddevice": "acquisition/", "nidaqmx": "acquisition/",
        "starlette": "workbench/serving", "uvicorn": "workbench/serving"}


def tree_of(path):
    """A module's syntax tree; each is asked by many tests, and by those of the text beside this module."""
    return text_rules.trees(ROOT)[path]


def nodes_of(path):
    """All nodes of a module's syntax tree."""
    return text_rules.nodes(ROOT)[path]


def in_modules(faults_of, paths=MODULES):
    """Return what a rule finds in every module, with its name: one test a rule, thousands cost half a minute."""
    return [f"{path.relative_to(SOURCE).as_posix()}: {fault}" for path in paths for fault in faults_of(path)]


@cache
def text_of(path):
    """A module's text: what a rule looks for must stand there, most modules need no tree."""
    return path.read_text(encoding="utf-8")


@cache
def code_of(path):
    """A module's text without its docstrings and comments."""
    return re.sub(r'"""[\s\S]*?"""|#.*', "", text_of(path))


@cache
def imports(path):
    """Every word of the lines that import, also inside functions."""
    return {word for line in re.findall(r"^\s*(?:import|from) +(.*)", code_of(path), re.MULTILINE)
            for word in re.findall(r"(?<![.\w])\w+", line.split(" import ")[0])}


def test_floors_are_kept():
    done = subprocess.run([sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()", "--no-cache"],
                          cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(("library", "home"), HOME.items())
def test_libraries_stay_in_their_rooms(library, home):
    strangers = [path.relative_to(SOURCE).as_posix() for path in MODULES
                 if library in imports(path)
                 and not path.relative_to(SOURCE).as_posix().startswith(home)]
    assert strangers == []


def test_no_plotly_or_other_heavy_library_on_import():
    heavy = ["plotly", "h5py", "ruamel", "pydantic", "numba", "distributed", "dask", "rich", "click", "scipy", "PIL", "av"]
    code = f"import toolpoint, sys, json; print(json.dumps([m for m in {heavy} if m in sys.modules]))"
    assert json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) == []


def test_help_of_the_commands_loads_no_science():
    heavy = ["scipy", "plotly", "h5py", "ruamel", "pydantic", "numba"]
    code = f"import toolpoint.app.main, sys, json; print(json.dumps([m for m in {heavy} if m in sys.modules]))"
    assert json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) == []


@pytest.mark.parametrize(("arguments", "heavy"), [
    (["lobes", "--frf", "none.txt"], ["scipy.linalg", "plotly", "h5py", "ruamel", "pydantic", "numba", "rich"]),
    (["lobes", "--frf", "wrong.txt"], ["scipy.linalg", "plotly", "h5py", "ruamel", "pydantic", "numba"]),
    (["report", "wrong.yaml"], ["scipy.linalg", "plotly", "h5py", "numba", "toolpoint.studies.machines.machine_report"]),
    (["drive", "wrong.yaml", "--circle", "50,4000"], ["scipy.linalg", "plotly", "h5py", "numba"])])
def test_errors_load_no_more_than_finds_them(tmp_path, arguments, heavy):
    (tmp_path / "wrong.yaml").write_text("toolpoint: 1\nbodies: {column: {mas: 100 kg}}\n")
    (tmp_path / "wrong.txt").write_text("no response\n")
    done = subprocess.run([sys.executable, "-X", "importtime", "-m", "toolpoint", *arguments], cwd=tmp_path,
                          capture_output=True, text=True)
    assert done.returncode == 2 and "error: " in done.stderr
    loaded = {line.rsplit("|", 1)[-1].strip() for line in done.stderr.splitlines() if line.startswith("import time")}
    assert loaded.isdisjoint(heavy)


@pytest.mark.parametrize("path", sorted((SOURCE / "app" / "commands").glob("[!d_]*.py")), ids=lambda p: p.stem)
def test_commands_read_their_files_before_they_name_what_computes(path):
    """Python looks a function up before its arguments: `studies.f(io.read(...))` loads the study of a file that is wrong."""
    late = []
    for call in nodes_of(path):
        if isinstance(call, ast.Call) and ast.unparse(call.func).startswith(("studies.", "pages.")):
            inner = [ast.unparse(node.func) for part in (*call.args, *(word.value for word in call.keywords))
                     for node in ast.walk(part) if isinstance(node, ast.Call)]
            late += [f"{call.lineno}: {name}" for name in inner if name.startswith("io.read") or name.endswith(".read")]
    assert late == []


def test_numba_is_loaded_only_when_asked_for():
    code = "import toolpoint.machine, toolpoint.vibration, sys; print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "False"


def test_modules_are_small_and_say_what_they_own():
    def faults_of(path):
        if (length := len(text_of(path).splitlines())) > 400:
            yield f"{length} lines"
        if not re.match(r'r?"""\s*[^\s"]', text_of(path)):
            yield "no first docstring line"
        if {"utils", "tools", "helpers", "common", "misc"} & {*path.parts, path.stem}:
            yield "a drawer"
    assert in_modules(faults_of) == []


def test_class_names_stand_for_one_thing():
    names = [name for path in MODULES for name in re.findall(r"^\s*class (\w+)", code_of(path), re.MULTILINE)]
    assert len(names) > 300
    assert sorted({name for name in names if names.count(name) > 1}) == []


VAGUE = {"found", "made", "told", "wanted", "one", "own"}
# Words that end like a participle and are none; `simulated` and the like would be caught.
NO_PARTICIPLE = {"speed", "feed", "need", "seed", "embed", "bed", "red", "speeds"}


def public_functions(tree):
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield node
        if isinstance(node, ast.ClassDef):
            yield from (item for item in node.body if isinstance(item, ast.FunctionDef) and not item.name.startswith("_"))


def unclear_names(path):
    tree = tree_of(path)
    faults = []
    for node in public_functions(tree):
        arguments = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
        # "one" and "own" are plain English inside a longer name (`one_of`), and say nothing alone.
        faults += [f"{node.name}: {word}" for word in (node.name, *arguments)
                   if word in VAGUE or (VAGUE - {"one", "own"}) & set(word.split("_"))]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            first = node.name.split("_")[0]
            if first.endswith("ed") and first not in NO_PARTICIPLE:
                faults.append(f"{node.name} is named by a participle")
    return faults


def test_names_are_plain():
    """No vague word in a public name or an argument; functions of a module are verbs, never participles."""
    assert in_modules(unclear_names) == []


def crowded_signatures(path):
    if "app/" in path.relative_to(SOURCE).as_posix():  # commands are called by click, by name
        return []
    return [f"{node.name}: {counts.positional_arguments(node)} positional arguments" for node in nodes_of(path)
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and counts.is_crowded(node)]


def test_public_functions_take_at_most_three_positional_arguments():
    """Of a fourth a reader of the call no longer knows what it is: it has its name there. Compiled kernels know no names."""
    assert in_modules(crowded_signatures) == []


def test_every_module_is_read_by_the_type_checker():
    assert [path for path in MODULES if "mypy: ignore-errors" in text_of(path)] == []
    assert "ignore_errors" not in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def vague_locals(path):
    faults = []
    for node in nodes_of(path) if re.search(rf"\b(?:{'|'.join(VAGUE)})\b", code_of(path)) else ():
        if isinstance(node, ast.FunctionDef) and (node.end_lineno or 0) - node.lineno > 15:
            faults += [f"{node.name}: {name.id}" for name in ast.walk(node) if isinstance(name, ast.Name) and name.id in VAGUE]
    return sorted(set(faults))


def test_long_functions_name_their_variables():
    """In functions of more than 15 lines a vague local name costs a reader the way back to its assignment."""
    assert in_modules(vague_locals) == []


def bare_doubts(path):
    bare = []
    for node in nodes_of(path) if re.search("doubt|warnings", code_of(path)) else ():
        named = []
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            named = [(node.target.id, node.annotation)]
        elif isinstance(node, ast.FunctionDef):
            named = [(node.name, node.returns), *((a.arg, a.annotation) for a in (*node.args.args, *node.args.kwonlyargs))]
            named += [(node.args.vararg.arg, node.args.vararg.annotation)] if node.args.vararg else []
        bare += [f"{node.lineno}: {name}: {ast.unparse(kind)}" for name, kind in named
                 if kind and (name == "doubt" or name.endswith("doubts")) and "str" in ast.unparse(kind)
                 and "Doubt" not in ast.unparse(kind)]
        bare += [f"{node.lineno}: {name}" for name, _ in named if name == "warnings" and isinstance(node, ast.AnnAssign)
                 and path.parts[-2] != "app"]
    return bare


def test_doubts_are_no_bare_strings():
    """What is called a doubt is a `Doubt` (or a factor that is not known), in fields, arguments, results: it has parts."""
    assert in_modules(bare_doubts, [path for path in MODULES if not path.is_relative_to(SOURCE / "plot")]) == []


SPEAKS = SOURCE / "_doubt.py"  # the only place that spells how a doubt begins


def test_no_sentence_is_made_a_doubt_by_its_first_word():
    """What begins with ``doubt:`` was marked by `mark_notes`; a sentence written so would be text, without parts."""
    def spelled(path):
        return [f"{node.lineno}: {node.value[:40]!r}" for node in (nodes_of(path) if "doubt:" in text_of(path) else ())
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and re.match(r"\s*doubt:", node.value)]
    assert in_modules(spelled, [path for path in MODULES if path != SPEAKS]) == []


def test_wheel_carries_scripts_styles_and_machines():
    names = {path.suffix for path in SOURCE.rglob("*") if path.is_file()}
    assert {".js", ".css", ".yaml"} <= names


def test_bars_name_commands_that_exist_and_their_page_is_written_from_them():
    data = bars.read_areas()
    for row in bars.rows(data):
        for word in row.command.split():
            if word.startswith(("benchmarks/", "tests/")):
                assert (ROOT / word.split("::")[0]).exists(), f"{row.figure}: {word}"
    assert bars.PAGE.read_text(encoding="utf-8") == bars.page(data), "run python benchmarks/bars.py --write"


def test_options_of_the_bars_commands_are_those_of_their_scripts():
    """Three rows named options of another script: who runs a row learns first that it cannot be run."""
    frame = text_of(ROOT / "benchmarks" / "frame.py")
    for row in bars.rows(bars.read_areas()):
        script, *options = re.findall(r"(?<!\S)(?:benchmarks/\S+\.py|--[a-z-]+)", row.command) or [""]
        if not script.startswith("benchmarks/"):
            continue
        text = text_of(ROOT / script)
        unknown = [option for option in options if not re.search(rf"\"(?:--)?{option[2:]}\"", text)
                   and (f'"{option}"' not in frame and f'"{option[2:]}"' not in frame)]
        assert not unknown, f"{row.figure}: {script} has no {', '.join(unknown)}"


def exports_of(path):
    """Triples (module, name there, name here) that a room's `__init__` shows to the type checker, and those it loads."""
    tree, room = tree_of(path), ".".join(path.parent.relative_to(SOURCE.parent).parts)
    shown = {(node.module, alias.name, alias.asname or alias.name) for part in tree.body if isinstance(part, ast.If)
             for node in ast.walk(part) if isinstance(node, ast.ImportFrom) for alias in node.names}
    call = next(node for node in ast.walk(tree) if isinstance(node, ast.Call))
    loaded = set()
    for module, names in ast.literal_eval(call.args[1]).items():
        home = module if module.startswith("toolpoint.") else f"{room}.{module}"
        pairs = [name.split(" as ") if " as " in name else (name, name) for name in names]
        loaded |= {(home, *pair) for pair in pairs} or {(room, module, module)}
    return shown, loaded


@pytest.mark.parametrize("path", [path for path in MODULES if "= export_lazily(" in path.read_text(encoding="utf-8")],
                         ids=lambda p: p.parent.name)
def test_what_a_room_exports_is_what_it_loads_on_first_use(path):
    """What the type checker is shown (and has checked) is what is loaded, and what `__all__` lists."""
    shown, loaded = exports_of(path)
    assert shown == loaded
    listed = next(node for node in tree_of(path).body
                  if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__")
    assert set(ast.literal_eval(listed.value)) == {name for _, _, name in shown}


COMPILED_BY_ADDRESS = {"_green_node", "_hill_node"}  # see `far_call.address_of`: kernels without a decorator


def test_kernels_without_a_door_from_python_are_called_by_kernels_alone():
    """From Python such a kernel (`inner_njit`) works, but is compiled once more for every process that calls it so."""
    def functions(path):
        return [node for node in tree_of(path).body if isinstance(node, ast.FunctionDef)]

    def marks(node):
        return " ".join(map(ast.unparse, node.decorator_list))

    inner = {(".".join(path.relative_to(SOURCE.parent).with_suffix("").parts), node.name)
             for path in MODULES for node in functions(path) if "inner_njit" in marks(node)}

    def calls_from_python(path):
        module = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
        names = {name for home, name in inner if home == module}
        names |= {alias.name for node in nodes_of(path) if isinstance(node, ast.ImportFrom)
                  for alias in node.names if (node.module, alias.name) in inner}
        for node in nodes_of(path) if names else ():
            if isinstance(node, ast.FunctionDef) and node.name not in COMPILED_BY_ADDRESS and "njit" not in marks(node):
                yield from sorted(names & {part.id for part in ast.walk(node) if isinstance(part, ast.Name)})

    assert len(inner) > 50
    assert in_modules(calls_from_python) == []
