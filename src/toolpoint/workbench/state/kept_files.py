"""Files of the workbench's own state, written so that a reader never sees a half of one."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def keep_file(path: Path, text: str) -> None:
    """Write a text file to a temporary name beside it, then rename it, so that it is whole at any moment.

    The temporary name ends in ``.part``. A run that begins removes everything that ends in ``.draft``, which would take a
    file away while it is written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{secrets.token_hex(6)}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
