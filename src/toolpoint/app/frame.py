"""Frame of a command around its one call: steps, progress, collected warnings, the page, the console or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

import click

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt, doubts_among, mark_notes
from toolpoint.app import console
from toolpoint.app.interrupt import unbroken_writing
from toolpoint.app.next_commands import next_commands
from toolpoint.io.output_places import check_page_place

if TYPE_CHECKING:
    from toolpoint.plot import Report


class Result(Protocol):
    """Result that a command prints: a table for the terminal, plain data for --json."""

    def table(self) -> str:
        """Return the result as text."""
        ...

    def to_dict(self) -> Any:
        """Return the result as plain data."""
        ...


class Frame:
    """One run of a command: where its page goes, whether it prints JSON, the warnings collected so far, and the doubts that
    came with the files it read: they stand before all else in table, page and JSON.

    A command of several steps begins by reading and ends by its page. What it shows is printed when its progress has ended, in
    the order in which it was shown.
    """

    def __init__(self, output: Path | None, as_json: bool, steps: int = 0) -> None:
        self.output, self.as_json, self.steps = output, as_json, steps
        self.warnings, self.file_doubts = list[str](), list[Doubt]()
        self._stack, self._steps_begun = ExitStack(), 0
        self._show: Callable[..., None] | None = None
        self._pending_output, self._written, self._shown_lines = list[Callable[[], None]](), list[str](), list[str]()
        self._unwritten: list[Exception] = []
        self._has_suggested, self.answers = False, dict[str, Any]()  # numbers that the lines of next commands take

    def __enter__(self) -> Frame:
        if self.output is not None and self.output.suffix != ".h5":  # that of identify is a file of modes, and no page
            # Before anything is read: a page that has no place would be said after minutes of computing.
            check_page_place(self.output)
        self.warnings = self._stack.enter_context(console.collect_warnings(self.file_doubts))
        self.step("reading")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        # The progress ends first: its bars would be drawn over what is printed.
        self._stack.__exit__(kind, error, trace)
        if not self.as_json:
            # Doubts of files come before everything that rests on them; what a table repeats already is not said twice.
            for line in mark_notes(doubt for doubt in self.file_doubts if not any(doubt in text for text in self._shown_lines)):
                console.text(line)
        for show in self._pending_output:
            show()
        if kind is None and not self.as_json and not self._has_suggested:
            self._print_next()
        # An error of the computation is the one that counts; a file that was not written comes after it.
        if kind is None and self._unwritten:
            raise self._unwritten[0]

    def step(self, name: str) -> None:
        """Say that the next of the command's steps begins."""
        if self.steps:
            self.progress_of_parts()(name, self._steps_begun, self.steps, step=True)
            self._steps_begun += 1
        elif self._show is not None:  # the part before has ended: its name would stand there while this goes on
            self._show(name, 0, 1)

    def progress(self, name: str, folder: Path | None = None) -> Callable[[int, int], None]:
        """Return the `progress` function of a study: how much is done, and of how much; with a folder to resume from, say first
        how much was kept in it."""
        count = self.progress_of_parts()
        # Said at the first report, and only where an earlier run left chunks: else "0 of n kept" would stand there always.
        silent = folder is None or not any(folder.glob("**/chunk-*.npz"))

        def report(completed: int, total: int) -> None:
            nonlocal silent
            if not silent and completed > 0:
                console.remark(f"{completed} of {total} {name} kept in {folder} by an earlier run")
            silent = True
            count(name, completed, total)
        return report

    def progress_of_parts(self) -> Callable[..., None]:
        """Return the `progress` function of a study that takes name, done and total."""
        if self._show is None:
            # Begun with the first report: a command that refuses its input shows no bar.
            self._show = self._stack.enter_context(console.show_progress(self.as_json))
        return self._show

    def write(self, name: str, path: Path | None, write: Callable[..., object], *what: Any, **how: Any) -> bool:
        """Write a file where its path is given, and say so at the end under this name; return whether it was written.

        A file that cannot be written costs nothing of what was computed: table and page come first, its error ends the command.
        """
        if path is None:
            return False
        try:
            with unbroken_writing():
                write(*what, path, **how)
        except (ToolpointError, OSError) as error:
            self._unwritten.append(ToolpointError(f"{name} not written: {path}: {error}"))
            return False
        self._written.append(f"{name} written: {path}")
        return True

    def save(self, page: Callable[..., Report], *arguments: Any, to: Path | None = None, **named: Any) -> str:
        """Write the page that a function of `pages` makes of these arguments, where a page is asked for; `to` another place.

        Return its answer, empty where there is no page.
        """
        answer = ""
        if (place := to or self.output) is not None:
            # Studies name arguments, a page of the command line must name options.
            report = page(*arguments, **named).preceded_by(*self.file_doubts).reworded(console.spell_options)
            answer = report.summary
            try:
                with unbroken_writing():
                    written = f"Page written: {report.save(place)}"
                # A page that is brought up to date while a test runs is named once.
                if written not in self._written:
                    self._written.append(written)
            except (ToolpointError, OSError) as error:
                self._unwritten.append(ToolpointError(f"Page not written: {place}: {error}"))
        return answer

    def present(self, page: Callable[..., Report], result: Result, *arguments: Any, notes: Sequence[str] = (),
                has_answer: bool = True, **named: Any) -> None:
        """Write the page of a result, then print the result; has_answer : False where its table has none, and the page's answer
        goes before it."""
        self.step("page")
        answer = self.save(page, result, *arguments, **named)
        self.show(result, notes, answer="" if has_answer else answer)

    def show(self, result: Result, notes: Sequence[str] = (), *, answer: str = "") -> None:
        """Print the result: JSON, or its table, the doubts among the notes and the answer before it, then the other notes,
        warnings, and the files that were written."""
        if self.as_json:
            self.show_json(result.to_dict())
            return
        # A note may come from several poses or parts: each sentence is said once.
        table, doubts = result.table(), doubts_among(dict.fromkeys(notes))
        self.show_text(*mark_notes(doubt for doubt in doubts if doubt not in table), *([answer] if answer else []), table)
        self.show_rest(notes, first=doubts)

    def show_text(self, *lines: str) -> None:
        """Print lines, of which each may be a table; --json leaves them out."""
        if not self.as_json:
            self._shown_lines += lines
            self._pending_output.append(lambda: console.text("\n".join(lines)))

    def show_json(self, data: object) -> None:
        """Print plain data as JSON, the doubts of the files that were read first."""
        self._pending_output.append(lambda: print(console.spell_options(json.dumps(self._doubted(data)))))

    def _doubted(self, data: object) -> object:
        """Return plain data with the doubts of the files first."""
        if not self.file_doubts:
            return data
        if not isinstance(data, dict):
            return {"doubts": list(self.file_doubts), "result": data}
        # Some results have a table of doubts by name there: those of the files get a key of their own.
        result_doubts = data.get("doubts", [])
        if not isinstance(result_doubts, (list, tuple)):
            return {"file_doubts": list(self.file_doubts), **data}
        return {"doubts": list(dict.fromkeys([*self.file_doubts, *result_doubts])),
                **{k: v for k, v in data.items() if k != "doubts"}}

    def show_rest(self, notes: Sequence[str] = (), *, first: Sequence[str] = ()) -> None:
        """Print notes, warnings that are none of them, and the files that were written; `first` : notes that were printed."""
        if not self.as_json:
            self._pending_output.append(lambda: self._print_rest(tuple(notes), tuple(first)))

    def _print_next(self) -> None:
        """Print which commands come after this one, with its own files."""
        context = click.get_current_context(silent=True)
        commands = [] if context is None else next_commands(str(context.info_name), {**context.params, **self.answers})
        if commands:
            console.text("Next: " + "; ".join(f"toolpoint {command}" for command in commands))

    def suggest(self, *commands: str) -> None:
        """Say which commands come next."""
        self._has_suggested = True
        self.show_text("Next: " + "; ".join(f"toolpoint {command}" for command in commands))

    def _print_rest(self, notes: Sequence[str], first: Sequence[str]) -> None:
        """Print notes not yet printed, warnings that are none of them, and the files written."""
        for line in mark_notes(dict.fromkeys(note for note in notes if note not in first), "note: "):
            console.text(line)
        for warning in self.warnings:
            # A study that keeps what it warned of prints it in its table.
            if warning not in notes and not any(warning in text for text in self._shown_lines):
                console.warning(warning)
        for line in self._written:
            console.text(line)
