"""The pages "The five sources": every numbered table and figure and every conclusion of each, with our numbers beside theirs.

Rows are data (`docs/sources/NAME.yaml`); numbers are those that the examples of the source computed, kept in
`docs/sources/numbers.yaml` by `python benchmarks/house/source_pages.py --write`. A row names numbers in braces:
``{first_hz:.2f} Hz``, and what follows from them behind a sign of equality: ``{=100 * (first_hz / 29 - 1):+.1f} %``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from generate.sites import ROOT

FOLDER = ROOT / "docs" / "sources"
NAMES = ("vertical_machining_centre", "vibration_thesis", "parallel_head", "video_mill", "milling_robot")
# What a row may be; each with the words of the count at the end of a page.
STATES = {"reproduced": "reproduced", "partly": "partly", "not reproduced": "not reproduced", "not published": "not published",
          "nothing to compute": "a drawing, photograph or explanation: nothing to compute"}
FIELDS = ("item", "shows", "theirs", "ours", "difference", "rests", "how", "state", "reason")
HEADING = ("what it shows, and how it stands", "theirs", "ours, and the difference",
           "what it rests on, and for how many values drawn; what is missing")


@dataclass(frozen=True)
class SourceRow:
    """A row: the items that it stands for, and its cells with numbers put in."""

    items: tuple[str, ...]
    cells: dict[str, str]

    @property
    def state(self) -> str:
        """One of `STATES`."""
        return self.cells["state"]


@cache
def numbers() -> dict[str, dict[str, float]]:
    """Return the kept numbers of every source."""
    table: dict[str, dict[str, float]] = _read(FOLDER / "numbers.yaml")
    return table


def examples_of(name: str) -> list[Path]:
    """Return the examples that compute the numbers of a source."""
    return sorted((ROOT / "examples").glob(f"source_{name}*.py"))


@cache
def read_source(name: str) -> dict[str, Any]:
    """Return a source's file: title, numbered (kind to numbers), example, demo and sections of rows."""
    return _read(FOLDER / f"{name}.yaml")


def rows(name: str) -> Iterator[tuple[str, SourceRow]]:
    """Yield every row of a source with the title of its section, numbers put in."""
    for section in read_source(name)["sections"]:
        for row in section["rows"]:
            cells = {key: _filled(str(row.get(key, "")), numbers().get(name, {})) for key in FIELDS}
            yield section["title"], SourceRow(tuple(expand(row["item"])), cells)


def _filled(text: str, kept: dict[str, float]) -> str:
    """Return a cell with its numbers, and with what follows from them, put in."""
    computed = re.sub(r"\{=([^:{}]+):([^{}]+)\}", lambda match: format(_value(match[1], kept), match[2]), text)
    return computed.format(**kept)


def _value(expression: str, kept: dict[str, float]) -> float:
    """Return the value of sums, products and quotients of kept numbers; nothing else can be written."""
    if not re.fullmatch(r"[\w .+*/()-]+", expression):
        raise ValueError(f"{expression!r} is no arithmetic of kept numbers")
    return float(eval(expression, {"__builtins__": {}}, dict(kept)))


def expand(item: str) -> list[str]:
    """Return the items that words stand for: ``Figures 6.12-6.19, 7.1`` is nine figures; other words are one item."""
    match = re.fullmatch(r"(Table|Figure)s? ([\d., -]+)", item)
    if match is None:
        return [item]
    result = []
    for part in match[2].replace(" ", "").split(","):
        first, _, last = part.partition("-")
        chapter, dot, start = first.rpartition(".")
        end = last.rpartition(".")[2] if last else start
        result += [f"{match[1]} {chapter}{dot}{k}" for k in range(int(start), int(end) + 1)]
    return result


def counts(name: str) -> Counter[str]:
    """Return how many items of a source are in each state."""
    total: Counter[str] = Counter()
    for _, row in rows(name):
        total[row.state] += len(row.items)
    return total


def count_words(name: str) -> str:
    """Return the counts of a source in words."""
    total = counts(name)
    return (f"{sum(total.values())} numbered tables and figures, conclusions and systems: "
            + "; ".join(f"{total[state]} {words}" for state, words in STATES.items()))


def write_sources(folder: Path) -> None:
    """Write the tables of every source and the table of counts, to be included in the pages."""
    lines = ["| source | " + " | ".join(STATES) + " |", "|---" * (len(STATES) + 1) + "|"]
    for name in NAMES:
        (folder / f"source_{name}.md").write_text(_tables(name), encoding="utf-8")
        total = counts(name)
        lines.append(f"| [{read_source(name)['title']}]({name}.md) | " + " | ".join(str(total[s]) for s in STATES) + " |")
    (folder / "source_counts.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _tables(name: str) -> str:
    lines, title = [], ""
    for section, row in rows(name):
        if section != title:
            title = section
            lines += ["", f"## {title}", "", "| " + " | ".join(HEADING) + " |", "|---" * len(HEADING) + "|"]
        lines.append("| " + " | ".join(_cell(cell) for cell in _page_cells(row)) + " |")
    return "\n".join([*lines, "", "## Count", "", count_words(name) + ".", ""])


def _page_cells(row: SourceRow) -> list[str]:
    """Return four cells of a page: seven would be too narrow to read."""
    cells = row.cells
    ours = cells["ours"] + (f" ({cells['how']})" if cells["how"] else "")
    difference = f"<br>*difference*: {cells['difference']}" if cells["difference"] else ""
    grounds = [cells["rests"], f"*{row.state}*: {cells['reason']}" if cells["reason"] else ""]
    return [f"**{row_words(row)}**: {cells['shows']}<br>**{row.state}**", cells["theirs"], ours + difference,
            "<br>".join(filter(None, grounds))]


def row_words(row: SourceRow) -> str:
    """Return the items of a row in words, with their number where they are several."""
    return row.cells["item"] + (f" ({len(row.items)})" if len(row.items) > 1 else "")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _read(path: Path) -> Any:
    return YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
