"""Step of a project: a plain function with named inputs and options, and its outcome."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from toolpoint._check import fail
from toolpoint._doubt import Doubt

OPTION_DIGITS = 12  # significant digits of numbers in options: 10 mm and 0.01 m are one number after conversion


@dataclass(frozen=True)
class StepOutcome:
    """Outcome of a step: its answer in a sentence, and the doubts about it. The files are in the folder that it was given."""

    words: str = ""
    doubts: tuple[Doubt, ...] = ()


@dataclass(frozen=True)
class LateWork:
    """A module-level function by the names of its module and itself, loaded when a step runs: a look at steps loads none."""

    module: str
    name: str

    def __call__(self, **arguments: Any) -> StepOutcome:
        """Call the function."""
        outcome: StepOutcome = getattr(importlib.import_module(self.module), self.name)(**arguments)
        return outcome


@dataclass(frozen=True)
class ProjectStep:
    """Step of a project.

    Parameters
    ----------
    name : str
        Also the name of its folder of results; slashes make folders in folders.
    work : function
        Module-level function (or `LateWork`), called with the inputs and options by name and `folder`, where it writes its
        outputs.
    inputs : mapping of names to paths
        Files of the user or outputs of other steps, relative to the project; several of one input as a tuple.
    named_files : paths
        Files that inputs name in turn, relative to the project: part of the key, no argument of the work.
    options : mapping of names to plain data
        SI; numbers are rounded to 12 digits before the key is made and the work is called.
    outputs : names of files that the work writes
        Another step names them as inputs by ``results/NAME/FILE``.
    version : int
        Version of what the work computes: raised where results change, so that a release runs nothing again by itself.
    words : str
        What the step does.
    command : str
        Command that shows the same by itself, with its own page.
    """

    name: str
    work: Callable[..., StepOutcome]
    inputs: Mapping[str, str | tuple[str, ...]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()
    version: int = 1
    words: str = ""
    command: str = ""
    named_files: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """Folder of the results, relative to the project."""
        return result_path(self.name)

    @property
    def output_paths(self) -> tuple[str, ...]:
        """Outputs, relative to the project."""
        return tuple(result_path(self.name, output) for output in self.outputs)

    @property
    def input_paths(self) -> tuple[str, ...]:
        """All inputs and what they name, relative to the project, each once."""
        paths = [path for entry in self.inputs.values() for path in ((entry,) if isinstance(entry, str) else entry)]
        return tuple(dict.fromkeys([*paths, *self.named_files]))

    def arguments(self, root: Path) -> dict[str, Any]:
        """Return what the work is called with, but for its folder: paths of inputs, options."""
        paths = {name: root / entry if isinstance(entry, str) else tuple(root / path for path in entry)
                 for name, entry in self.inputs.items()}
        return {**paths, **normalise_options(self.options)}


def result_path(step: str, file: str = "") -> str:
    """Return the place of a step's results, or of one file of them, relative to the project."""
    return str(PurePosixPath("results", step, file))


def normalise_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options as plain data whose numbers have 12 significant digits: what the key and the work both see."""
    return {name: _normalise(name, value) for name, value in options.items()}


def _normalise(name: str, value: Any) -> Any:
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        return float(f"{value:.{OPTION_DIGITS}g}")
    if isinstance(value, np.ndarray):
        return _normalise(name, value.tolist())
    if isinstance(value, Mapping):
        return {str(key): _normalise(f"{name}.{key}", entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_normalise(name, entry) for entry in value]
    fail(f"option {name}", repr(value), "must be plain data: numbers, texts, lists, mappings")
