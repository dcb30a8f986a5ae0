"""Words of a block: comments taken away, letters with values, assignments of variables."""

from __future__ import annotations

import re
from collections.abc import MutableMapping
from dataclasses import dataclass

from toolpoint.io.program.language.expressions import ExpressionFault, Reader

# Before these a bracket belongs to an expression; anywhere else it begins a comment.
_EXPRESSION_START = re.compile(r"(?:[=+*/,(\[<>-]|\b(?:AC|IC|DC|IF|WHILE|AND|OR|NOT|UNTIL|TO|XOR)|SIN|COS|TAN|ATAN2?|SQRT|"
                               r"ABS|POT|TRUNC|ROUND|\b(?:CYCLE\d+|HOLES\d|POCKET\d|SLOT\d|LONGHOLE|MSG|WORKPIECE|PROC\s+\w+))\s*$")
_ASSIGN = re.compile(r"\s*(#\s*(?:\d+|<[^>]*>|\[|#)|R(?:\d+|\[[^\]]*\])(?=\s*=)|(?!CR\b)[A-Z_]{2,}[A-Z_0-9]*(?=\s*=(?!=)))")
# S2=500 is the second spindle's speed, not a word S of value 2.
_EXTENDED_ADDRESS = re.compile(r"\s*([SMTHDF])(\d+)\s*=")
_VECTOR = re.compile(r"\s*([ABC])([2-7])\s*=\s*(AC|IC)?")
_LETTER = re.compile(r"\s*(CR|[A-Z@^])\s*(=?)\s*(AC|IC|DC|ACP|ACN)?(?=\s*[\[(#+\-.\dRQA-Z$]|$)")
_STRING = re.compile(r'"[^"]*"')


@dataclass(frozen=True)
class Word:
    """A letter with its mode (AC, IC or nothing), value and column."""

    letter: str
    mode: str
    value: float
    column: int


class WordFault(Exception):
    """Fault of a block, at a column."""

    def __init__(self, column: int, message: str) -> None:
        super().__init__(message)
        self.column = column


def without_comments(line: str) -> str:
    """Return a line in capitals whose comments are blanks: after ``;`` and in round brackets that belong to no expression."""
    text = line.split(";", 1)[0].upper()
    if "(" not in text:
        return text.rstrip()
    out, position = [], 0
    while (start := text.find("(", position)) >= 0:
        out.append(text[position:start])
        text_before = "".join(out)
        end = _comment_end(text, start)
        if _EXPRESSION_START.search(text_before):
            out.append("(")
            position = start + 1
        else:
            out.append(" " * (end + 1 - start))
            position = end + 1
    return ("".join(out) + text[position:]).rstrip()


def _comment_end(text: str, start: int) -> int:
    """Return the end of a comment: the bracket that closes it, brackets within counted; where these do not close, the first."""
    depth = 0
    for position in range(start, len(text)):
        depth += {"(": 1, ")": -1}.get(text[position], 0)
        if depth == 0:
            return position
    first = text.find(")", start)
    return len(text) - 1 if first < 0 else first


def split_words(text: str, variables: MutableMapping[str, float], unset: set[str]) -> tuple[list[Word], dict[str, float]]:
    """Return the words of a block and the variables that it assigns, which are set in `variables` too.

    Raises
    ------
    WordFault
        At the first place that is no word.
    """
    words: list[Word] = []
    assigned: dict[str, float] = {}
    reader = Reader(_STRING.sub(lambda m: " " * len(m[0]), text), variables, unset=unset)
    while reader.skip():
        column = reader.position + 1
        try:
            if match := _ASSIGN.match(reader.text, reader.position):
                _assign(reader, match, assigned)
            elif match := _VECTOR.match(reader.text, reader.position):
                words.append(_direction(reader, match, column))
            elif match := _EXTENDED_ADDRESS.match(reader.text, reader.position):
                reader.position = match.end()
                words.append(Word(match[1], "", reader.sum() if reader.skip() else 0.0, column))
            else:
                words.append(_word(reader, column))
        except ExpressionFault as fault:
            raise WordFault(column, str(fault)) from None
        except RecursionError:
            raise WordFault(column, "an expression nested too deeply") from None
    return words, assigned


def _direction(reader: Reader, match: re.Match[str], column: int) -> Word:
    """Return a component of the tool's vector (A3, B3, C3); refuse the other ways to give a direction."""
    if match[2] != "3":
        what = {"2": "Euler or roll-pitch-yaw angles", "4": "a normal of the surface", "5": "a normal of the surface"}
        raise WordFault(column, f"{match[1]}{match[2]}=: {what.get(match[2], 'this direction of the tool')} not computed; post "
                        "A3, B3, C3 or the angles of the axes")
    reader.position = match.end()
    return Word(f"{match[1]}3", "", reader.sum(), column)


def _assign(reader: Reader, match: re.Match[str], assigned: dict[str, float]) -> None:
    if match[1][0] in "#R" and re.match(r"\s*[#R](?=[\s\d<\[#])", match[1]):
        name = reader.variable_name()
    else:
        name, reader.position = match[1].strip(), match.end()
        if name not in reader.variables:
            raise ExpressionFault(f"{name}= is not in the subset")
    if not reader.take("="):
        raise ExpressionFault(f"'=' is missing behind {name}")
    value = reader.value()
    assigned[name] = reader.variables[name] = value


def _word(reader: Reader, column: int) -> Word:
    match = _LETTER.match(reader.text, reader.position)
    if match is None:
        piece = reader.text[reader.position:].split()[0]
        raise WordFault(column, f"{piece!r} is not a word of the subset")
    reader.position = match.end()
    mode = match[3] or ""
    if not mode and re.match(r"\s*[A-Z](?![A-Z]*[\[(])", reader.text[reader.position:]) and not match[2] and \
            not re.match(r"\s*(?:R\d|Q[LRS]?\d)", reader.text[reader.position:]):
        piece = reader.text[column - 1:].split()[0]
        raise WordFault(column, f"{piece!r} is not a word of the subset")
    if match[1] == "T" and match[2] and (not reader.skip() or re.match(r"[DMSF]\d", reader.text[reader.position:])):
        return Word("T", "", 0.0, column)  # a tool called by its name
    value = reader.sum()
    return Word(match[1], mode if mode in ("AC", "IC") else "", value, column)
