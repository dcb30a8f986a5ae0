"""Faults of a file: all of them at once, each with line, column, a caret and the remedy."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import ToolpointError


@dataclass(frozen=True, order=True)
class Fault:
    """One fault: line and column (from 1), the key path, and what is wrong with its remedy."""

    line: int
    column: int
    path: str
    message: str


class FileFaults(ToolpointError):
    """A file with faults; `faults` holds them all in the order of their lines."""

    def __init__(self, file: str, text: str, faults: list[Fault]) -> None:
        self.file = file
        self.faults = tuple(sorted(dict.fromkeys(faults)))
        super().__init__(_shown(file, text.splitlines(), self.faults))


def _shown(file: str, lines: list[str], faults: tuple[Fault, ...]) -> str:
    parts = [f"{file}: {len(faults)} fault{'s' if len(faults) != 1 else ''}"]
    for fault in faults:
        where = f" {fault.path}:" if fault.path else ""
        parts.append(f"\n{file}:{fault.line}:{fault.column}:{where} {fault.message}")
        if 0 < fault.line <= len(lines):
            source = lines[fault.line - 1].replace("\t", " ")
            parts.append(f"  {fault.line:4d} | {source}\n       | {' ' * (fault.column - 1)}^")
    return "\n".join(parts)
