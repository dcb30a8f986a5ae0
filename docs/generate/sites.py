"""Every place in the package that refuses something or doubts it: the module, the line, and the words of the message."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "toolpoint"
DOUBTING = ("doubts", "beliefs", "remarks", "contradictions")  # modules whose sentences are doubts that a result carries
REFUSALS = ("fail", "ToolpointError", "UnitError", "UsageError", "BadParameter", "fault", "Fault")


@dataclass(frozen=True)
class Site:
    """A message: where it is raised, whether it is a doubt, what it says was seen, and what it says must be or is to be done
    (empty where it does not); `…` stands for what the program puts in."""

    module: str
    line: int
    is_doubt: bool
    seen: str
    cure: str = ""

    @property
    def room(self) -> str:
        """The room of the package: its first folder, or the module itself."""
        return self.module.split("/")[0].removesuffix(".py")


def text_of(node: ast.expr | None) -> str:
    """Return the text of an expression as far as it is written there, … for the rest."""
    if node is None:
        return ""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of(part) for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return text_of(node.left) + text_of(node.right)
    if isinstance(node, ast.IfExp):
        return text_of(node.body)
    return "…"


def _message(call: ast.Call, name: str) -> tuple[str, str]:
    """Return what a call says was seen, and what must be or is to be done."""
    parts = [text_of(argument) for argument in call.args]
    if name in ("fail", "Doubt"):
        parts += [text_of(keyword.value) for keyword in call.keywords if keyword.arg in ("limit", "remedy", "why")]
        subject, value, *rest = [*parts, "", ""][:4] if len(parts) < 2 else parts[:4]
        return f"{subject}: {value}", "; ".join(word for word in rest if word)
    words = (parts[-1] if name in ("fault", "Fault") else parts[0]) if parts else ""
    return _parted(words)


def _parted(words: str) -> tuple[str, str]:
    """Part a sentence at its first stop, behind which it says what must be or is to be done; none within brackets."""
    depth = 0
    for at, letter in enumerate(words):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == ";" and depth == 0:
            return words[:at], words[at + 1:]
    return words, ""


def _called(call: ast.Call) -> str:
    return call.func.id if isinstance(call.func, ast.Name) else call.func.attr if isinstance(call.func, ast.Attribute) else ""


def _is_doubt(call: ast.Call) -> bool:
    return _called(call) == "warn" and any(text_of(arg) == "…" and "ToolpointWarning" in ast.dump(arg) for arg in call.args)


@cache
def sites() -> tuple[Site, ...]:
    """Return every refusal and every doubt of the package, module by module."""
    return tuple(_search(sorted(SOURCE.rglob("*.py")), (*REFUSALS, "Doubt", "warn")))


def doubts_of(rooms: Sequence[str]) -> list[Site]:
    """Return the doubts of some rooms of the package."""
    paths = [path for room in rooms for path in sorted((SOURCE / room).rglob("*.py"))]
    return [site for site in _search(paths, ("Doubt", "warn")) if site.is_doubt]


def _search(paths: Sequence[Path], words: Sequence[str]) -> Iterator[Site]:
    """Yield the messages of modules in which one of the words is called."""
    for path in paths:
        text = path.read_text(encoding="utf-8")
        if not path.stem.endswith(DOUBTING) and not any(f"{word}(" in text for word in words):
            continue
        module, tree = path.relative_to(SOURCE).as_posix(), ast.parse(text)
        yield from _spoken(tree, module) if path.stem.endswith(DOUBTING) else ()
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            doubt = _is_doubt(node) or _called(node) == "Doubt"
            if doubt or _called(node) in REFUSALS:
                seen, cure = (" ".join(words.split()) for words in _message(node, _called(node)))
                if seen.strip("… :;()"):
                    yield Site(module, node.lineno, doubt, seen, cure)


def _spoken(tree: ast.Module, module: str) -> Iterator[Site]:
    """Yield the sentences of a module that doubts: its results carry them, nothing is raised."""
    notes = {id(node.body[0].value) for node in ast.walk(tree)
             if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module) and node.body
             and isinstance(node.body[0], ast.Expr)}
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr | ast.BinOp) for part in ast.walk(node)
             if part is not node}
    inner |= {id(part) for node in ast.walk(tree) if isinstance(node, ast.Call) and _called(node) == "Doubt"
              for part in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in notes | inner:
            words = " ".join(text_of(node).split())
            if words.count(" ") >= 5:
                yield Site(module, node.lineno, True, *(part.strip() for part in _parted(words)))
