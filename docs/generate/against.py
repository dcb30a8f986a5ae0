"""The page "Against other programs": the rows of the bars in which another program ran beside toolpoint."""

from __future__ import annotations

import re
from pathlib import Path

from generate.sites import ROOT

PROGRAMS = ("sdypy", "pyFBS", "SDynPy", "pyidi", "OpenCV", "pathsim", "motulator", "RK45", "DOP853", "ruckig", "CHOLMOD",
            "SuperLU", "FMPy", "MuJoCo", "Exudyn", "Pinocchio", "pyuff", "semi-discretization", "vendor")
INTRODUCTION = """# Against other programs

Where another program can do a part of the chain, it ran beside toolpoint, on the same machine, in the same run; where a
vendor or a paper printed digits, these were met. The rows are those of the [bars](../bars.md), with the command that prints
each figure; *falls short* says what is not reached. No commercial program was at hand: none of their figures are claimed here.

| room | what | target | command | measured | falls short |
|---|---|---|---|---|---|
"""


def write_against(folder: Path) -> None:
    """Write the page from docs/bars.md."""
    named, heading, rows = re.compile("|".join(PROGRAMS), re.IGNORECASE), "", []
    for line in (ROOT / "docs" / "bars.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            heading = line[3:]
        elif line.startswith("| ") and not line.startswith("| what") and named.search(line):
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))][:5]
            rows.append(f"| {heading} | " + " | ".join([*cells, *[""] * (5 - len(cells))]) + " |")
    (folder / "against.md").write_text(INTRODUCTION + "\n".join(rows) + "\n", encoding="utf-8")
