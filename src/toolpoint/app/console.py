"""What the terminal shows: tables, progress, and errors without a traceback."""

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

FIRST_LINE, NEXT_LINE = 2.0, 10.0  # s, of progress without a terminal
ASCII = str.maketrans(dict.fromkeys("┏┳┓┡╇┩└┴┘", "+") | dict.fromkeys("━─", "-") | dict.fromkeys("┃│", "|"))


def text(lines: str) -> None:
    """Print plain text as it is; where the terminal knows no lines for tables, with plain signs."""
    from toolpoint.app.terminal import OUT

    plain = spell_options(lines)
    OUT.print(plain.translate(ASCII) if OUT.options.ascii_only else plain, markup=False)


def warning(message: str) -> None:
    """Print a warning beside the result."""
    from toolpoint.app.terminal import ERR

    ERR.print("warning: " + spell_options(message), markup=False, style="yellow")


def remark(message: str) -> None:
    """Print what goes on beside the result."""
    from toolpoint.app.terminal import ERR

    ERR.print(spell_options(message), markup=False, soft_wrap=True)


def error(message: str) -> None:
    """Print an error as plain text: file contents in it must not be read as markup."""
    click.secho("error: " + spell_options(message), err=True, fg="red")


def spell_options(text: str) -> str:
    """Return a message with the arguments of Python that it names (`frf_x`) spelled as options (--frf-x)."""
    return re.sub(r"`([a-z][a-z_]*)`", lambda match: "--" + match[1].replace("_", "-"), text)


@contextmanager
def _spoken() -> Iterator[Callable[[str], None]]:
    """Give a function that takes what is being done; it is printed, a line now and then, where nobody watches a terminal: in a
    log, a pipe, a batch job."""
    ended, start, said = threading.Event(), time.monotonic(), ""

    def say(words: str) -> None:
        nonlocal said
        said = words

    def speak() -> None:
        wait = FIRST_LINE
        while not ended.wait(wait):
            if said:
                from toolpoint.app.terminal import ERR

                meanwhile = f" ({COMPILING})" if is_compiling() else ""
                ERR.print(f"{said}, {time.monotonic() - start:.0f} s{meanwhile}", markup=False)
                wait = NEXT_LINE
    thread = threading.Thread(target=speak, daemon=True)
    thread.start()
    try:
        yield say
    finally:
        ended.set()
        thread.join()


@contextmanager
def show_progress(quiet: bool = False) -> Iterator[Callable[..., None]]:
    """Show how work goes on; the given function takes the name of a part, how much of it is done, and of how much. With `step`
    the part is the next of so many: it takes the place of the one before."""
    if quiet:
        yield lambda name, done, total, *, step=False: None
    elif not interactive():
        with _spoken() as say:
            yield lambda name, done, total, *, step=False: say(
                f"{name} (step {done + 1} of {total})" if step else f"{name}: {done} of {total}")
    else:
        from toolpoint.app.terminal import progress_bars

        with progress_bars() as bars:
            tasks: dict[str, Any] = {}

            def show(name: str, done: int, total: int, *, step: bool = False) -> None:
                if (key := "" if step else name) not in tasks:
                    tasks[key] = bars.add_task(name, total=total)
                bars.update(tasks[key], description=name, completed=done, total=total)
            yield show


@contextmanager
def collect_warnings(file_doubts: list[Doubt] | None = None) -> Iterator[list[str]]:
    """Collect ToolpointWarnings as text, so that a command can print them and put them on its page; doubts that came with a
    file go to `file_doubts`."""
    texts: list[str] = []
    original = warnings.showwarning

    def keep(message: Any, category: type[Warning], *rest: Any) -> None:
        if file_doubts is not None and issubclass(category, FileDoubt):
            doubt = Doubt.parsed(message.args[0])
            if doubt not in file_doubts:
                file_doubts.append(doubt)
        elif issubclass(category, ToolpointWarning):
            if spell_options(str(message)) not in texts:
                texts.append(spell_options(str(message)))
        else:
            original(message, category, *rest)
    with warnings.catch_warnings():
        warnings.simplefilter("always", ToolpointWarning)
        warnings.showwarning = keep  # type: ignore[assignment]
        yield texts


def interactive() -> bool:
    """Return whether a person watches the terminal."""
    return sys.stderr.isatty()
