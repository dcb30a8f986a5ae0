"""Stamps of compiled kernels: `python docs/generate/kernel_stamps.py --write` enters new ones.

Numba keeps a compiled kernel as long as the file of the kernel stays as it is. Kernels and constants of other files are part of
the machine code too, and a change of those alone would leave old code in the cache of whoever updates. So each file whose
kernels take something from other files ends with a stamp of it; a test holds the stamps.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import re
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "src"
STAMP = re.compile(r"\n# Code of other modules in these kernels: [0-9a-f]{12}\n\Z")
DECORATORS = {"njit", "inner_njit", "overload", "intrinsic"}


@cache
def tree_of(path: Path) -> ast.Module:
    """Return the code of a file without its docstrings, which change no kernel."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            node.body = body[1:] or [ast.Pass()]
    return tree


@cache
def has_kernels(path: Path) -> bool:
    """Whether a function of a file is compiled."""
    if not re.search(r"\bnumba\b|\binner_njit\b", path.read_text(encoding="utf-8")):
        return False
    return any(isinstance(node, ast.FunctionDef) and any(name in ast.unparse(decorator) for name in DECORATORS)
               for node in ast.walk(tree_of(path)) for decorator in getattr(node, "decorator_list", ()))


@cache
def taken_from(path: Path) -> tuple[frozenset[Path], tuple[str, ...]]:
    """Return the files of kernels that a file imports from, and the code of the constants that it imports from others."""
    files, constants = set[Path](), list[str]()
    for node in tree_of(path).body:
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("toolpoint"):
            continue
        for alias in node.names:
            home = file_of(f"{node.module}.{alias.name}") or file_of(str(node.module))
            if home is None:
                continue
            if has_kernels(home):
                files.add(home)
            elif alias.name.lstrip("_").isupper():
                constants += [ast.unparse(part) for part in tree_of(home).body if isinstance(part, (ast.Assign, ast.AnnAssign))
                              and re.search(rf"\b{alias.name}\b", ast.unparse(part).partition("=")[0])]
    return frozenset(files), tuple(constants)


def file_of(module: str) -> Path | None:
    """Return the file of a module, None where there is none."""
    place = SOURCE.joinpath(*module.split("."))
    return next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)


def stamp_of(path: Path) -> str:
    """Return the stamp of what the kernels of a file take from others, through all of them; empty where that is nothing."""
    reached, waiting = {path}, [path]
    constants = set[str]()
    while waiting:
        files, values = taken_from(waiting.pop())
        constants |= set(values)
        waiting += files - reached
        reached |= files
    parts = [ast.unparse(tree_of(file)) for file in sorted(reached - {path})] + sorted(constants)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12] if parts else ""


def stamped_text(path: Path) -> str:
    """Return the text of a file with the stamp that it should have."""
    text = STAMP.sub("", path.read_text(encoding="utf-8"))
    stamp = stamp_of(path)
    return f"{text}\n# Code of other modules in these kernels: {stamp}\n" if stamp else text


def kernel_files() -> list[Path]:
    """Return the files with kernels."""
    return [path for path in sorted((SOURCE / "toolpoint").rglob("*.py"))
            if "njit" in path.read_text(encoding="utf-8") and has_kernels(path)]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    is_written = parser.parse_args().write
    stale = {path: text for path in kernel_files() if (text := stamped_text(path)) != path.read_text(encoding="utf-8")}
    for path, text in stale.items():
        print(f"{'written' if is_written else 'stale'}: {path.relative_to(SOURCE)}")
        if is_written:
            path.write_text(text, encoding="utf-8", newline="\n")
    print(f"{len(stale)} of {len(kernel_files())} files with kernels had another stamp")
