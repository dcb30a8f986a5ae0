"""Bars: the figures that were promised, what was last measured of each, and where it falls short.

    python benchmarks/bars.py [AREA] [--all]    rows of an area (part of its name) that fall short; with --all every row
    python benchmarks/bars.py AREA --run        run the commands of an area, each once, and print their last lines
    python benchmarks/bars.py --write           write docs/bars.md from docs/bars.yaml, which is where rows are changed

A row has a figure, its target, the command whose last line shows it, what was measured and when; a note on the command and a
shortfall where there is one. A command that holds a word in capitals (OTHER_CHECKOUT) is printed, not run.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[1]
DATA, PAGE = ROOT / "docs" / "bars.yaml", ROOT / "docs" / "bars.md"
KEYS = ("figure", "target", "command", "note", "measured", "date", "shortfall")
NEEDED = ("figure", "target", "measured", "date")
TITLE = "# Bars: the figures that were promised, and what was last measured"
WRITTEN_BY = "<!-- Written by `python benchmarks/bars.py --write` from docs/bars.yaml; change the rows there. -->"


@dataclass(frozen=True)
class Row:
    """A figure of an area."""

    area: str
    figure: str
    target: str
    measured: str
    date: str
    command: str = ""
    note: str = ""
    shortfall: str = ""

    @property
    def can_run(self) -> bool:
        """Whether the command is whole: no word in capitals stands for something of the reader's."""
        return bool(self.command) and not any(re.fullmatch(r"[A-Z][A-Z_]+", word) for word in shlex.split(self.command))

    def cells(self) -> list[str]:
        """Return the cells of the page's table."""
        how = f"`{self.command}`" if self.command else ""
        if self.note:
            how = f"{how} ({self.note})" if how else self.note
        return [self.figure, self.target, how, f"{self.measured} ({self.date})", self.shortfall]


def read_areas(path: Path = DATA) -> dict[str, Any]:
    """Return the file as plain data; a row with a key that no row has, or without one that all have, is an error."""
    data: dict[str, Any] = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    for area in data["areas"]:
        for part in area["parts"]:
            for row in part["rows"]:
                wrong = [key for key in row if key not in KEYS] + [f"no {key}" for key in NEEDED if not row.get(key)]
                if wrong:
                    raise SystemExit(f"{path.name}: row {row.get('figure', '?')!r}: {', '.join(wrong)}; keys are "
                                     f"{', '.join(KEYS)}")
    return data


def rows(data: dict[str, Any], area: str = "") -> Iterator[Row]:
    """Yield the rows of the areas whose name holds a word."""
    for group in data["areas"]:
        if area.lower() in group["area"].lower():
            for part in group["parts"]:
                yield from (Row(group["area"], **{key: str(value) for key, value in row.items()}) for row in part["rows"])


def page(data: dict[str, Any]) -> str:
    """Return the page: a table for every part of every area."""
    blocks = [TITLE, WRITTEN_BY, data["about"]]
    for group in data["areas"]:
        blocks.append(f"## {group['area']}")
        for part in group["parts"]:
            if part.get("about"):
                blocks.append(part["about"])
            head = ["what", "target", "command", part.get("heading", "measured"), "falls short"]
            lines = [head, ["---"] * len(head)]
            lines += [Row(group["area"], **{key: str(value) for key, value in row.items()}).cells() for row in part["rows"]]
            blocks.append("\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |" for cells in lines))
    return "\n\n".join(blocks) + "\n"


def run(row: Row, seconds: float) -> str:
    """Return the last line that a row's command prints, or how it ended."""
    try:
        done = subprocess.run(row.command, shell=True, cwd=ROOT, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return f"not ended after {seconds:.0f} s"
    lines = (done.stdout.strip() or done.stderr.strip() or "printed nothing").splitlines()
    last = lines[-1]
    return last if done.returncode == 0 else f"ended with code {done.returncode}: {last}"


def main() -> None:
    """Print, run or write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("area", nargs="?", default="", help="part of an area's name")
    parser.add_argument("--all", action="store_true", help="rows that are met, too")
    parser.add_argument("--run", action="store_true", help="run the commands")
    parser.add_argument("--seconds", type=float, default=3600.0, help="a command may take")
    parser.add_argument("--write", action="store_true", help="write docs/bars.md")
    options = parser.parse_args()
    data = read_areas()
    if options.write:
        PAGE.write_text(page(data), encoding="utf-8")
        return
    chosen = list(rows(data, options.area))
    printed: dict[str, str] = {}
    for row in chosen:
        if options.run and row.can_run and row.command not in printed:
            printed[row.command] = run(row, options.seconds)
        if options.run or options.all or row.shortfall:
            print(f"{row.area}: {row.figure}", f"target    {row.target}", f"measured  {row.measured} ({row.date})",
                  *([f"short     {row.shortfall}"] if row.shortfall else []), f"command   {row.command or 'none'}",
                  sep="\n    ")
            if row.command in printed:
                print(f"    now       {printed[row.command]}", flush=True)
    short = sum(bool(row.shortfall) for row in chosen)
    print(f"{len(chosen)} rows, {short} with a shortfall, {sum(not row.command for row in chosen)} without a command")


if __name__ == "__main__":
    main()
