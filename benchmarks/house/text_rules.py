"""Names and first lines that a stranger could not read at once, room by room.

    python benchmarks/house/text_rules.py                       # counts of every room
    python benchmarks/house/text_rules.py src/toolpoint/cutting # each place in one folder or module
    python benchmarks/house/text_rules.py --before OTHER        # counts of another checkout beside these

The rules are those of docs/vocabulary.md. `tests/architecture/test_architecture_text.py` holds every room that has been reread
to them. The last line is the sum over the package.
"""

from __future__ import annotations

import ast
import gc
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from benchmarks.frame import ROOT, CommandLine

SOURCE = "src/toolpoint"

# A numeric constant of one word says neither what it bounds nor its unit. These are quantities or units by themselves.
NUMERIC_NOUNS = frozenset({"DAY", "GRAVITY", "INCH", "MICRON", "MILLIMETRE", "NAN", "MINDLIN", "LOGARITHM", "EXPONENTIAL"})

# Adjectives, adverbs, verbs and participles: none of them names a thing.
NO_NOUNS = frozenset((ROOT / "benchmarks/house/unclear_words/constants.txt").read_text(encoding="utf-8").split())

# Locals, parameters and fields that give a place in a sentence, not a quantity.
PLACES_IN_A_SENTENCE = frozenset((ROOT / "benchmarks/house/unclear_words/locals.txt").read_text(encoding="utf-8").split())

# Fields of descriptions are keys of files, which keep their names (`at`, `rest`).
KEY_MEANINGS = ROOT / SOURCE / "io/yaml/key_meanings.yaml"
KEYS_OF_FILES = frozenset(re.findall(r"^  (\w+):", KEY_MEANINGS.read_text(encoding="utf-8"), re.MULTILINE))

# Fields of a rectangle of a picture, beside left, width and height.
RECTANGLE_FIELDS = frozenset({"top"})

UNREADABLE_START = re.compile(
    r"(?:About|Above|Across|After|Against|Along|Among|As|At|Before|Below|Beside|Between|Beyond|By|During|For|From|How|In|Inside|Into|Like"
    r"|Near|Nor|Not|Of|On|Over|Per|Since|So|That|Through|To|Under|Until|Upon|What|Where|Which|While|Who|Whom|Whose|With|Within|Without)\b"
)


@dataclass(frozen=True)
class Place:
    """Line of a module, the rule that it breaks, and the words that break it."""

    path: Path
    line: int
    rule: str
    words: str


RULES = ("unclear constant", "constant of several modules", "place in a sentence", "first line")


def places(root: Path, folder: str = SOURCE) -> Iterator[Place]:
    """Yield every place below a folder (or in one module) that breaks a rule; constants are compared with the whole package."""
    modules_of = _modules_of_numbers(root)
    place = str(root / folder)
    for path, tree in trees(root).items():
        if str(path) == place or str(path).startswith(f"{place}/"):
            yield from _constant_places(path, tree, modules_of)
            yield from _walked_places(path, nodes(root)[path])


@lru_cache(maxsize=4)
def trees(root: Path) -> dict[Path, ast.Module]:
    """Return the syntax tree of every module."""
    gc.disable()  # a million nodes, none of them garbage: looking for it takes longer than parsing
    try:
        return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted((root / SOURCE).rglob("*.py"))}
    finally:
        gc.freeze()  # nor is it looked for among them later
        gc.enable()


@lru_cache(maxsize=4)
def nodes(root: Path) -> dict[Path, list[ast.AST]]:
    """Return all nodes of every module: walking is what rules take their time for, and several ask the same nodes."""
    gc.disable()
    try:
        return {path: list(ast.walk(tree)) for path, tree in trees(root).items()}
    finally:
        gc.freeze()
        gc.enable()


@lru_cache(maxsize=4)
def _modules_of_numbers(root: Path) -> dict[str, set[Path]]:
    """Return the modules that define each numeric constant."""
    modules_of = defaultdict[str, set[Path]](set)
    for path, tree in trees(root).items():
        for name, _, value in constants(tree):
            if is_numeric(value):
                modules_of[name].add(path)
    return modules_of


