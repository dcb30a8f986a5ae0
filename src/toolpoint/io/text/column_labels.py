"""Labels in the names of columns, ``real tool:+x / 7:-z [m/N]``: written and read by one rule.

What would end a name or a pair of them (blanks, commas, quotes, brackets, slashes) is written as in addresses, ``%20``.
"""

from __future__ import annotations

import re
from urllib.parse import quote, unquote

from toolpoint._check import ToolpointError
from toolpoint.vibration import Dof

_SPECIAL = re.compile(r"[\s,;\"'%()\[\]{}/<>#|\x00-\x1f]")
# Response and force around a slash, each a label with its direction; off the axes a vector, escaped as in addresses.
_PAIR = re.compile(r"(\S+:(?:[-+]?r?[xyz]|\S+%3C\S+%3E))\s*/\s*(\S+:(?:[-+]?r?[xyz]|\S+%3C\S+%3E))", re.IGNORECASE)


def column_label(dof: Dof) -> str:
    """Return a label as one word of a column's name."""
    return _SPECIAL.sub(lambda mark: quote(mark[0], safe=""), dof.text)


def column_pair(name: str) -> tuple[Dof, Dof] | None:
    """Return the labels of response and force that a column's name holds, None where it holds no pair of them."""
    pair = _PAIR.search(name)
    if pair is None:
        return None
    try:
        return Dof.parse(unquote(pair[1])), Dof.parse(unquote(pair[2]))
    except ToolpointError:  # words that only look like labels
        return None


def without_pair(name: str) -> str:
    """Return a column's name without its pair of labels, whose points may be called like parts of a response."""
    return _PAIR.sub("", name)
