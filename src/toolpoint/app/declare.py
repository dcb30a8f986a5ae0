"""Commands declared by their signatures: what a parameter is annotated with becomes its option, a record a group of options.

    @command(steps=2)
    def campbell(run: Frame, machine: MachineFile, *, count: Count = 8, pose: Pose = None) -> None:

A parameter of type bool is a flag, of int or float a number within the limits of its `Help`, of Literal a choice, of
``tuple[..., ...]`` may be given several times. Values of other types say in their annotation how they are made from a text
(`Reading`, or any type of click). A dataclass, or a parameter marked by another `Group`, brings its options in its own place.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, is_dataclass
from functools import cached_property
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, Union, get_args, get_origin, get_type_hints

import click
from click.core import ParameterSource

from toolpoint._check import ToolpointError, suggestion
from toolpoint.app import console
from toolpoint.app.frame import Frame

REPLACE_KEY = "toolpoint.replace"

if TYPE_CHECKING:
    # Only for the type checker: click 8.1 to 8.2 cannot index these classes.
    _ParameterType = click.ParamType[Any]
    _WordsType = click.Choice[str]
else:  # generic from click 8.3 on only
    _ParameterType = click.ParamType
    _WordsType = click.Choice


class WordChoice(_WordsType):
    """One of a few words; a word of the same meaning, or a near one, is proposed."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Return what is wrong, with the word that was meant."""
        proposal = suggestion(str(value), map(str, self.choices))
        return super().get_invalid_choice_message(value, ctx) + (f" ({proposal})" if proposal else "")


@dataclass(frozen=True)
class Help:
    """Help of an option, and what limits it.

    name : as it is typed, where it is not the parameter's name (``--at``; ``-m --modes``);
    minimum, above, maximum : limits of a number; scale : SI units in the unit in which a number is typed, default and limits
    too; default : as it is typed, where the function has none; default_text : the default in words, where it is no value;
    needs, excludes : an option without which, or beside which, this one has no meaning, and why.
    """

    help: str
    name: str = ""
    metavar: str | None = None
    minimum: float | None = None
    above: float | None = None
    maximum: float | None = None
    scale: float = 1.0
    default: str = ""
    default_text: str = ""
    needs: str = ""
    excludes: str = ""


@dataclass(frozen=True)
class Printed:
    """An option that prints a text and ends, whatever else is given."""

    name: str
    help: str
    text: Callable[[], str]

    def option(self) -> click.Option:
        """Return the option."""
        def show(ctx: click.Context, parameter: click.Parameter, value: bool) -> None:
            if value:
                console.text(self.text())
                ctx.exit()
        return click.Option([self.name], is_flag=True, is_eager=True, expose_value=False, callback=show, help=self.help)


class Argument:
    """Marks a parameter that is typed without a name."""


class Group(Protocol):
    """Several parameters of the command line that a command receives as one value."""

    def parameters(self) -> list[click.Parameter]:
        """Return the parameters in the order of the help."""
        ...

    def gather(self, values: dict[str, Any]) -> Any:
        """Take the values of the parameters out of all values, and return what the command receives."""
        ...




class Reading(_ParameterType):
    """A value made from a text by `read`; a text that it refuses by a bare ValueError ends with how to write it."""

    name = "text"

    def __init__(self, read: Callable[[str], Any], form: str = "") -> None:
        self.read, self.form = read, form

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the value of a text; defaults are values already."""
        if not isinstance(value, str):
            return value
        try:
            return self.read(value)
        except ToolpointError as error:
            self.fail(str(error), param, ctx)
        # What a short reader raises of its own names neither option nor form: the form is said in its place.
        except (ValueError, KeyError, IndexError):
            self.fail(f"{value!r}: write {self.form}", param, ctx)


class _Number(click.FloatRange):
    """A number with limits, in the unit that is typed, returned in SI."""

    scale = 1.0
    help = ""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return a number within the limits, in SI; nan lies in none."""
        # Every comparison with NaN is false, so that click would let it through any limits.
        if self._describe_range() and str(value).strip().lower() == "nan":
            self.fail(f"{value} is not in the range {self._describe_range()}", param, ctx)
        # Click's own message names the type alone; the help says which quantity and unit are asked for.
        if isinstance(value, str) and not _is_float(value):
            self.fail(f"{value!r} is not a number; write it with a point, without its unit: {self.help}", param, ctx)
        return self.scale * super().convert(value, param, ctx)

    def _describe_range(self) -> str:
        return "" if self.min is self.max is None else super()._describe_range()


