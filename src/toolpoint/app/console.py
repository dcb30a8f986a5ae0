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

from toolpoint._check import ToolpointWarning

FIRST_LINE, NEXT_LINE = 2.0, 10.0  # s, of progress without a terminal
ASCII = str.maketrans(dict.fromkeys("┏┳┓┡╇┩└┴┘", "+") | dict.fromkeys("━─", "-") | dict.fromkeys("┃│", "|"))


def text(lines: str) -> None:
    """Print plain text as it is; where the terminal knows no lines for tables, with plain signs."""
    from toolpoint.app.terminal import OUT

    plain = spell_options(lines)
    OUT.print(plain.translate(ASCII) if OUT.options.ascii_only else plain, markup=False)


def suggest(*commands: str) -> None:
    """Say which commands come next."""
    text("Next: " + "; ".join(f"toolpoint {command}" for command in commands))


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
def _spoken(state: Callable[[], str]) -> Iterator[None]:
    """Print what is being done, a line now and then, where nobody watches a terminal: in a log, a pipe, a batch job."""
    ended, start = threading.Event(), time.monotonic()

    def speak() -> None:
        wait = FIRST_LINE
        while not ended.wait(wait):
            if state():
                from toolpoint.app.terminal import ERR

                ERR.print(f"{state()}, {time.monotonic() - start:.0f} s", markup=False)
                wait = NEXT_LINE
    thread = threading.Thread(target=speak, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def steps(total: int, quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Show progress through a number of named steps; call the given function at the start of each."""
    if quiet:
        yield lambda name: None
        return

    said, done = "", -1
    if not interactive():
        def tell(name: str) -> None:
            nonlocal done, said
            done += 1
            said = f"{name} (step {done + 1} of {total})"
        with _spoken(lambda: said):
            yield tell
        return

    from toolpoint.app.terminal import bar_of_steps

    with bar_of_steps() as progress:
        task = progress.add_task("", total=total)

        def step(name: str) -> None:
            nonlocal done
            done += 1
            progress.update(task, description=name, completed=done)
        yield step
        progress.update(task, completed=total)


@contextmanager
def count_progress(quiet: bool = False) -> Iterator[Callable[[str, int, int], None]]:
    """Show progress of a study's parts; the given function takes the name of a part, how much is done, and of how much."""
    if quiet:
        yield lambda name, done, total: None
        return

    said = ""
    if not interactive():
        def tell(name: str, done: int, total: int) -> None:
            nonlocal said
            said = f"{name}: {done} of {total}"
        with _spoken(lambda: said):
            yield tell
        return

    from toolpoint.app.terminal import bars_of_parts

    with bars_of_parts() as progress:
        tasks: dict[str, Any] = {}

        def count(name: str, done: int, total: int) -> None:
            if name not in tasks:
                tasks[name] = progress.add_task(name, total=total)
            progress.update(tasks[name], completed=done, total=total)
        yield count


@contextmanager
def collect_warnings() -> Iterator[list[str]]:
    """Collect ToolpointWarnings as text, so that a command can print them and put them on its page."""
    texts: list[str] = []
    original = warnings.showwarning

    def keep(message: Any, category: type[Warning], *rest: Any) -> None:
        if issubclass(category, ToolpointWarning):
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
