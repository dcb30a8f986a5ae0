"""Tutorials as programs: the blocks ``python`` and ``sh`` of a page, run one after the other as a person types them.

A block begins in the folder in which the block before it ended.

    python docs/generate/tutorials.py docs/tutorials/*.md
"""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks_of(page: Path) -> list[tuple[str, str]]:
    """Return language and text of every block that is run."""
    return [(match[1], match[2]) for match in BLOCK.finditer(page.read_text(encoding="utf-8"))]


@contextlib.contextmanager
def _activated_environment() -> Iterator[None]:
    """The search path of a person who has activated the environment: its commands come first, in the shell and in Python."""
    before = os.environ.get("PATH", "")
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{before}"
    try:
        yield
    finally:
        os.environ["PATH"] = before


def run_tutorial(page: Path, after_block: Callable[[int, Path], None] = lambda count, folder: None) -> int:
    """Run the blocks of a page in a folder of its own and return how many there were; whatever fails is raised.

    after_block : called with the number of blocks that have run, and the folder of all that they wrote.
    """
    names: dict[str, Any] = {"__name__": "tutorial"}
    blocks = blocks_of(page)
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch), _activated_environment():
        folder, place_file = Path(scratch, "empty").resolve(), Path(scratch, "place").resolve()
        folder.mkdir()
        os.chdir(folder)
        for count, (language, text) in enumerate(blocks, start=1):
            if language == "python":
                exec(compile(text, f"{page.name}", "exec"), names)
            else:
                subprocess.run(["bash", "-euc", f'{text}\npwd > "$PLACE_FILE"'], check=True,
                               env={**os.environ, "PLACE_FILE": str(place_file)})
                os.chdir(place_file.read_text(encoding="utf-8").rstrip("\n"))
            after_block(count, folder)
    return len(blocks)


def main() -> None:
    """Run the tutorials that are named."""
    for name in sys.argv[1:]:
        start, page = time.process_time(), Path(name).resolve()
        count = run_tutorial(page)
        print(f"{page.name}: {count} blocks, {time.process_time() - start:.1f} s and its commands")


if __name__ == "__main__":
    main()
