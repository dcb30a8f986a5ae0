"""Options that say what files of responses hold: labels by the names of files, variables by their names."""

from __future__ import annotations

from functools import wraps
from typing import Any

import click

from toolpoint._check import ToolpointError


def pairs_of(option: str, text: str | None) -> dict[str, str]:
    """Return the pairs of a text such as ``frequency=f,values=H``."""
    pairs = [part.partition("=") for part in (text or "").split(",") if part.strip()]
    if any(not equals or not name.strip() or not value.strip() for name, equals, value in pairs):
        raise ToolpointError(f"{option} {text}: write NAME=VARIABLE, several parted by commas, for example "
                             "frequency=f,values=H")
    return {name.strip(): value.strip() for name, _, value in pairs}


def naming_options(command: Any) -> Any:
    """Add --name, --struck and --variables; the command receives them as `naming`, keywords of `frf_files.read`."""
    @wraps(command)
    def gathered(name: str | None, struck: str | None, variables: str | None, **values: Any) -> Any:
        naming = {"pattern": name, "struck": struck, "variables": pairs_of("--variables", variables)}
        return command(naming={key: value for key, value in naming.items() if value}, **values)

    for option in reversed((
            click.option("--name", metavar="PATTERN", help="Where names of text files say what was measured and struck: "
                                                           "Point_{output}_*, or P{input}_at_{output}."),
            click.option("--struck", metavar="POINT:DIRECTION", help="With --name: the side (struck or measured) that names of "
                                                                     "files do not say."),
            click.option("--variables", metavar="frequency=f,values=H",
                         help="Variables of MATLAB and NumPy files that hold lines (Hz) and responses."))):
        gathered = option(gathered)
    return gathered
