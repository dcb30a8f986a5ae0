"""Counts that tell how readable the package is, for one tree or for two side by side.

    python benchmarks/house/counts.py                    # this tree
    python benchmarks/house/counts.py --before OTHER     # another checkout beside it

Every figure is defined by the function that counts it; the last line repeats them all in one row.
"""

from __future__ import annotations

import ast
import importlib
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.frame import ROOT, CommandLine

VAGUE = ("found", "made", "told", "wanted", "one", "own")
SLOT = re.compile(r"\w\[(?:[A-Za-z_]\w*, )?(?:[2-9]|[1-9]\d)(?::\d+)?\]")
LONG = 40


@lru_cache(maxsize=4)
def modules(root: Path) -> dict[Path, tuple[str, ast.Module]]:
    """Return text and syntax tree of every module of a checkout."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted((root / "src/toolpoint").rglob("*.py"))}
    return {path: (text, ast.parse(text)) for path, text in texts.items()}


def functions(root: Path) -> Iterator[tuple[Path, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """Yield every function and method with its file."""
    for path, (_, tree) in modules(root).items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield path, node


def lines_of_app(root: Path) -> int:
    """Return the lines of Python in `app`."""
    return sum(text.count("\n") for path, (text, _) in modules(root).items() if "app" in path.parts)


COMMANDS_THEN = {
    "calibrate", "check", "correlate", "demo", "drive", "frequency_map", "identify", "joints", "lobes", "map_chatter", "mill",
    "modes", "report", "schema", "sensitivity", "speeds", "turn", "update", "run_machining_centre",
}


def lines_of_app_then(root: Path) -> int:
    """Return the lines of `app` without those that serve only commands and demos that came after the bar was set: definitions
    in the modules of commands that none of `COMMANDS_THEN` reaches by name."""
    count = 0
    for path, (text, tree) in modules(root).items():
        if "app" in path.parts:
            count += text.count("\n") - (_lines_reached_by_none(tree) if path.parent.name == "commands" else 0)
    return count


def _lines_reached_by_none(tree: ast.Module) -> int:
    """Return the lines of a module's definitions, with the blank ones before them, that no command of then leads to."""
    definitions = {name: node for node in tree.body for name in _names_defined(node)}
    reached, waiting = set[str](), [name for name in definitions if name in COMMANDS_THEN]
    while waiting:
        name = waiting.pop()
        reached.add(name)
        names = {node.id for node in ast.walk(definitions[name]) if isinstance(node, ast.Name)}
        waiting += [other for other in names & set(definitions) - reached if other != "DEMOS"]
    if not reached:
        return tree.body[-1].end_lineno or 0
    ends = [0, *(node.end_lineno or 0 for node in tree.body)]
    return sum(end - start for start, end, node in zip(ends, ends[1:], tree.body, strict=False)
               if (names := _names_defined(node)) and not set(names) & reached)


