"""Text that a notebook shows of a noun or a result: its table, or its repr where it has none, as HTML that runs nothing."""

from __future__ import annotations

import html

_RULES = "┏┡└"  # first characters of lines that only rule a table of `text_table`


class NotebookText:
    """Base of nouns and results that a notebook shows by their own words."""

    def _repr_html_(self) -> str:
        """Return the table of the object, or its repr, as HTML."""
        table = getattr(self, "table", None)
        return _html(table() if callable(table) else repr(self))


def _html(text: str) -> str:
    """Return lines as HTML: ruled tables as tables, everything else as it stands."""
    parts: list[str] = []
    text_lines: list[str] = []
    rows: list[list[str]] = []
    for line in [*text.split("\n"), ""]:
        if line[:1] in tuple("┃│"):
            cells = [cell.strip() for cell in line.strip("┃│").split(line[0])]
            if rows and len(rows) > 1 and not cells[0] and line[0] == "│":  # a cell that goes on in the next line
                rows[-1] = [f"{old} {new}".strip() for old, new in zip(rows[-1], cells, strict=True)]
            else:
                rows.append(cells)
        elif not line[:1] or line[0] not in _RULES:
            parts += _flushed(text_lines, rows) if rows else []
            if rows:
                text_lines, rows = [], []
            text_lines.append(line)
    return "".join([*parts, *_flushed(text_lines, rows)])


def _flushed(text_lines: list[str], rows: list[list[str]]) -> list[str]:
    """Return the lines before a table and the table."""
    words = "\n".join(text_lines).strip("\n")
    preformatted = [f"<pre style=\"white-space:pre-wrap\">{html.escape(words)}</pre>"] if words else []
    if not rows:
        return preformatted
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in rows[0])
    body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows[1:])
    return [*preformatted, f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"]
