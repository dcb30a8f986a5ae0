"""Lines of a program as statements: blocks of words, jumps, branches, loops and subprograms of three families of controls.

Fanuc: GOTO n, IF [..] GOTO n, IF [..] THEN, WHILE [..] DO m .. END m, O and M98/M99. Siemens: IF .. GOTOF, IF/ELSE/ENDIF,
WHILE, FOR, REPEAT/UNTIL, LOOP, labels, PROC. LinuxCNC: o-words (sub, call, if, while, do, repeat, return).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from toolpoint.io.program.language.words import without_comments

# Line numbers as N10 or, in Klartext, as bare numbers; a slash before them skips the block only where the switch is on.
_NUMBERED = re.compile(r"[/\s]*(?:N(\d+)|(\d+)(?=\s))?\s*(.*)", re.DOTALL)
# Siemens labels end in a colon; := behind a name is an assignment of other dialects.
_LABEL = re.compile(r"([A-Z_][A-Z_0-9]+):(?!=)\s*(.*)", re.DOTALL)
_OWORD = re.compile(r"O\s*(\d+|<[^>]*>)\s*(SUB|ENDSUB|CALL|RETURN|IF|ELSEIF|ELSE|ENDIF|WHILE|ENDWHILE|DO|REPEAT|ENDREPEAT|"
                    r"BREAK|CONTINUE)\b\s*(.*)", re.DOTALL)
_PATTERNS: tuple[tuple[str, re.Pattern[str]], ...] = tuple((name, re.compile(pattern, re.DOTALL)) for name, pattern in (
    ("if_goto", r"IF\s*(?P<a>.+?)\s*GOTO(?P<c>[FBC]?)\s*(?P<b>\w+)\s*$"),
    ("if_then", r"IF\s*(?P<a>.+?)\s*THEN\s*(?P<b>.+)$"),
    ("goto", r"GOTO(?P<c>[FBC]?)\s*(?P<b>\w+|#\S+|\[.*\])\s*$"),
    ("while", r"WHILE\s*(?P<a>.+?)\s*DO\s*\d+\s*$"), ("while", r"WHILE\b\s*(?P<a>.+)$"),
    ("endwhile", r"END\s*\d+\s*$"), ("endwhile", r"ENDWHILE$"),
    ("for", r"FOR\s+(?P<a>[^=]+)=(?P<b>.+?)\s+TO\s+(?P<c>.+)$"), ("endfor", r"ENDFOR$"),
    ("until", r"UNTIL\b\s*(?P<a>.+)$"), ("do", r"REPEAT$"), ("loop", r"LOOP$"), ("endloop", r"ENDLOOP$"),
    ("if", r"IF\b\s*(?P<a>.+)$"), ("else", r"ELSE$"), ("endif", r"ENDIF$"),
    ("return", r"RET\b.*$"), ("m17", r"M17\b.*$"), ("sub", r"PROC\s+(?P<b>\w+).*$"),
    ("define", r"DEF\s+(?:REAL|INT|BOOL|CHAR)\s+(?P<a>.+)$"),
    ("passed", r"(?P<b>MSG|EXTERN|WORKPIECE|DEF|STOPRE|SOFT|BRISK|DRIVE|FFWON|FFWOF|COMPOF|COMPON|COMPCAD|COMPCURV|DIAMOF|CFC|"
               r"CFTCP|CFIN|G_?GROUP|CUT2D|CUT3DC|ORI\w+|FIFOCTRL|SPOS|WRITE|SETMS|STARTFIFO|PRESETON)\b(?!\s*=).*$")))
_END_OF_BLOCK = {"if": "endif", "while": "endwhile", "for": "endfor", "do": "until", "loop": "endloop", "repeat": "endrepeat",
          "sub": "endsub"}


@dataclass
class Statement:
    """One line: its number, what it is, texts, and where it continues."""

    number: int
    kind: str
    text: str = ""
    other: str = ""
    third: str = ""
    key: str = ""
    column: int = 0
    branch: int = -1
    start: int = -1
    file: str = ""  # of a subprogram that stands beside the program


@dataclass
class ProgramLines:
    """Statements of a program with the places of its numbers, labels and subprograms."""

    statements: list[Statement] = field(default_factory=list)
    places: dict[str, list[int]] = field(default_factory=dict)
    programs: dict[str, int] = field(default_factory=dict)
    faults: list[tuple[int, str]] = field(default_factory=list)

    def append_file(self, name: str, file: str, text: str) -> None:
        """Append the statements of a file as the subprogram of a name; it returns where it ends."""
        other, base = list_statements(text), len(self.statements) + 1
        self.statements.append(Statement(0, "end", file=file))
        for s in other.statements:
            s.file = file
            s.branch, s.start = (place + base if place >= 0 else place for place in (s.branch, s.start))
        self.statements += [*other.statements, Statement(0, "return", file=file)]
        for label, places in other.places.items():
            self.places.setdefault(label, []).extend(place + base for place in places)
        self.programs = {key: place + base for key, place in other.programs.items()} | self.programs
        self.programs.setdefault(name, base - 1)
        self.faults += [(0, f"{message}, in line {number} of {file}") for number, message in other.faults]


def list_statements(text: str) -> ProgramLines:
    """Return the statements of a program's text."""
    listing = ProgramLines()
    for number, line in enumerate(text.splitlines(), 1):
        _take(listing, number, line)
    _match_blocks(listing)
    return listing


