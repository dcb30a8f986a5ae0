"""Doubt: what a result may not be believed in, why, and what to do; and the status that follows from doubts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from toolpoint._rounding import plain_numbers

UNKNOWN = float("nan")
DOUBT_MARK = "doubt: "  # how a line begins that is a doubt


class Doubt(str):
    """A doubt is its sentence, ``what: why; remedy``: it prints, sorts and goes to JSON as text. Its parts stay with it.

    Parameters
    ----------
    what : str
        What is doubted: a part of a file, a channel, a mode, the limits of a chart.
    why : str
        What was seen, with its numbers.
    remedy : str, optional
        What to do or to look at.
    figure : float, optional
        How large it is, as a share (0.37: a limit known within 37 %), for who filters or sorts; not a number where none fits.
    grave : bool, optional
        Whether what rests on it must not be used: a result that carries a grave doubt withholds its advice.
    """

    what: str
    why: str
    remedy: str
    figure: float
    grave: bool

    def __new__(cls, what: str, why: str, remedy: str = "", *, figure: float = UNKNOWN, grave: bool = False) -> Doubt:
        what, why, remedy = plain_numbers(what), plain_numbers(why), plain_numbers(remedy)
        doubt = super().__new__(cls, f"{what}: {why}; {remedy}" if remedy else f"{what}: {why}")
        vars(doubt).update(what=what, why=why, remedy=remedy, figure=figure, grave=grave)
        return doubt

    @classmethod
    def parsed(cls, text: str) -> Doubt:
        """Return the doubt of a sentence ``what: why; remedy`` as files keep it; its figure is not known."""
        if isinstance(text, Doubt):
            return text
        what, colon, reason = text.partition(": ")
        if not colon:
            what, reason = "the file", text
        why, _, remedy = reason.partition("; ")
        return cls(what, why, remedy)

    def within(self, part: str) -> Doubt:
        """Return the doubt as one of a part, which is named first: ``axis X: K_v: ...``."""
        return Doubt(f"{part}: {self.what}", self.why, self.remedy, figure=self.figure, grave=self.grave)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Doubt cannot be changed; make another one with {name}={value!r}")

    def __getnewargs_ex__(self) -> tuple[tuple[str, str, str], dict[str, float | bool]]:
        return (self.what, self.why, self.remedy), {"figure": self.figure, "grave": self.grave}


def place_note(note: str, part: str) -> str:
    """Return a note as one of a part, which is named first; a doubt stays a doubt."""
    return note.within(part) if isinstance(note, Doubt) else f"{part}: {note}"


def mark_notes(notes: Iterable[str], other: str = "") -> list[str]:
    """Return notes as lines for a person: doubts begin with ``doubt:``, the others with `other`."""
    return [f"{DOUBT_MARK}{note}" if isinstance(note, Doubt) else f"{other}{plain_numbers(note)}" for note in notes]


def with_notes(lines: Iterable[str], notes: Iterable[str]) -> list[str]:
    """Return a result's lines with the doubts among its notes before them, and the other notes after them."""
    kept = tuple(notes)
    doubts = doubts_among(kept)
    return [*mark_notes(doubts), *lines, *mark_notes(note for note in kept if note not in doubts)]


def read_marked(lines: Iterable[str]) -> list[str]:
    """Return the notes of lines that `mark_notes` wrote, empty ones left out: what is marked is a doubt again."""
    return [Doubt.parsed(line.removeprefix(DOUBT_MARK)) if line.startswith(DOUBT_MARK) else line for line in lines if line]


def doubts_among(notes: Iterable[str]) -> list[Doubt]:
    """Return those of the notes that are doubts."""
    return [note for note in notes if isinstance(note, Doubt)]


def grave_among(notes: Iterable[str]) -> list[Doubt]:
    """Return the grave doubts among the notes, each once: what rests on them is withheld."""
    return list(dict.fromkeys(doubt for doubt in doubts_among(notes) if doubt.grave))


def status_of(doubts: Iterable[Doubt], good: str) -> str:
    """Return `good` where there is no doubt, else ``doubtful: `` with every doubt once."""
    lines = list(dict.fromkeys(doubts))
    return f"doubtful: {'; '.join(lines)}" if lines else good
