"""Files of the workbench's own state: whole at any moment, from any thread, and no drafts of a project's run."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def keep_file(path: Path, text: str) -> None:
    """Write a text file by a part beside it.

    A run that begins removes what ends in ``.draft`` under `.toolpoint`, so that a killed one leaves nothing: these end
    otherwise.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{secrets.token_hex(6)}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
