"""Options of identify for poles that a person adds or modes that go: --choice FILE, --add HZ,PERCENT, --remove HZ."""

from __future__ import annotations

import functools
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from toolpoint.app.options import PATH

if TYPE_CHECKING:
    from toolpoint.modal_identification import PoleChoice


_OPTIONS = ("--choice", "--add", "--remove")
_GIVEN = "toolpoint.arguments"


class CommandOfChoice(click.Command):
    """A command that keeps the words it was given, so that its page can say how to run it again."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta[_GIVEN] = tuple(args)
        return super().parse_args(ctx, args)


@dataclass(frozen=True)
class Choice:
    """What was given: a choice file, and poles beside it."""

    file: Path | None
    add: tuple[tuple[float, float], ...]
    remove: tuple[float, ...]
    arguments: tuple[str, ...] = ()

    @property
    def command(self) -> str:
        """The command as it was given, without a choice."""
        kept, rest = [], list(self.arguments)
        while rest:
            word = rest.pop(0)
            if word in _OPTIONS:
                rest = rest[1:]
            elif not word.startswith(tuple(f"{option}=" for option in _OPTIONS)):
                kept.append(word)
        return "toolpoint identify " + shlex.join(kept)

    def read(self) -> PoleChoice | None:
        """Return the choice, None where nothing was given."""
        if self.file is None and not self.add and not self.remove:
            return None
        from toolpoint.io.yaml.testing import choice_file
        from toolpoint.modal_identification import AddedPole, PoleChoice

        first = PoleChoice() if self.file is None else choice_file.read(self.file)
        added = tuple(AddedPole(frequency, ratio) for frequency, ratio in self.add)
        return PoleChoice((*first.add, *added), (*first.remove, *self.remove))


def choice_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options; it gets them as one `Choice`."""

    @click.option("--choice", "choice_path", type=PATH, help="YAML file of poles added and modes removed by hand, as the page "
                                                             "writes it.")
    @click.option("--add", multiple=True, callback=_added, metavar="HZ,PERCENT", help="A pole to add: frequency and damping.")
    @click.option("--remove", multiple=True, type=click.FloatRange(0, min_open=True), metavar="HZ",
                  help="A mode to leave out, by its frequency.")
    @functools.wraps(command)
    def wrapped(*args: Any, choice_path: Path | None, add: tuple[tuple[float, float], ...], remove: tuple[float, ...],
                **values: Any) -> Any:
        given = click.get_current_context().meta.get(_GIVEN, ())
        return command(*args, choice=Choice(choice_path, add, remove, given), **values)

    return wrapped


def _added(ctx: click.Context, parameter: click.Parameter, value: tuple[str, ...]) -> tuple[tuple[float, float], ...]:
    poles = []
    for text in value:
        try:
            frequency, percent = (float(part) for part in text.split(","))
        except ValueError:
            raise click.BadParameter(f"{text!r}: write frequency and damping, Hz and percent, for example 34.2,1.5") from None
        if not frequency > 0 or not 0 < percent <= 50:
            raise click.BadParameter(f"{text!r}: the frequency must be above 0 Hz, the damping above 0 and at most 50 %")
        poles.append((frequency, percent / 100))
    return tuple(poles)
