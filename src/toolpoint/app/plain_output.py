"""Output where the terminal or the pipe takes few signs (an ASCII or POSIX locale): spelled plainly, never an error."""

from __future__ import annotations

import codecs
import sys

# What each character becomes where the output cannot hold it, so that units stay units.
PLAIN_SPELLINGS = {"µ": "u", "μ": "u", "°": " deg", "±": "+-", "²": "^2", "³": "^3", "×": "x", "·": "*", "…": "...", "–": "-",
                   "—": "-",
                   "−": "-", "≤": "<=", "≥": ">=", "Ω": "Ohm", "ζ": "zeta", "η": "eta", "ω": "omega", "φ": "phi", "θ": "theta",
                   "→": "->", "│": "|", "┃": "|", "─": "-", "━": "-", "ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"}
SPELLING_HANDLER = "toolpoint.spelled"


def spell_plainly() -> None:
    """Let standard output and errors spell what their encoding does not have."""
    codecs.register_error(SPELLING_HANDLER, _spell)
    for stream in (sys.stdout, sys.stderr):
        encoding = getattr(stream, "encoding", None)
        if encoding and "utf" not in encoding.lower() and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=SPELLING_HANDLER)


def _spell(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(PLAIN_SPELLINGS.get(sign, "?") for sign in error.object[error.start:error.end]), error.end