def constants(tree: ast.Module) -> Iterator[tuple[str, int, ast.expr]]:
    """Yield name (without the underscore), line and value of each constant of a module."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        value = getattr(node, "value", None)
        for target in targets:
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            values = value.elts if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) else [value] * len(names)
            for name, part in zip(names, values, strict=False):
                if isinstance(name, ast.Name) and name.id.isupper() and part is not None:
                    yield name.id.lstrip("_"), name.lineno, part


def is_numeric(value: ast.expr) -> bool:
    """Whether an expression is a number, or a tuple or list of numbers."""
    if isinstance(value, ast.Tuple | ast.List):
        return bool(value.elts) and all(map(is_numeric, value.elts))
    if isinstance(value, ast.Constant):
        return isinstance(value.value, int | float | complex)
    if not isinstance(value, ast.BinOp | ast.UnaryOp):
        return False  # names and calls: only sums, products and signs of numbers are worth the compiling
    try:
        return isinstance(eval(compile(ast.Expression(value), "constant", "eval"), {"__builtins__": {}}), int | float | complex)
    except Exception:
        return False


def _constant_places(path: Path, tree: ast.Module, modules_of: dict[str, set[Path]]) -> Iterator[Place]:
    for name, line, value in constants(tree):
        numeric = is_numeric(value)
        if name in NO_NOUNS or (numeric and "_" not in name and name not in NUMERIC_NOUNS and len(name) > 1):
            yield Place(path, line, "unclear constant", name)
        if numeric and len(modules_of[name]) > 1:
            yield Place(path, line, "constant of several modules", name)


def _walked_places(path: Path, nodes_of_module: list[ast.AST]) -> Iterator[Place]:
    """Yield the names and the first lines that break a rule, in one walk: walking is what this takes its time for."""
    kept_names, stored = KEYS_OF_FILES | RECTANGLE_FIELDS, ast.Store()
    fields = set[ast.expr]()
    for node in nodes_of_module:
        if isinstance(node, ast.Name):
            name = node.id
        elif isinstance(node, ast.Attribute):
            name = node.attr
        elif isinstance(node, ast.arg):
            name = node.arg
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            if isinstance(node, ast.ClassDef):  # it comes before the fields in it
                fields |= {field.target for field in node.body if isinstance(field, ast.AnnAssign)}
            text = ast.get_docstring(node)
            if text and UNREADABLE_START.match(text):
                yield Place(path, getattr(node, "lineno", 1), "first line", text.splitlines()[0][:90])
            continue
        else:
            continue
        if (name.lstrip("_") in PLACES_IN_A_SENTENCE and isinstance(getattr(node, "ctx", stored), ast.Store)
                and not (name in kept_names and node in fields)):
            yield Place(path, node.lineno, "place in a sentence", name)


def comments_per_hundred_lines(root: Path, folder: str = SOURCE) -> float:
    """Return the comments of a folder for each hundred of its lines."""
    comments = lines = 0
    for path in sorted((root / folder).rglob("*.py")) if (root / folder).is_dir() else [root / folder]:
        with path.open("rb") as file:
            comments += sum(token.type == tokenize.COMMENT for token in tokenize.tokenize(file.readline))
        lines += path.read_text(encoding="utf-8").count("\n")
    return 100 * comments / max(lines, 1)


def rooms(root: Path) -> list[str]:
    """Return the folders below the package, as posix paths from the root."""
    return [path.relative_to(root).as_posix() for path in sorted((root / SOURCE).iterdir()) if (path / "__init__.py").exists()]


def _count(root: Path) -> dict[str, tuple[float, ...]]:
    counts = {}
    for room in [*rooms(root), SOURCE]:
        by_rule = Counter(place.rule for place in places(root, room))
        counts[room] = (*(by_rule[rule] for rule in RULES), comments_per_hundred_lines(root, room))
    return counts


def _print_counts(counts: dict[str, tuple[float, ...]], before: dict[str, tuple[float, ...]]) -> None:
    print(f"{'':32}" + "".join(f"{rule:>30}" for rule in (*RULES, "comments a hundred lines")))
    for room, values in counts.items():
        cells = (f"{value:.3g}" if room not in before else f"{old:.3g} -> {value:.3g}"
                 for value, old in zip(values, before.get(room, values), strict=True))
        print(f"{room:32}" + "".join(f"{cell:>30}" for cell in cells))


def main() -> None:
    parser = CommandLine(__doc__)
    parser.add_argument("folder", nargs="?", help="folder or module whose places are printed, from the root of the project")
    parser.add_argument("--before", type=Path, help="another checkout, counted beside this one")
    options = parser.parse_args()
    if options.folder:
        for place in places(ROOT, options.folder.rstrip("/")):
            print(f"{place.path.relative_to(ROOT)}:{place.line}: {place.rule}: {place.words}")
    counts = _count(ROOT)
    if not options.folder:
        _print_counts(counts, _count(options.before) if options.before else {})
    total = counts[SOURCE]
    figures = [f"{rule} {value:.0f}" for rule, value in zip(RULES, total, strict=False)]
    print("; ".join([*figures, f"comments a hundred lines {total[-1]:.1f}"]))


if __name__ == "__main__":
    main()
