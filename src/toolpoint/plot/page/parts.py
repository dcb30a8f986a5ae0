"""Parts of a report: text, notes, listings and pictures, small frozen objects that give their HTML."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass

from toolpoint._check import fail, one_of
from toolpoint.plot.page.markup import mark_up

KINDS = ("assumed", "warning", "note")


@dataclass(frozen=True)
class Text:
    r"""Paragraphs; an empty line starts the next one.

    >>> Text("First.\n\nSecond.").fragment().count("<p")
    2
    """

    text: str

    def fragment(self) -> str:
        """Return the paragraphs as HTML."""
        blocks = [block.strip() for block in re.split(r"\n\s*\n", self.text) if block.strip()]
        return "".join(f"<p>{mark_up(block)}</p>" for block in blocks)


@dataclass(frozen=True)
class Notes:
    """A list of remarks: what was ``assumed``, a ``warning``, or a plain ``note``.

    >>> "is assumed" in Notes(["Damping of 2 % is assumed."]).fragment()
    True
    """

    lines: Sequence[str]
    kind: str = "assumed"
    title: str = ""

    def __post_init__(self) -> None:
        one_of("Notes.kind", self.kind, KINDS)
        # A single string would be taken as a list of its letters.
        lines = (self.lines,) if isinstance(self.lines, str) else self.lines
        object.__setattr__(self, "lines", tuple(str(line) for line in lines))

    def fragment(self) -> str:
        """Return the list in a box; nothing where there are no lines."""
        if not self.lines:
            return ""
        title = self.title or {"assumed": "What was assumed", "warning": "Warnings", "note": "Notes"}[self.kind]
        items = "".join(f"<li>{mark_up(line)}</li>" for line in self.lines)
        role = " role=\"alert\"" if self.kind == "warning" else ""
        return f"<div class=\"notes {self.kind}\"{role}><h3>{html.escape(title)}</h3><ul>{items}</ul></div>"


@dataclass(frozen=True)
class Listing:
    """Text shown as it is (an input file), folded away until asked for.

    >>> "diameter" in Listing("cut.yaml", "cutting: {diameter: 12 mm}").fragment()
    True
    """

    title: str
    text: str

    def fragment(self) -> str:
        """Return the text in a details element."""
        return f"<details><summary>{html.escape(self.title)}</summary><pre>{html.escape(self.text)}</pre></details>"


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture in the page itself: the bytes of a PNG, JPEG, GIF or WebP file, also a moving one.

    >>> 'alt="one black pixel"' in Picture(b"GIF89a", "one black pixel").fragment()
    True
    """

    data: bytes
    alt: str
    caption: str = ""

    KINDS = {b"\x89PNG": "png", b"\xff\xd8\xff": "jpeg", b"GIF8": "gif", b"RIFF": "webp"}

    def fragment(self) -> str:
        """Return the picture as a figure."""
        kind = next((name for start, name in self.KINDS.items() if self.data.startswith(start)), "")
        if not kind:
            fail("Picture.data", "no picture", "must be a PNG, JPEG, GIF or WebP file")
        caption = f"<figcaption>{mark_up(self.caption)}</figcaption>" if self.caption else ""
        source = f"data:image/{kind};base64," + base64.b64encode(self.data).decode()
        return (f'<figure class="tp-figure"><img src="{source}" alt="{html.escape(self.alt)}" '
                f'style="max-width:100%;height:auto">{caption}</figure>')
