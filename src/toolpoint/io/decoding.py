"""The text of a file, whatever its encoding: UTF-8, UTF-16 as spreadsheets and measuring programs write it, or neither."""

from __future__ import annotations

import codecs
from pathlib import Path

from toolpoint._check import ToolpointError

_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def decode(raw: bytes) -> str:
    """Return bytes as text; signs that are no UTF-8 (units of older programs) become the replacement sign."""
    return raw.decode("utf-16" if raw.startswith(_UTF16_MARKS) else "utf-8-sig", errors="replace")


def read_text(path: Path, expected: str) -> str:
    """Return the text of a file; raises ToolpointError where it cannot be read or is binary: `expected` says what it should
    be."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    if b"\0" in raw[:4096] and not raw.startswith(_UTF16_MARKS):
        raise ToolpointError(f"{path}: a binary file of a kind that is not known; {expected}")
    return decode(raw)
