"""Every place in the package that refuses something or doubts it: the module, the line, and the words of the message."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "toolpoint"
DOUBTING = ("doubts", "beliefs", "remarks", "contradictions")  # modules whose sentences are doubts that a result carries
REFUSALS = ("fail", "ToolpointError", "UnitError", "UsageError", "BadParameter", "fault", "Fault")


@dataclass(frozen=True)
class Site:
    """A message: where it is raised, whether it is a doubt, and its words; `…` stands for what the program puts in."""

    module: str
    line: int
    is_doubt: bool
    words: str

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


def _message(call: ast.Call, name: str) -> str:
    parts = [text_of(argument) for argument in call.args]
    if name == "fail":
        parts += [text_of(keyword.value) for keyword in call.keywords]
        subject, value, limit, *remedy = [*parts, "", ""][:4] if len(parts) < 4 else parts[:4]
        return f"{subject}: {value}; {limit}" + (f" ({remedy[0]})" if remedy and remedy[0] else "")
    if name in ("fault", "Fault"):
        return parts[-1] if parts else ""
    return parts[0] if parts else ""


def _called(call: ast.Call) -> str:
    return call.func.id if isinstance(call.func, ast.Name) else call.func.attr if isinstance(call.func, ast.Attribute) else ""


def _is_doubt(call: ast.Call) -> bool:
    return _called(call) == "warn" and any(text_of(arg) == "…" and "ToolpointWarning" in ast.dump(arg) for arg in call.args)


def sites() -> Iterator[Site]:
    """Yield every refusal and every doubt of the package, module by module."""
    for path in sorted(SOURCE.rglob("*.py")):
        module, tree = path.relative_to(SOURCE).as_posix(), ast.parse(path.read_text(encoding="utf-8"))
        yield from _spoken(tree, module) if path.stem.endswith(DOUBTING) else ()
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            doubt = _is_doubt(node)
            if doubt or _called(node) in REFUSALS:
                words = " ".join(_message(node, _called(node)).split())
                if words.strip("… :;()"):
                    yield Site(module, node.lineno, doubt, words)


def _spoken(tree: ast.Module, module: str) -> Iterator[Site]:
    """Yield the sentences of a module that doubts: its results carry them, nothing is raised."""
    notes = {id(node.body[0].value) for node in ast.walk(tree)
             if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module) and node.body
             and isinstance(node.body[0], ast.Expr)}
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr | ast.BinOp) for part in ast.walk(node)
             if part is not node}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in notes | inner:
            words = " ".join(text_of(node).split())
            if words.count(" ") >= 5:
                yield Site(module, node.lineno, True, words)
