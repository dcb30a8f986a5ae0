"""Files that a YAML file names and that lie beside it: meshes, matrices, tables that its parts are read from."""

from __future__ import annotations

import re
from pathlib import Path

from toolpoint.io.suffixes import YAML

MAX_TEXT_SIZE = 4_000_000  # bytes of a file that is looked through
# A scalar: in quotes, or plain up to a comma, a bracket or a comment. A name ends with a suffix.
_SCALAR = re.compile(r"""["']([^"'\n]+\.\w+)["']
                         |(?:^|[\s:,\[{-])(?!-\ )([^\s"'\#,:{}\[\]][^"'\#,:{}\[\]\n]*\.\w+)(?=\s*(?:[,\]}\#]|$))""",
                     re.MULTILINE | re.VERBOSE)


def list_named_files(path: Path) -> tuple[str, ...]:
    """Return the files that a YAML file names, as it writes them, in its order; nothing of a file of another kind.

    Any text of the file counts that is the name of a file beside it: no key of a section has to be known, so that a new kind of
    body is no file that is forgotten.
    """
    try:
        if path.suffix.lower() not in YAML or path.stat().st_size > MAX_TEXT_SIZE:
            return ()
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ()  # whoever reads the file says what is wrong with it
    names = dict.fromkeys((quoted or bare).strip() for quoted, bare in _SCALAR.findall(text))
    return tuple(name for name in names if _is_file(path.parent / name))


def _is_file(place: Path) -> bool:
    try:
        return place.is_file()
    except (OSError, ValueError):  # too long, or with signs that no name has
        return False
