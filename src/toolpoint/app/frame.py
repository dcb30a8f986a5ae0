"""Frame: what every command does around its one call: steps, progress, collected warnings, the page, the console or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

from toolpoint._doubt import mark_notes
from toolpoint.app import console

if TYPE_CHECKING:
    from toolpoint.plot import Report


class Result(Protocol):
    """What a command prints: a table for the terminal, plain data for --json."""

    def table(self) -> str:
        """Return the result as text."""
        ...

    def to_dict(self) -> Any:
        """Return the result as plain data."""
        ...


class Frame:
    """One run of a command: where its page goes, whether it prints JSON, the warnings collected so far.

    What a command shows is printed when its progress has ended, in the order in which it was shown.
    """

    def __init__(self, output: Path | None, as_json: bool, steps: int = 0) -> None:
        self.output, self.as_json, self.steps = output, as_json, steps
        self.warnings: list[str] = []
        self._tell: Callable[[str], None] | None = None
        self._stack, self._display = ExitStack(), ExitStack()
        self._later, self._pages = list[Callable[[], None]](), list[Path]()

    def __enter__(self) -> Frame:
        self.warnings = self._stack.enter_context(console.collect_warnings())
        self._stack.enter_context(self._display)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stack.__exit__(kind, error, trace)
        for show in self._later:
            show()

    def step(self, name: str) -> None:
        """Say that the next of the command's steps begins."""
        if self._tell is None:
            self._display.close()
            self._tell = self._display.enter_context(console.steps(self.steps, self.as_json or self.steps == 0))
        self._tell(name)

    def progress(self, name: str, folder: Path | None = None) -> Callable[[int, int], None]:
        """Return the `progress` function of a study: how much is done, and of how much; with a folder to resume from, say first
        how much was kept in it."""
        count = self.progress_of_parts()
        silent = folder is None or not any(folder.glob("**/chunk-*.npz"))

        def report(done: int, total: int) -> None:
            nonlocal silent
            if not silent and done > 0:
                console.remark(f"{done} of {total} {name} kept in {folder} by an earlier run")
            silent = True
            count(name, done, total)
        return report

    def progress_of_parts(self) -> Callable[[str, int, int], None]:
        """Return the `progress` function of a study that takes name, done and total."""
        self._display.close()  # one display at a time
        self._tell = None
        return self._display.enter_context(console.count_progress(self.as_json))

    def save(self, page: Callable[..., Report], *arguments: Any, to: Path | None = None, **named: Any) -> None:
        """Write the page that a function of `pages` makes of these arguments, where a page is asked for; `to` another place."""
        place = to or self.output
        if place is not None:
            self._pages.append(page(*arguments, **named).reworded(console.spell_options).save(place))

    def show(self, result: Result, notes: Sequence[str] = (), written: Mapping[str, Path | str | None] | None = None) -> None:
        """Print the result: JSON, or its table, notes, warnings, and the files that were written."""
        if self.as_json:
            self.show_json(result.to_dict())
            return
        self.show_text(result.table())
        self.show_rest(notes, written)

    def show_text(self, *lines: str) -> None:
        """Print lines, of which each may be a table; --json leaves them out."""
        if not self.as_json:
            self._later.append(lambda: console.text("\n".join(lines)))

    def show_json(self, data: object) -> None:
        """Print plain data as JSON."""
        self._later.append(lambda: print(console.spell_options(json.dumps(data))))

    def show_rest(self, notes: Sequence[str] = (), written: Mapping[str, Path | str | None] | None = None) -> None:
        """Print notes and doubts, warnings that are none of them, and the files that were written."""
        if not self.as_json:
            self._later.append(lambda: self._print_rest(tuple(notes), dict(written or {})))

    def suggest(self, *commands: str) -> None:
        """Say which commands come next."""
        self.show_text("Next: " + "; ".join(f"toolpoint {command}" for command in commands))

    def _print_rest(self, notes: Sequence[str], written: Mapping[str, Path | str | None]) -> None:
        for line in mark_notes(dict.fromkeys(notes), "note: "):
            console.text(line)
        for warning in self.warnings:
            if warning not in notes:
                console.warning(warning)
        for name, path in written.items():
            if path is not None:
                console.text(f"{name} written: {path}")
        for page in self._pages:
            console.text(f"Page written: {page}")