def _take(listing: ProgramLines, number: int, line: str) -> None:
    if line.lstrip().startswith(("%", "/")) and not line.lstrip().startswith("%_N"):
        return
    code = without_comments(line)
    if name := re.match(r"\s*%_N_(\w+?)_(?:MPF|SPF)", code):
        listing.programs[name[1]] = len(listing.statements)
        if listing.statements:
            listing.statements.append(Statement(number, "end"))
        return
    match = _NUMBERED.match(code)
    if match is None:
        return
    if match[1] or match[2]:
        listing.places.setdefault(str(int(match[1] or match[2])), []).append(len(listing.statements))
    body, column = match[3], match.start(3)
    if label := _LABEL.match(body):
        listing.places.setdefault(label[1], []).append(len(listing.statements))
        column += label.start(2)
        body = label[2]
    if body.strip():
        listing.statements.append(_statement(listing, number, body.strip(), column))


def _statement(listing: ProgramLines, number: int, body: str, column: int) -> Statement:
    if word := _OWORD.match(body):
        kind = word[2].lower()
        return Statement(number, {"elseif": "elif"}.get(kind, kind), word[3].strip(), key=word[1])
    if program := re.match(r"[O:]\s*(\d+)\w*\s*$", body):
        listing.programs[str(int(program[1]))] = len(listing.statements)
        return Statement(number, "title", key=program[1])
    for kind, pattern in _PATTERNS:
        if match := pattern.match(body):
            parts = match.groupdict()
            key = parts.get("b") or ""
            if kind == "sub":
                listing.programs[key] = len(listing.statements)
                return Statement(number, "title", key=key)
            return Statement(number, kind, parts.get("a") or "", parts.get("b") or "", parts.get("c") or "", key, column)
    if call := re.match(r"L(\d+)(?:\s+P\s*=?\s*(\d+))?\s*$", body):
        return Statement(number, "subprogram", f"L{call[1]}", call[2] or "1", column=column)
    return Statement(number, "block", body, column=column)


def _match_blocks(listing: ProgramLines) -> None:
    """Write where every branch and loop continues; blocks with names (o100) match by name, others by nesting."""
    open_blocks: list[int] = []
    statements = listing.statements
    for k, statement in enumerate(statements):
        kind = statement.kind
        opener = next((j for j in reversed(open_blocks) if statements[j].key == statement.key or not statement.key), None)
        if kind == "while" and opener is not None and statements[opener].kind == "do" and statement.key:
            statement.kind, statement.start = "dowhile", opener
            statements[opener].branch = k
            open_blocks.remove(opener)
        elif kind in ("elif", "else") and opener is not None:
            last = opener
            while statements[last].branch >= 0:
                last = statements[last].branch
            statements[last].branch, statement.start = k, opener
        elif kind in _END_OF_BLOCK:
            open_blocks.append(k)
            if kind == "sub":
                listing.programs[statement.key] = k
        elif kind in _END_OF_BLOCK.values():
            if opener is None or _END_OF_BLOCK.get(statements[opener].kind) != kind:
                listing.faults.append((statement.number, f"{kind.upper()} without its beginning"))
                continue
            last = opener
            while statements[last].branch >= 0:
                last = statements[last].branch
            statements[last].branch, statement.start = k, opener
            open_blocks.remove(opener)
    for k in open_blocks:
        listing.faults.append((statements[k].number, f"{statements[k].kind.upper()} without its end"))