def _is_float(text: str) -> bool:
    """Whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


class DeclaredCommand(click.Command):
    """A command whose options say what they need and exclude; `words` is what was typed after its name."""

    words: tuple[str, ...] = ()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the words, read them, and refuse options that contradict each other."""
        # Before click takes them: a page says the command as it was typed.
        self.words = tuple(args)
        remaining = super().parse_args(ctx, args)
        # Only what was typed contradicts: a default beside an option that excludes it is no wish of the user.
        typed_options = {option for parameter in self.params if _is_given(ctx, parameter) for option in parameter.opts}
        for parameter in self.params:
            if isinstance(parameter, _DeclaredOption) and typed_options & set(parameter.opts):
                parameter.check(typed_options)
        return remaining


class _DeclaredOption(click.Option):
    declared: Help

    def check(self, typed_options: set[str]) -> None:
        """Refuse the option beside those that were given."""
        name, needs, excludes = self.opts[-1], self.declared.needs, self.declared.excludes
        if needs and needs.split(",")[0] not in typed_options:
            raise ToolpointError(f"{name}: needs {needs}")
        if excludes and excludes.split(",")[0] in typed_options:
            raise ToolpointError(f"{name}: must not stand beside {excludes}; must be one of them")


def list_given(*names: str) -> list[str]:
    """Return those of the options, by their parameters' names, that were typed in the command that runs, as they are typed."""
    ctx = click.get_current_context()
    return [parameter.opts[-1] for parameter in ctx.command.params if parameter.name in names and _is_given(ctx, parameter)]


def _is_given(ctx: click.Context, parameter: click.Parameter) -> bool:
    """Whether a parameter was typed in the command."""
    return ctx.get_parameter_source(parameter.name or "") is ParameterSource.COMMANDLINE


def command(name: str | None = None, *, steps: int = 0, page: bool = True, json: bool = True, replace: bool = False,
            page_beside_json: bool = True, printed: Printed | None = None) -> Callable[[Callable[..., None]], DeclaredCommand]:
    """Return what makes a command of a function.

    steps : how many steps it names (`Frame.step`), for the progress; page, json, replace : whether it has the options --output,
    --json and --replace; page_beside_json : whether --json still writes the page; printed : what it can print alone. A function
    without `run` has no --output and --json.
    """
    def declare(function: Callable[..., None]) -> DeclaredCommand:
        declared = _Signature(function)
        parameters = declared.parameters()
        parameters += [*([printed.option()] if printed else []), *([_replace_option()] if replace else []),
                       *(_output_options(page, json) if declared.has_run else [])]

        def call(**values: Any) -> None:
            if not declared.has_run:
                declared.gather(values)
                return
            # Options of the frame, not of the function: it must not get them.
            output, as_json = values.pop("output", None), values.pop("as_json", False)
            with Frame(output if page_beside_json or not as_json else None, as_json, steps) as run:
                declared.gather(values, run=run)

        return DeclaredCommand(name or function.__name__.replace("_", "-"), params=parameters, callback=call,
                               help=function.__doc__)
    return declare


def _output_options(page: bool, json: bool) -> Iterator[click.Option]:
    if page:
        yield click.Option(["output", "-o", "--output"], default=Path("toolpoint-report"), show_default=True,
                           type=click.Path(path_type=Path), help="Folder (or .html file) of the page.")
    if json:
        yield click.Option(["as_json", "--json"], is_flag=True, help="Print the result as JSON.")


def _replace_option() -> click.Option:
    return click.Option(["--replace"], is_flag=True, is_eager=True, expose_value=False, help="Write over existing files.",
                        callback=lambda ctx, option, value: ctx.meta.update({REPLACE_KEY: value}))


