"""A page for the errors and doubts of every room: cause and cure by hand, every message from the source."""

from __future__ import annotations

from collections import defaultdict
from functools import cache
from pathlib import Path

from ruamel.yaml import YAML

from generate.sites import ROOT, Site, sites

INTRODUCTION = """# Errors and doubts

toolpoint refuses what is wrong (an **error**: it names the argument or the file and line, the value, the limit and the
remedy, and ends with code 2) and marks what is doubtful (a **doubt** or warning: the result says it first, in table, page and
JSON). Nothing is repaired silently. Below is a page for the messages of every room of the package; … stands for what the
program puts in. Each message stands with what the program says of it; where it says no more than what it saw, the cause
and the cure of the room hold.

```{{toctree}}
:maxdepth: 1

{pages}
```
"""


@cache
def causes() -> dict[str, dict[str, str]]:
    """Return title, cause and cure of every room."""
    text = (ROOT / "docs" / "causes.yaml").read_text(encoding="utf-8")
    table: dict[str, dict[str, str]] = YAML(typ="safe", pure=True).load(text)
    return table


def write_errors(folder: Path) -> None:
    """Write the page of every room and the page that lists them."""
    by_room: dict[str, list[Site]] = defaultdict(list)
    for site in sites():
        by_room[site.room].append(site)
    for room, entry in causes().items():
        (folder / f"errors_{room.strip('_')}.md").write_text(_page(entry, by_room[room]), encoding="utf-8")
    names = "\n".join(f"errors_{room.strip('_')}" for room in causes())
    (folder / "errors.md").write_text(INTRODUCTION.format(pages=names), encoding="utf-8")


def _page(entry: dict[str, str], room: list[Site]) -> str:
    lines = [f"# {entry['title']}", "", f"**Cause.** {entry['cause']}", "", f"**Cure.** {entry['cure']}", ""]
    for title, is_doubt in (("Errors", False), ("Doubts", True)):
        messages = sorted({(site.seen, site.cure, site.module) for site in room if site.is_doubt == is_doubt})
        if messages:
            lines += [f"## {title}", "", "| message | what must be, and what to do | where |", "|---|---|---|"]
            rows = [f"| ``{_code(seen)}`` | {_words(cure) or 'as above'} | {module} |" for seen, cure, module in messages]
            lines += [*rows, ""]
    return "\n".join(lines)


def _code(words: str) -> str:
    return words.replace("``", "'").replace("`", "'").replace("|", "\\|").strip()


def _words(text: str) -> str:
    """Return plain words for a cell of a table: nothing in them is markup."""
    for mark in "\\|*_<>[]$`":
        text = text.replace(mark, "\\" + mark)
    return text