def _names_defined(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


def largest_folder(root: Path) -> int:
    """Return the most modules that one folder holds, `__init__` left out."""
    return max(Counter(path.parent for path in modules(root) if path.stem != "__init__").values())


def type_ignores(root: Path) -> int:
    """Return the lines that tell the type checker to look away."""
    return sum(len(re.findall(r"# type: ignore", text)) for text, _ in modules(root).values())


def unchecked_modules(root: Path) -> int:
    """Return the modules whose types are not checked at all, by the project's settings or by a line of their own."""
    settings = (root / "pyproject.toml").read_text(encoding="utf-8")
    by_settings = {name for block in settings.split("[[tool.mypy.overrides]]")[1:] if "ignore_errors = true" in block
                   for name in re.findall(r'"(toolpoint[^"]*)"', block)}
    by_themselves = {".".join(path.relative_to(root / "src").with_suffix("").parts)
                     for path, (text, _) in modules(root).items() if "mypy: ignore-errors" in text}
    return len(by_settings | by_themselves)


def _is_public(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return not node.name.startswith("_")


def _is_compiled(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any("njit" in ast.unparse(mark) or "vectorize" in ast.unparse(mark) for mark in node.decorator_list)


def positional_arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the number of positional arguments, `self` and `cls` left out."""
    names = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
    return len(names) - (1 if names[:1] in (["self"], ["cls"]) else 0)


def is_crowded(node: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether a public function that is no kernel takes more than three positional arguments."""
    return positional_arguments(node) > 3 and _is_public(node) and not _is_compiled(node)


def many_positional(root: Path) -> int:
    """Return the public functions, compiled kernels and callbacks of commands left out, with more than three positional
    arguments."""
    return sum(is_crowded(node) for path, node in functions(root) if "app" not in path.parts)


def widest_kernel(root: Path) -> int:
    """Return the most positional arguments of a compiled kernel."""
    return max((positional_arguments(node) for _, node in functions(root) if _is_compiled(node)), default=0)


def doubled_class_names(root: Path) -> int:
    """Return the class names that stand for more than one class."""
    nodes = (node for _, tree in modules(root).values() for node in ast.walk(tree))
    names = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    return sum(count > 1 for count in names.values())


def numbered_slots(root: Path) -> int:
    """Return the lines of `drives` and `cutting`, and of the C sources, that index an array by a number above one."""
    texts = [text for path, (text, _) in modules(root).items() if {"drives", "cutting"} & set(path.parts)]
    texts += [path.read_text(encoding="utf-8") for path in (root / "src/toolpoint").rglob("*.[ch]")]
    return sum(bool(SLOT.search(line)) for text in texts for line in text.splitlines())


def vague_names(root: Path) -> int:
    """Return how often a variable is called `found`, `made`, `told`, `wanted`, `one` or `own`."""
    nodes = (node for _, tree in modules(root).values() for node in ast.walk(tree))
    return sum(isinstance(node, ast.Name) and node.id in VAGUE for node in nodes)


def participle_functions(root: Path) -> int:
    """Return the public module-level functions whose first word is a participle; a changed copy of an object is a method."""
    count = 0
    for _, tree in modules(root).values():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and _is_public(node):
                first = node.name.split("_")[0]
                count += bool(re.fullmatch(r"(?!seed|need|speed|feed)\w{2,}ed", first)) or first in ("found", "made", "told")
    return count


def long_functions(root: Path) -> int:
    """Return the functions of more than 40 lines of code, docstring left out, compiled kernels left out."""
    def size(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
        body = node.body[1:] if ast.get_docstring(node) else node.body
        return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0

    return sum(size(node) > LONG for _, node in functions(root) if not _is_compiled(node))


USERS = ("src", "examples", "benchmarks", "README.md")


def uncalled_names(root: Path) -> int:
    """Return the public functions, classes and methods that nothing but their definition, an export or a docstring names."""
    return len(_uncalled(root, (*USERS, "tests")))


def called_by_tests_alone(root: Path) -> int:
    """Return the public functions, classes and methods that tests alone name."""
    return len(_uncalled(root, USERS) - _uncalled(root, (*USERS, "tests")))


@lru_cache(maxsize=8)
def _uncalled(root: Path, places: tuple[str, ...]) -> frozenset[str]:
    used: Counter[str] = Counter()
    for place in places:
        at = root / place
        if at.is_file():
            used.update(set(re.findall(r"\w+", at.read_text(encoding="utf-8"))))
            continue
        for path in at.rglob("*.py"):
            used.update(_names_used(path))
    # What is exported under another name is used where that name is.
    used.update({name for alias, name in _aliases(root) if alias in used})
    return frozenset(_definitions(root) - set(used))


def _aliases(root: Path) -> set[tuple[str, str]]:
    """Return pairs of the name under which something is imported and its own."""
    return {(node.asname, node.name) for _, tree in modules(root).values() for node in ast.walk(tree)
            if isinstance(node, ast.alias) and node.asname}


def _names_used(path: Path) -> set[str]:
    """Return the names that a file reads, calls, imports (not merely to export them), or looks up as text."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, ast.Attribute):
            names.add(node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and path.name != "__init__.py":
            names.update(re.findall(r"\w+", node.value) if len(node.value) < 200 else [])
    return names


def _definitions(root: Path) -> set[str]:
    """Return public functions, classes and methods, without commands and what a foreign base class calls."""
    names = set()
    for _, tree in modules(root).values():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_") and not _is_command(node):
                names.add(node.name)
            if isinstance(node, ast.ClassDef):
                foreign = _methods_of_bases(node, tree)
                names |= {item.name for item in node.body if isinstance(item, ast.FunctionDef) and _is_public(item)} - foreign
    return names


def _is_command(node: ast.FunctionDef | ast.ClassDef) -> bool:
    return any(ast.unparse(mark).startswith(("click.command", "command")) for mark in node.decorator_list)


def _methods_of_bases(node: ast.ClassDef, tree: ast.Module) -> set[str]:
    """Return the methods that a class takes over from base classes of other packages."""
    homes = {(alias.asname or alias.name): (item.module or "", alias.name) for item in tree.body
             if isinstance(item, ast.ImportFrom) for alias in item.names}
    homes |= {(alias.asname or alias.name): (alias.name, "") for item in tree.body if isinstance(item, ast.Import)
              for alias in item.names}
    names: set[str] = set()
    for base in node.bases:
        first, *rest = ast.unparse(base).split(".")
        module, attribute = homes.get(first, ("toolpoint", ""))
        if not module.startswith("toolpoint") and (attribute or rest):
            names |= set(dir(getattr(importlib.import_module(module), rest[0] if rest else attribute, object)))
    return names


COUNTS: dict[str, Callable[[Path], int]] = {
    "lines of app": lines_of_app, "lines of app, for the commands of 2026-11-21": lines_of_app_then,
    "modules in the largest folder": largest_folder,
    "type: ignore": type_ignores, "modules without type checking": unchecked_modules,
    "public functions with more than 3 positional arguments": many_positional,
    "arguments of the widest kernel": widest_kernel, "class names used twice": doubled_class_names,
    "lines with numbered slots": numbered_slots, "vague variable names": vague_names,
    "functions named by participles": participle_functions, "functions above 40 lines": long_functions,
    "public names nobody calls": uncalled_names, "public names called by tests alone": called_by_tests_alone,
}


def main() -> None:
    """Print the counts, before and now where two trees are given."""
    parser = CommandLine(__doc__)
    parser.add_argument("--before", type=Path, help="another checkout to count beside this one")
    parser.add_argument("--list", action="store_true", help="name what nobody calls")
    given = parser.parse_args()
    roots = [path.resolve() for path in (given.before, ROOT) if path is not None]
    rows = {name: [count(root) for root in roots] for name, count in COUNTS.items()}
    for name, values in rows.items():
        print(f"{name:56s}" + "".join(f"{value:8d}" for value in values))
    if given.list:
        nobody = _uncalled(ROOT, (*USERS, "tests"))
        print("nobody calls:", ", ".join(sorted(nobody)))
        print("tests alone:", ", ".join(sorted(_uncalled(ROOT, USERS) - nobody)))
    print("; ".join(f"{name} {' -> '.join(map(str, values))}" for name, values in rows.items()))


if __name__ == "__main__":
    main()