class _Signature:
    """The parameters of a function, or the fields of a record, as parameters of the command line."""

    def __init__(self, owner: Any) -> None:
        hints = get_type_hints(owner, include_extras=True)
        entries = signature(owner).parameters
        self.owner, self.has_run = owner, "run" in entries
        self.kinds = {name: (_Kind.of(hints[name]), entry.default) for name, entry in entries.items() if name != "run"}

    def parameters(self) -> list[click.Parameter]:
        """Return the parameters in the order of the help."""
        return [parameter for name, (kind, default) in self.kinds.items()
                for parameter in (kind.group.parameters() if kind.group else [_parameter(name, kind, default)])]

    def gather(self, values: dict[str, Any], **fixed_values: Any) -> Any:
        """Take the values of the parameters out of all values; return what the function, or the record, makes of them."""
        taken = {name: kind.group.gather(values) if kind.group else values.pop(name) for name, (kind, _) in self.kinds.items()}
        return self.owner(**fixed_values, **taken)


@dataclass
class _Kind:
    """Content of an annotation: the innermost type, the marks around it, whether several values may be given."""

    base: Any
    marks: tuple[Any, ...] = ()
    several: bool = False

    @classmethod
    def of(cls, hint: Any) -> _Kind:
        """Return the content of an annotation."""
        origin, parts = get_origin(hint), get_args(hint)
        # A type with a reader of its own is read by it whole, also where it is a tuple or a union.
        if origin is Annotated and any(isinstance(mark, click.ParamType) for mark in parts[1:]):
            return cls(parts[0], parts[1:])
        if origin is Annotated:
            element = cls.of(parts[0])
            return cls(element.base, (*parts[1:], *element.marks), element.several)
        # `None` stands for an option that was left out; its type is that of the other part.
        if origin in (Union, types.UnionType) and type(None) in parts:
            return cls.of(next(part for part in parts if part is not type(None)))
        if origin is tuple and parts[1:] == (...,):
            element = cls.of(parts[0])
            return cls(element.base, element.marks, True)
        return cls(hint)

    def mark(self, kind: Any) -> Any:
        """Return the outermost mark of a kind, None without."""
        return next((mark for mark in self.marks if isinstance(mark, kind)), None)

    @cached_property
    def group(self) -> Group | None:
        """The group that the annotation names."""
        if is_dataclass(self.base) and self.mark(Help) is None:
            return _Signature(self.base)
        return next((mark for mark in self.marks if hasattr(mark, "gather")), None)

    @property
    def type(self) -> Any:
        """The type of click that reads a value."""
        if (reader := self.mark(click.ParamType)) is not None:
            return reader
        if get_origin(self.base) is Literal:
            return WordChoice(list(get_args(self.base)))
        limits = self.mark(Help)
        if self.base not in (int, float) or not limits or (limits.minimum is limits.above is limits.maximum is None
                                                           and limits.scale == 1):
            return self.base
        if self.base is int:
            return click.IntRange(limits.minimum, limits.maximum)
        # Click knows one lower limit, which is open where the number must be above it.
        number = _Number(limits.minimum if limits.above is None else limits.above, limits.maximum,
                         min_open=limits.above is not None)
        number.scale, number.help = limits.scale, limits.help
        return number


def _parameter(name: str, kind: _Kind, default: Any) -> click.Parameter:
    """Return the argument or option of an annotated parameter."""
    is_required = default is Parameter.empty
    if kind.mark(Argument) is not None:
        # Several arguments that may be left out are empty without a default: click 8.1 refuses one.
        settings_of_default = {} if is_required or kind.several else {"default": default}
        return click.Argument([name], type=kind.type, required=is_required, nargs=-1 if kind.several else 1,
                              **settings_of_default)
    declared: Help = kind.mark(Help)
    if is_required and declared.default:
        is_required, default = False, declared.default
    settings: dict[str, Any] = {"is_flag": True} if kind.base is bool else {"type": kind.type}
    if not is_required:
        has_default_text = kind.base is not bool and default not in (None, "", ())
        settings |= {"default": default, "show_default": declared.default_text or has_default_text}
    option = _DeclaredOption([name, *(declared.name or "--" + name.replace("_", "-")).split()], help=declared.help,
                             metavar=declared.metavar, multiple=kind.several, required=is_required, **settings)
    option.declared = declared
    return option
