"""Text of a page as a book sets it: units and signs spelled one way (µm, °, ±, mm²), letters with subscripts (K_t)."""

from __future__ import annotations

import html
import re

from toolpoint._rounding import SUPERSCRIPT, plain_numbers

# 1e-06 becomes a power of ten; names such as 1e3x and hexadecimal words stay.
_POWER_OF_TEN = re.compile(r"(?<=\d)e([+-]\d\d)(?![\w.]\w)")
# Letters of forces, coefficients, gains and torques; other words with an underscore are names that a user gave.
_SYMBOL = re.compile(r"(?<![\w.])(K|F|M|R|T|J|n|w|g|f)_(max|min|te|ne|ae|tc|nc|ac|[tnafvhrmscxyz]|\d)(?!\w)")
_CODE = re.compile(r"`([^`<>\n]+)`")  # names of arguments and keys, as messages write them
# A unit stands after a number, a comma, a stroke, a bar or a bracket: a body called "um" keeps its name.
_UNIT_CONTEXT = r"(?:(?<=\d)|(?<=\d )|(?<=, )|(?<=/)|(?<=\|)|(?<=\()|(?<=\| ))"
_UNITS = (
    (re.compile(_UNIT_CONTEXT + r"um(?![\w.])"), "µm"), (re.compile(_UNIT_CONTEXT + r"urad(?![\w.])"), "µrad"),
    (re.compile(r"(?<=position )um|(?<=rms )um"), "µm"), (re.compile(_UNIT_CONTEXT + r"us(?![\w.])"), "µs"),
    (re.compile(r"(?<=\d) ?deg(?![\w.])"), "°"), (re.compile(r"(?<=, )deg(?![\w.])|(?<=\()deg(?=[/)])"), "°"),
    (re.compile(r"\+-(?=[ \d])"), "±"), (re.compile(r"(?<=[A-Za-z])\^2(?!\d)"), "²"),
    (re.compile(r"(?<=[A-Za-z])\^3(?!\d)"), "³"), (re.compile(r"(?<=\d) \.\. (?=[-−+\d])"), " … "))


def typeset(text: object) -> str:
    """Return text with units and signs spelled one way."""
    words = _POWER_OF_TEN.sub(lambda match: f"×10{str(int(match[1])).translate(SUPERSCRIPT)}", plain_numbers(str(text)))
    for pattern, sign in _UNITS:
        words = pattern.sub(sign, words)
    return words


def mark_up(text: object) -> str:
    """Return text as HTML: typeset, escaped, letters with their subscripts, names of arguments as code."""
    return _CODE.sub(r"<code>\1</code>", _SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(typeset(text))))
