"""Output to the terminal: tables, progress, and errors without a traceback."""

from __future__ import annotations

import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from toolpoint._check import FileDoubt, ToolpointWarning
from toolpoint._doubt import Doubt
from toolpoint.app.first_use import COMPILING, is_compiling

FIRST_LINE_DELAY, LINE_INTERVAL = 2.0, 10.0  # s until the first line of progress without a terminal, and between further ones
# Consoles whose encoding lacks the lines of tables would end the command by an error of encoding, after all its work.
ASCII_LINES = str.maketrans(dict.fromkeys("┏┳┓┡╇┩└┴┘", "+") | dict.fromkeys("━─", "-") | dict.fromkeys("┃│", "|"))


def text(lines: str) -> None:
    """Print plain text as it is; where the terminal knows no lines for tables, with plain signs."""
    from toolpoint.app.terminal import OUTPUT_CONSOLE

    # Below `app` messages name arguments of Python; here the reader types options.
    spelled = spell_options(lines)
    OUTPUT_CONSOLE.print(spelled.translate(ASCII_LINES) if OUTPUT_CONSOLE.options.ascii_only else spelled, markup=False)


def warning(message: str) -> None:
    """Print a warning beside the result."""
    from toolpoint.app.terminal import ERROR_CONSOLE

    ERROR_CONSOLE.print("warning: " + spell_options(message), markup=False, style="yellow")


def remark(message: str) -> None:
    """Print what goes on beside the result."""
    from toolpoint.app.terminal import ERROR_CONSOLE

    ERROR_CONSOLE.print(spell_options(message), markup=False, soft_wrap=True)


def ring(times: int) -> None:
    """Ring the terminal's bell, where a person is there to hear it."""
    if interactive():
        sys.stderr.write("\a" * times)
        sys.stderr.flush()


def error(message: str) -> None:
    """Print an error as plain text: file contents in it must not be read as markup."""
    click.secho("error: " + spell_options(message), err=True, fg="red")


def spell_options(text: str) -> str:
    """Return a message with the arguments of Python that it names (`frf_x`) spelled as options (--frf-x)."""
    return re.sub(r"`([a-z][a-z_]*)`", lambda match: "--" + match[1].replace("_", "-"), text)


@contextmanager
def _progress_lines() -> Iterator[Callable[[str], None]]:
    """Give a function that takes what is being done; it is printed, a line now and then, where nobody watches a terminal: in a
    log, a pipe, a batch job."""
    has_ended, start, last_words = threading.Event(), time.monotonic(), ""

    def say(words: str) -> None:
        nonlocal last_words
        last_words = words

    def speak() -> None:
        wait = FIRST_LINE_DELAY
        while not has_ended.wait(wait):
            if last_words:
                from toolpoint.app.terminal import ERROR_CONSOLE

                meanwhile = f" ({COMPILING})" if is_compiling() else ""
                ERROR_CONSOLE.print(f"{last_words}, {time.monotonic() - start:.0f} s{meanwhile}", markup=False)
                wait = LINE_INTERVAL
    # Kernels release the interpreter's lock, so that a thread speaks while they compute.
    thread = threading.Thread(target=speak, daemon=True)
    thread.start()
    try:
        yield say
    finally:
        has_ended.set()
        thread.join()


@contextmanager
def show_progress(quiet: bool = False) -> Iterator[Callable[..., None]]:
    """Show how work goes on; the given function takes the name of a part, how much of it is done, and of how much. With `step`
    the part is the next of so many: it takes the place of the one before."""
    if quiet:
        yield lambda name, completed, total, *, step=False: None
    elif not interactive():
        with _progress_lines() as say:
            yield lambda name, completed, total, *, step=False: say(
                f"{name} (step {completed + 1} of {total})" if step else
                # One part says nothing by "0 of 1" however long it takes.
                name if total <= 1 else f"{name}: {completed} of {total}")
    else:
        from toolpoint.app.terminal import progress_bars

        with progress_bars() as bars:
            tasks: dict[str, Any] = {}

            def show(name: str, completed: int, total: int, *, step: bool = False) -> None:
                # All steps share one bar, which the next step takes over; parts of a step have one each.
                if (key := "" if step else name) not in tasks:
                    tasks[key] = bars.add_task(name, total=total)
                bars.update(tasks[key], description=name, completed=completed, total=total)
            yield show


@contextmanager
def collect_warnings(file_doubts: list[Doubt] | None = None) -> Iterator[list[str]]:
    """Collect ToolpointWarnings as text, so that a command can print them and put them on its page; doubts that came with a
    file go to `file_doubts`."""
    texts: list[str] = []
    original = warnings.showwarning

    def keep(message: Any, category: type[Warning], *location: Any) -> None:
        if file_doubts is not None and issubclass(category, FileDoubt):
            doubt = Doubt.parsed(message.args[0])
            if doubt not in file_doubts:
                file_doubts.append(doubt)
        elif issubclass(category, ToolpointWarning):
            if spell_options(str(message)) not in texts:
                texts.append(spell_options(str(message)))
        else:
            original(message, category, *location)
    with warnings.catch_warnings():
        # Each place warns once by default: a second command of one process would lose what the first was told.
        warnings.simplefilter("always", ToolpointWarning)
        warnings.showwarning = keep  # type: ignore[assignment]
        yield texts


def interactive() -> bool:
    """Return whether a person watches the terminal."""
    return sys.stderr.isatty()
