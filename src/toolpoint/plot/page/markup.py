"""Text of a page: escaped, with the letters of the field set as a book sets them (K_t with a subscript)."""

from __future__ import annotations

import html
import re

# Letters of forces, coefficients, gains and torques; other words with an underscore are names that a user gave.
_SYMBOL = re.compile(r"(?<![\w.])(K|F|M|R|T|J|n|w|g|f)_(max|min|te|ne|ae|tc|nc|ac|[tnafvhrmscxyz]|\d)(?!\w)")


def mark_up(text: object) -> str:
    """Return text as HTML: escaped, letters with their subscripts."""
    return _SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(str(text)))
