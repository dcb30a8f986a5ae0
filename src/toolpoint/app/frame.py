"""What every command does around its one call: steps, progress, collected warnings, the page, the console or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from toolpoint.app import console

if TYPE_CHECKING:
    from toolpoint.plot import Report


class Result(Protocol):
    """What a command prints: a table for the terminal, plain data for --json."""

    def table(self) -> str:
        """Return the result as text."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data."""
        ...


class Frame:
    """One run of a command: where its page goes, whether it prints JSON, the warnings collected so far."""

    def __init__(self, output: Path | None, as_json: bool, step: Callable[[str], None], warnings: list[str]) -> None:
        self.output, self.as_json, self.step, self.warnings = output, as_json, step, warnings
        self._page: Path | None = None

    @contextmanager
    def progress(self, name: str, folder: Path | None = None) -> Iterator[Callable[[int, int], None]]:
        """Give a study its `progress` function of how much is done, and of how much; with a folder to resume from, say first
        how much was kept in it."""
        silent = folder is None or not any(folder.glob("**/chunk-*.npz"))

        def report(done: int, total: int) -> None:
            nonlocal silent
            if not silent and done > 0:
                console.remark(f"{done} of {total} {name} kept in {folder} by an earlier run")
            silent = True
            count(name, done, total)

        with self.progress_of_parts() as count:
            yield report

    def progress_of_parts(self) -> AbstractContextManager[Callable[[str, int, int], None]]:
        """Return a context that gives a study its `progress` function of name, done and total."""
        return console.count_progress(self.as_json)

    def save(self, report: Report) -> None:
        """Write the page; its notes name the arguments as options."""
        if self.output is not None:
            self._page = _with_options(report).save(self.output)

    def show(self, result: Result, notes: Sequence[str] = (), written: Mapping[str, Path | str | None] | None = None) -> None:
        """Print the result: JSON, or its table, notes, warnings, and the files that were written."""
        if self.as_json:
            self.show_json(result.to_dict())
            return
        console.text(result.table())
        self.show_rest(notes, written)

    def print_table(self, result: Result) -> None:
        """Print the table of one result of several."""
        console.text(result.table())

    def show_json(self, data: object) -> None:
        """Print plain data as JSON."""
        print(console.spell_options(json.dumps(data)))

    def show_rest(self, notes: Sequence[str] = (), written: Mapping[str, Path | str | None] | None = None) -> None:
        """Print notes, warnings that are none of them, and the files that were written."""
        for note in dict.fromkeys(notes):
            console.text("note: " + note)
        for warning in self.warnings:
            if warning not in notes:
                console.warning(warning)
        for name, path in (written or {}).items():
            if path is not None:
                console.text(f"{name} written: {path}")
        if self._page is not None:
            console.text(f"Page written: {self._page}")


@contextmanager
def frame(output: Path | None, as_json: bool, steps: int = 0) -> Iterator[Frame]:
    """Give a command its frame: progress through a number of steps, warnings collected; what is shown comes after it."""
    with console.steps(steps, as_json or steps == 0) as step, console.collect_warnings() as warnings:
        yield Frame(output, as_json, step, warnings)


def _with_options(report: Report) -> Report:
    from toolpoint.plot import Notes

    def part_of(part: Any) -> Any:
        return replace(part, lines=tuple(map(console.spell_options, part.lines))) if isinstance(part, Notes) else part

    sections = tuple(replace(section, parts=tuple(map(part_of, section.parts))) for section in report.sections)
    return replace(report, sections=sections, doubts=tuple(map(console.spell_options, report.doubts)),
                   assumptions=tuple(map(console.spell_options, report.assumptions)))
