"""Tables of a page of toolpoint (HTML) as CSV or LaTeX."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.io.door import door, new_files

SPECIAL = {"&": r"\&", "%": r"\%", "#": r"\#", "_": r"\_", "$": r"\$", "{": r"\{", "}": r"\}", "±": r"$\pm$", "µ": r"\textmu{}",
           "°": r"$^\circ$", "²": r"$^2$", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}


@dataclass
class PageTable:
    """A table of a page: the title of its section, its header, and its rows."""

    title: str
    header: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)

    def as_csv(self) -> str:
        """Return the table as comma-separated text."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([self.header, *self.rows])
        return text.getvalue()

    def as_latex(self) -> str:
        """Return the table as a LaTeX tabular with the rules of booktabs."""
        ways = "".join("r" if all(_is_number(row[k]) for row in self.rows if k < len(row)) else "l"
                       for k in range(len(self.header)))
        body = [" & ".join(map(_escaped, row)) + r" \\" for row in self.rows]
        return "\n".join([f"% {self.title}", rf"\begin{{tabular}}{{{ways}}}", r"\toprule",
                          " & ".join(map(_escaped, self.header)) + r" \\", r"\midrule", *body, r"\bottomrule",
                          r"\end{tabular}"]) + "\n"


class _Tables(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tables: list[PageTable] = []
        self._title, self._inside = "", ""
        self._cell: str | None = None
        self._row: list[str] = []

    def handle_starttag(self, tag: str, attributes: object) -> None:
        if tag == "h2":
            self._inside, self._title = "h2", ""
        elif tag == "table":
            self.tables.append(PageTable(" ".join(self._title.split())))
        elif tag == "tr":
            self._row = []
        elif tag in ("td", "th"):
            self._cell = ""

    def handle_data(self, data: str) -> None:
        if self._inside == "h2":
            self._title += data
        elif self._cell is not None:
            self._cell += data

    def handle_endtag(self, tag: str) -> None:
        if tag == "h2":
            self._inside = ""
        elif tag in ("td", "th") and self._cell is not None:
            self._row.append(" ".join(self._cell.split()))
            self._cell = None
        elif tag == "tr" and self.tables and self._row:
            table = self.tables[-1]
            if table.header:
                table.rows.append(self._row)
            else:
                table.header = self._row


@door("page")
def read_tables(path: str | Path) -> list[PageTable]:
    """Return the tables of a page (an HTML file, or its folder)."""
    path = Path(path) / "index.html" if Path(path).is_dir() else Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    parser = _Tables()
    parser.feed(re.sub(r"<script.*?</script>|<style.*?</style>", "", text, flags=re.DOTALL))
    return [table for table in parser.tables if table.rows]


def write_tables(page: str | Path, folder: str | Path, kind: str) -> list[Path]:
    r"""Write every table of a page to a folder as ``csv`` or ``tex``, named by its section; return the files.

    Raises ToolpointError where the page has no table, or a file is there already: then nothing is written.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = Path(folder, "index.html")
    ...     _ = page.write_text("<h2>Modes</h2><table><tr><th>Hz</th></tr><tr><td>80.5</td></tr></table>")
    ...     write_tables(page, folder, "csv")[0].read_text()
    'Hz\n80.5\n'
    """
    tables, folder = read_tables(page), Path(folder)
    if not tables:
        raise ToolpointError(f"{page}: has no table")
    names: list[str] = []
    for table in tables:
        stem = re.sub(r"[^a-z0-9]+", "_", table.title.lower()).strip("_") or "table"
        same_stem_count = sum(name == stem or name.startswith(f"{stem}__") for name in names)
        names.append(stem if same_stem_count == 0 else f"{stem}__{same_stem_count + 1}")
    files = new_files(folder, names, kind)
    for table, file in zip(tables, files, strict=True):
        file.write_text(table.as_csv() if kind == "csv" else table.as_latex(), encoding="utf-8")
    return files


def _escaped(text: str) -> str:
    return "".join(SPECIAL.get(letter, letter) for letter in text)


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[-+−]?[\d.,]+(e[-+]?\d+)?|", text.strip()) is not None
